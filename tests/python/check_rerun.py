"""Opens recordings in a real Rerun viewer without a display, and looks at the pictures.

    python tests/python/check_rerun.py VIEW.rrd ANNOTATED.mcap PAIR.rrd [--live LIVE.rrd] [--keep FOLDER]

VIEW.rrd is what `divmerge view` made of a drive with truth, ANNOTATED.mcap what `divmerge annotate --blueprint`
made of the same drive, with ANNOTATED.rbl beside it, and PAIR.rrd what `divmerge explain --rerun` made of two points
that votes kept apart. LIVE.rrd is what `divmerge annotate --rerun` sent meanwhile: it has the truth, too. Each
picture must show something, and the colours that it is about must be in it: they are read from the recordings, so
that nothing here depends on how divmerge chooses them.

Needs rerun-sdk (of the version that divmerge is built with), mcap-ros2-support, numpy and pillow, and a Vulkan
driver (Mesa's will do: apt-get install mesa-vulkan-drivers libgl1-mesa-dri libegl1 libxkbcommon-x11-0).
"""

import argparse
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import time

import mcap.reader
import numpy as np
import rerun
import rerun.blueprint as rrb
from mcap_ros2.decoder import DecoderFactory
from PIL import Image
from rerun.experimental import RrdReader, ViewerClient

VIEWER = pathlib.Path(rerun.__file__).parents[1] / "rerun_cli" / "rerun"
WINDOW = (1600, 1000)
# What a cloud topic T leaves in the stream, below T.
ENTITIES = """
    cloud/class cloud/component cloud/instance cloud/reason cloud/truth boxes/objects boxes/background boxes/names
    votes/merged votes/rejoined votes/apart dropped/unreached dropped/too_small tracks/boxes tracks/trails tracks/sensor
    image/range image/component image/instance image/reason series/milliseconds series/instances series/suspicion log
""".split()
# A software rasteriser on a busy machine may need several times the seconds it usually does.
ATTEMPTS = 4
# Instances whose colours must be seen, of the largest of the last frame.
LARGEST = 20
WANTED = 12
# Pixels that make a colour seen: a few points.
SEEN = 30
# Names beside boxes that can still be read.
MOST_NAMES = 15
# Application of the recording without its own layout.
LAYERS = "layers"
Colour = tuple[int, int, int]


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def screenshot(files: list[str], picture: pathlib.Path, seconds: float) -> np.ndarray:
    """The viewer's window, once it has had some seconds to load the files."""
    port = free_port()
    runtime = tempfile.mkdtemp(prefix="runtime")
    environment = dict(os.environ, XDG_RUNTIME_DIR=runtime, WGPU_BACKEND="vulkan")
    size = "x".join(map(str, WINDOW))
    options = ["--headless", "--bind", "127.0.0.1", "--port", str(port), "--window-size", size]
    with tempfile.TemporaryFile() as log:
        command = [VIEWER, *options, "--renderer", "vulkan", *files]
        viewer = subprocess.Popen(command, env=environment, stdout=log, stderr=subprocess.STDOUT)
        try:
            time.sleep(seconds)
            client = ViewerClient(url=f"rerun+http://127.0.0.1:{port}/proxy")
            client.save_screenshot(str(picture))
            return read_when_whole(picture)
        except Exception:
            log.seek(0)
            sys.stderr.write(log.read().decode(errors="replace"))
            raise
        finally:
            viewer.kill()
            viewer.wait()


def read_when_whole(picture: pathlib.Path) -> np.ndarray:
    """The viewer writes the file after it has answered."""
    for _ in range(100):
        time.sleep(0.1)
        try:
            return np.asarray(Image.open(picture).convert("RGB"))
        except (OSError, SyntaxError):
            continue
    raise TimeoutError(f"{picture} was never complete")


def instance_colours(annotated: str) -> tuple[str, list[tuple[int, int, int]]]:
    """The cloud topic, and the colours of the largest instances of its last frame."""
    with open(annotated, "rb") as stream:
        reader = mcap.reader.make_reader(stream, decoder_factories=[DecoderFactory()])
        topics = [channel.topic for channel in reader.get_summary().channels.values()]
        topic = next(topic for topic in topics if topic.endswith("/instances"))
        *_, (_, _, _, cloud) = reader.iter_decoded_messages(topics=[topic])
    types = {1: "i1", 2: "u1", 3: "<i2", 4: "<u2", 5: "<i4", 6: "<u4", 7: "<f4", 8: "<f8"}
    layout = {
        "names": [field.name for field in cloud.fields],
        "formats": [types[field.datatype] for field in cloud.fields],
        "offsets": [field.offset for field in cloud.fields],
        "itemsize": cloud.point_step,
    }
    points = np.frombuffer(bytes(cloud.data), dtype=layout)
    column = "track" if "track" in points.dtype.names else "instance"
    ids, counts = np.unique(points[column][points[column] > 0], return_counts=True)
    colours = []
    for instance in ids[np.argsort(-counts)][:LARGEST]:
        rgba = int(points["colors"][points[column] == instance][0])
        colours.append((rgba >> 24, rgba >> 16 & 255, rgba >> 8 & 255))
    return topic, colours


def layer(topic: str, contents: list[str], name: str, folder: pathlib.Path) -> str:
    """A layout that shows some entities of a topic alone, seen as by divmerge."""
    view = rrb.Spatial3DView(
        origin=topic,
        contents=[f"{topic}/{entity}" for entity in contents],
        line_grid=rrb.LineGrid3D(visible=False),
        background=[16, 18, 22],
        eye_controls=rrb.EyeControls3D(position=[-24, -10, 19], look_target=[3, 0, -2], eye_up=[0, 0, 1]),
    )
    path = folder / f"{name}.rbl"
    rrb.Blueprint(view, collapse_panels=True).save(LAYERS, str(path))
    return str(path)


class Recording:
    """What is in a `.rrd`: the columns of each entity, the last row of each chunk."""

    def __init__(self, rrd: str) -> None:
        self.rows: dict[str, list[tuple[int, dict]]] = {}
        for chunk in RrdReader(rrd).stream():
            batch = chunk.to_record_batch()
            row = {name.split(":", 1)[-1]: batch.column(name)[-1].as_py() for name in batch.schema.names}
            number = batch.column("frame")[-1].as_py() if "frame" in batch.schema.names else -1
            self.rows.setdefault(chunk.entity_path, []).append((number, row))

    def last(self, entity: str, column: str) -> list:
        """A column of an entity as it was logged last."""
        rows = [(number, row) for number, row in self.rows[entity] if row.get(column) is not None]
        return max(rows, key=lambda row: row[0])[1][column]

    def colours(self, entity: str, column: str = "colors") -> list[Colour]:
        rgba = self.last(entity, column)
        return [(colour >> 24, colour >> 16 & 255, colour >> 8 & 255) for colour in rgba]

    def meanings(self, entity: str) -> dict[int, tuple[str | None, Colour]]:
        """Name and colour of each class id below an entity."""
        context = self.last(entity, "context")
        infos = [entry["class_description"]["info"] for entry in context[0]]
        colour = lambda rgba: (rgba >> 24, rgba >> 16 & 255, rgba >> 8 & 255)  # noqa: E731
        return {info["id"]: (info["label"], colour(info["color"])) for info in infos}


def require(holds: bool, problem: str) -> None:
    if not holds:
        sys.exit(problem)


def check_names(recording: Recording, topic: str) -> None:
    """All boxes have names, of which few are shown without being asked for."""
    objects, names = f"{topic}/boxes/objects", f"{topic}/boxes/names"
    labels, shown = recording.last(objects, "labels"), recording.last(names, "labels")
    require(len(labels) > MOST_NAMES, f"{objects}: only {len(labels)} objects")
    require(recording.last(objects, "show_labels") == [False], f"{objects}: labels are shown")
    require(len(shown) == MOST_NAMES and set(shown) <= set(labels), f"{names}: {shown}")
    for entity in ("cloud/instance", "cloud/reason", "dropped/unreached", "dropped/too_small"):
        shows = recording.last(f"{topic}/{entity}", "show_labels")
        require(shows == [False], f"{entity}: labels are shown")


def check_strips(recording: Recording, topic: str) -> None:
    """Range images are drawn an eighth as high as wide."""
    size = recording.last(f"{topic}/image/instance", "format")[0]
    high = recording.last(f"{topic}/image/instance", "scale")[0][1]
    shape = size["width"] / (size["height"] * high)
    require(abs(shape - 8) < 0.01, f"the range image is {shape:.2f} times as wide as high")


def check_tracks(recording: Recording, topic: str) -> None:
    """What moves has a trail, as has the sensor; a trail ends where its object stands."""
    strips = recording.last(f"{topic}/tracks/trails", "strips")
    sensor = np.array(recording.last(f"{topic}/tracks/sensor", "strips")[0])
    require(max(map(len, strips)) >= 10, f"tracks/trails: {len(strips)} strips, none of ten places")
    require(np.linalg.norm(sensor[-1]) < 0.01, f"the sensor's way ends at {sensor[-1]}")
    require(np.linalg.norm(sensor[0]) > 1, f"the sensor's way begins at {sensor[0]}")
    centres = np.array(recording.last(f"{topic}/tracks/boxes", "centers"))[:, :2]
    ends = [np.array(strip[-1])[:2] for strip in strips]
    at_box = sum(np.linalg.norm(centres - end, axis=1).min() < 0.01 for end in ends)
    require(at_box >= len(ends) / 2, f"{at_box} of {len(ends)} trails end at a box")


def check_pair(recording: Recording, topic: str) -> list[Colour]:
    """The pair's scene is cropped, and says why. Returns the colours to be seen."""
    points = np.array(recording.last(f"{topic}/explanation/points", "positions"))
    scene = np.array(recording.last(f"{topic}/explanation/instance", "positions"))
    far = np.linalg.norm(scene[:, None] - points[None], axis=2).min(axis=1).max()
    apart = np.linalg.norm(points[0] - points[1])
    require(len(points) == 2 and len(scene) > 50, f"{len(points)} points in {len(scene)}")
    require(far <= max(4, 0.75 * apart) + 0.01, f"{far:.1f} m around points {apart:.1f} m apart")
    (words,) = recording.last(f"{topic}/explanation/text", "text")
    require("Why:" in words and "against" in words, f"no explanation: {words}")
    against = f"{topic}/explanation/votes/against"
    require(len(recording.last(against, "strips")) > 0, "no votes against")
    return [*recording.colours(f"{topic}/explanation/points"), *recording.colours(against)]


def problem_with(picture: np.ndarray, colours: list[Colour], wanted: int) -> str | None:
    if np.unique(picture.reshape(-1, 3), axis=0).shape[0] < 100:
        return "the picture is blank"
    flat = picture.reshape(-1, 3).astype(int)
    counts = [int((abs(flat - colour).max(axis=1) <= 3).sum()) for colour in colours]
    seen = sum(count >= SEEN for count in counts)
    print(f"  {seen} of {len(colours)} colours seen, in {sum(counts)} pixels")
    if seen < min(wanted, len(colours)):
        return f"only {seen} of {len(colours)} colours are in the picture: {counts}"
    return None


def check(files: list[str], picture: pathlib.Path, colours: list[Colour], wanted: int = WANTED) -> None:
    print(f"{' '.join(files)}: {picture.name}")
    problem = None
    for attempt in range(ATTEMPTS):
        try:
            problem = problem_with(screenshot(files, picture, 8.0 * (attempt + 1)), colours, wanted)
        except Exception as error:  # a render that timed out
            problem = f"{type(error).__name__}: {error}"
        if problem is None:
            return
        print(f"  attempt {attempt + 1}: {problem}")
    sys.exit(f"{files[0]}: {problem}")


def check_entities(rrd: str, topic: str) -> None:
    """Every entity is there, on all three timelines."""
    subprocess.run([VIEWER, "rrd", "verify", rrd], check=True, capture_output=True)

    def printed(*options: str) -> str:
        command = [VIEWER, "rrd", "print", *options, rrd]
        return subprocess.run(command, check=True, capture_output=True).stdout.decode()

    chunks = printed("-v")
    missing = [name for name in ENTITIES if f"{topic}/{name} " not in chunks]
    columns = printed("-vv", "--entity", f"{topic}/series/instances")
    missing += [name for name in ("frame", "stamp", "message_log_time") if name not in columns]
    if missing:
        sys.exit(f"{rrd}: not in it: {missing}")


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("rrd")
    arguments.add_argument("annotated")
    arguments.add_argument("pair")
    arguments.add_argument("--live", default=None)
    arguments.add_argument("--keep", help="folder for the pictures", default=None)
    options = arguments.parse_args()
    folder = pathlib.Path(options.keep or tempfile.mkdtemp(prefix="rerun"))
    folder.mkdir(parents=True, exist_ok=True)

    instances, colours = instance_colours(options.annotated)
    topic = instances.removesuffix("/instances")
    check_entities(options.rrd, topic)
    recording = Recording(options.rrd)
    check_names(recording, topic)
    check_strips(recording, topic)
    check_tracks(recording, topic)
    check([options.rrd], folder / "rrd.png", colours)

    bare = str(folder / "layers.rrd")
    RrdReader(options.rrd).stream().write_rrd(bare, application_id=LAYERS, recording_id=LAYERS)

    def check_layer(name: str, contents: list[str], colours: list[Colour], wanted: int) -> None:
        layout = layer(topic, contents, name, folder)
        check([bare, layout], folder / f"{name}.png", colours, wanted)

    meanings = recording.meanings(topic)
    ids = set(recording.last(f"{topic}/cloud/reason", "class_ids"))
    require(len(ids) > 1, f"cloud/reason: one reason alone, {ids}")
    reasons = {meanings[id][0]: meanings[id][1] for id in ids}
    require("instance" in reasons and None not in reasons, f"cloud/reason: {reasons}")
    common = [reasons["instance"], reasons["not an object"]]
    check_layer("reasons", ["cloud/reason"], common, len(common))
    truth = recording.meanings(f"{topic}/cloud/truth")
    ids, counts = np.unique(recording.last(f"{topic}/cloud/truth", "class_ids"), return_counts=True)
    largest = [truth[id][1] for id in ids[np.argsort(-counts)][:LARGEST]]
    check_layer("truth", ["cloud/truth"], largest, WANTED)
    if options.live:
        own, other = (one.last(f"{topic}/cloud/truth", "class_ids") for one in (recording, Recording(options.live)))
        require(len(own) > 0 and own == other, f"{options.live}: another truth than that of {options.rrd}")
    trails = recording.colours(f"{topic}/tracks/trails")
    check_layer("tracks", ["tracks/trails"], trails, min(5, len(trails)))
    classes = recording.meanings(f"{topic}/cloud/class")
    names = {classes[id][0] for id in set(recording.last(f"{topic}/cloud/class", "class_ids"))}
    require({"car", "person", "road"} <= names, f"cloud/class: {names}")

    pair = check_pair(Recording(options.pair), topic)
    check([options.pair], folder / "pair.png", pair, len(pair))
    layout = str(pathlib.Path(options.annotated).with_suffix(".rbl"))
    check([options.annotated, layout], folder / "annotated.png", colours)


if __name__ == "__main__":
    main()
