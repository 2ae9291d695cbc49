"""Opens recordings in a real Rerun viewer without a display, and looks at the pictures.

    python tests/python/check_rerun.py VIEW.rrd ANNOTATED.mcap [--keep FOLDER]

VIEW.rrd is what `divmerge view` or `divmerge annotate --rerun` made, ANNOTATED.mcap what `divmerge annotate`
made of the same drive. Each picture must show something, and the colours of the instances must be in it: they
are read from the annotated recording, so that nothing here depends on how divmerge chooses them.

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
from rerun.experimental import ViewerClient

VIEWER = pathlib.Path(rerun.__file__).parents[1] / "rerun_cli" / "rerun"
WINDOW = (1600, 1000)
# What a cloud topic T leaves in the stream, below T.
ENTITIES = """
    cloud/class cloud/component cloud/instance boxes votes/merged votes/apart dropped/unreached
    dropped/too_small image/range image/component image/instance series/milliseconds series/instances series/suspicion log
""".split()
# A software rasteriser on a busy machine may need several times the seconds it usually does.
ATTEMPTS = 4
# Instances whose colours must be seen, of the largest of the last frame.
LARGEST = 20
WANTED = 12
# Pixels that make a colour seen: a few points.
SEEN = 30


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


def view_of(topic: str, annotated: str, folder: pathlib.Path) -> str:
    """A layout that shows one topic of a recording; by itself the viewer draws the cloud topic over it."""
    view = rrb.Spatial3DView(
        origin=topic,
        contents=[topic],
        line_grid=rrb.LineGrid3D(visible=False),
        background=[16, 18, 22],
        defaults=[rerun.Points3D.from_fields(point_shading="Flat")],
        eye_controls=rrb.EyeControls3D(
            position=[-24, -10, 19], look_target=[3, 0, -2], eye_up=[0, 0, 1]
        ),
    )
    path = folder / "instances.rbl"
    blueprint = rrb.Blueprint(view, collapse_panels=True)
    blueprint.save(pathlib.Path(annotated).stem, str(path))
    return str(path)


def problem_with(picture: np.ndarray, colours: list[tuple[int, int, int]]) -> str | None:
    if np.unique(picture.reshape(-1, 3), axis=0).shape[0] < 100:
        return "the picture is blank"
    flat = picture.reshape(-1, 3).astype(int)
    counts = [int((abs(flat - colour).max(axis=1) <= 3).sum()) for colour in colours]
    seen = sum(count >= SEEN for count in counts)
    print(f"  {seen} of {len(colours)} instance colours seen, in {sum(counts)} pixels")
    if seen < min(WANTED, len(colours)):
        return f"only {seen} of {len(colours)} instance colours are in the picture: {counts}"
    return None


def check(files: list[str], picture: pathlib.Path, colours: list[tuple[int, int, int]]) -> None:
    problem = None
    for attempt in range(ATTEMPTS):
        try:
            problem = problem_with(screenshot(files, picture, 8.0 * (attempt + 1)), colours)
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
    arguments.add_argument("--keep", help="folder for the pictures", default=None)
    options = arguments.parse_args()
    folder = pathlib.Path(options.keep or tempfile.mkdtemp(prefix="rerun"))
    folder.mkdir(parents=True, exist_ok=True)

    topic, colours = instance_colours(options.annotated)
    check_entities(options.rrd, topic.removesuffix("/instances"))
    print(f"{options.rrd} in its own layout")
    check([options.rrd], folder / "rrd.png", colours)
    print(f"{options.annotated}, {topic}")
    layout = view_of(topic, options.annotated, folder)
    check([options.annotated, layout], folder / "annotated.png", colours)


if __name__ == "__main__":
    main()
