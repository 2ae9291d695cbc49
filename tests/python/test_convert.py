"""What `divmerge convert` writes, against the files and numpy's own arithmetic, through readers that are not ours."""

import shutil

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from needed import needed
from test_independent_readers import RECORDINGS, points, run

# A scanner 0.27 m behind and 0.08 m above a camera that looks ahead, turned a little; as exact as KITTI's.
ROLL, YAW = 0.008, -0.002
AXES = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])


def rotation(axis, angle):
    """Rotation about a coordinate axis, radians."""
    c, s = np.cos(angle), np.sin(angle)
    turned = np.eye(3)
    others = [other for other in range(3) if other != axis]
    turned[np.ix_(others, others)] = [[c, -s], [s, c]]
    return turned


def rigid(turn, move):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, move
    return matrix


def line(matrix):
    return " ".join(f"{number:.12e}" for number in matrix[:3].ravel())


TR = rigid(AXES @ rotation(0, ROLL) @ rotation(2, YAW), [-0.004, -0.0763, -0.2718])
CAMERAS = {
    0: [707.0912, 0, 601.8873, 0, 0, 707.0912, 183.1104, 0, 0, 0, 1, 0],
    3: [707.0912, 0, 601.8873, -333.4597, 0, 707.0912, 183.1104, 1.93013, 0, 0, 1, 0.003318498],
}


def make_sequence(folder, rng):
    (folder / "velodyne").mkdir(parents=True)
    (folder / "labels").mkdir()
    poses = []
    for number in range(5):
        scan = rng.normal(size=(1000, 4)).astype("<f4")
        scan.tofile(folder / "velodyne" / f"{number:06}.bin")
        words = rng.choice([10, 30, 40, 70, 252], 1000) | rng.integers(0, 1 << 16, 1000) << 16
        words.astype("<u4").tofile(folder / "labels" / f"{number:06}.label")
        turn = rotation(1, 0.4 * number) @ rotation(0, 0.02 * number) @ rotation(2, -0.01 * number)
        poses.append(rigid(turn, [0.1 * number, -0.02 * number, 1.3 * number]))
    (folder / "poses.txt").write_text("".join(line(pose) + "\n" for pose in poses))
    (folder / "times.txt").write_text("".join(f"{0.1037 * number:e}\n" for number in range(5)))
    cameras = [f"P{number}: {' '.join(map(str, p))}\n" for number, p in CAMERAS.items()]
    (folder / "calib.txt").write_text("".join(cameras) + f"Tr: {line(TR)}\n")
    return poses


@pytest.fixture(params=["random", "semantickitti"])
def sequence(request, tmp_path):
    """A folder, the poses of its camera, and the recording that it becomes."""
    folder = tmp_path / "dataset" / "sequences" / "04"
    if request.param == "random":
        poses = make_sequence(folder, np.random.default_rng(4))
    else:
        source = RECORDINGS.parent / "semantickitti" / "sequences" / "04"
        if not source.exists():
            pytest.skip(f"no {source}")
        shutil.copytree(source, folder)
        if "Tr:" not in (folder / "calib.txt").read_text():
            with open(folder / "calib.txt", "a") as file:
                file.write(f"Tr: {line(TR)}\n")
        rows = np.loadtxt(folder / "poses.txt").reshape(-1, 3, 4)
        poses = [rigid(row[:, :3], row[:, 3]) for row in rows]
    output = tmp_path / "04.mcap"
    run("convert", "semantickitti", tmp_path / "dataset", "-o", output, "--labels")
    return folder, poses, output


def decoded(path):
    """Messages by topic: log time and content."""
    found = {}
    with open(path, "rb") as file:
        for _, channel, message, content in make_reader(
            file, validate_crcs=True, decoder_factories=[DecoderFactory()]
        ).iter_decoded_messages():
            assert message.publish_time == message.log_time
            found.setdefault(channel.topic, []).append((message.log_time, content))
    return found


def nanoseconds(stamp):
    return stamp.sec * 10**9 + stamp.nanosec


def matrix_of(transform):
    """The matrix of a message's translation and unit quaternion."""
    q = transform.rotation
    x, y, z, w = q.x, q.y, q.z, q.w
    assert abs(x * x + y * y + z * z + w * w - 1) < 1e-9
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])
    t = transform.translation
    return rigid(turn, [t.x, t.y, t.z])


def test_clouds_and_labels_are_the_files(sequence):
    folder, _, output = sequence
    clouds = decoded(output)["/velodyne_points"]
    scans = sorted((folder / "velodyne").iterdir())
    times = np.loadtxt(folder / "times.txt")
    assert len(clouds) == len(scans) == len(times)
    for (log_time, cloud), scan, time in zip(clouds, scans, times):
        assert log_time == nanoseconds(cloud.header.stamp) == 946684800 * 10**9 + round(time * 1e9)
        assert cloud.header.frame_id == "velodyne" and cloud.is_dense
        table = points(cloud)
        columns = np.stack([table[name] for name in ("x", "y", "z", "intensity")], axis=1)
        assert columns.tobytes() == scan.read_bytes()
        words = table["label"].astype(np.uint32) | table["true_instance"].astype(np.uint32) << 16
        label = folder / "labels" / scan.with_suffix(".label").name
        assert words.tobytes() == label.read_bytes()


def test_poses_are_those_of_the_scanner(sequence):
    _, poses, output = sequence
    found = decoded(output)
    calibration = (sequence[0] / "calib.txt").read_text().splitlines()
    (text,) = [line.split(":")[1] for line in calibration if line.startswith("Tr:")]
    tr = np.vstack([np.array(text.split(), float).reshape(3, 4), [0, 0, 0, 1]])
    assert len(found["/tf"]) == len(poses)
    for (log_time, message), pose, (cloud_time, _) in zip(found["/tf"], poses, found["/velodyne_points"]):
        (transform,) = message.transforms
        assert log_time == nanoseconds(transform.header.stamp) == cloud_time
        assert (transform.header.frame_id, transform.child_frame_id) == ("map", "velodyne")
        expected = np.linalg.inv(tr) @ pose @ tr
        # Files have six digits.
        assert np.abs(matrix_of(transform.transform) - expected).max() < 2e-5
    ((_, message),) = found["/tf_static"]
    (transform,) = message.transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("velodyne", "camera_0")
    assert np.abs(matrix_of(transform.transform) - np.linalg.inv(tr)).max() < 1e-9


def test_cameras_project_as_the_calibration_says(sequence):
    folder, _, output = sequence
    found = decoded(output)
    lines = dict(line.split(":") for line in (folder / "calib.txt").read_text().splitlines())
    cameras = {int(key[1]): np.array(text.split(), float) for key, text in lines.items() if key[0] == "P"}
    assert len(cameras) in (2, 4)
    for number, p in cameras.items():
        ((_, info),) = found[f"/camera_{number}/camera_info"]
        assert info.header.frame_id == "camera_0"
        assert (np.array(info.p) == p).all()
        assert (np.array(info.k).reshape(3, 3) == p.reshape(3, 4)[:, :3]).all()
        assert (np.array(info.r).reshape(3, 3) == np.eye(3)).all()
        assert info.distortion_model == "plumb_bob" and list(info.d) == [0.0] * 5
        assert not info.roi.do_rectify and info.roi.width == 0
    with open(output, "rb") as file:
        (attachment,) = make_reader(file).iter_attachments()
    assert attachment.name == "calib.txt" and attachment.data == (folder / "calib.txt").read_bytes()


@pytest.mark.parametrize("kind", ["f4", "f8", "fortran", "records", "image", "big"])
def test_arrays_that_numpy_saves(tmp_path, kind):
    rng = np.random.default_rng(1)
    array = rng.normal(size=(60, 4)).astype("<f4")
    saved = {
        "f4": array,
        "f8": array.astype("<f8"),
        "fortran": np.asfortranarray(array),
        "image": array.reshape(5, 12, 4),
        "big": array.astype(">f4"),
    }.get(kind)
    if kind == "records":
        layout = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("ring", "u1"), ("intensity", "<f8")], align=True)
        saved = np.zeros(60, layout)
        for column, name in enumerate(("x", "y", "z", "intensity")):
            saved[name] = array[:, column]
        saved["ring"] = np.arange(60)
    (tmp_path / "scans").mkdir()
    np.save(tmp_path / "scans" / "0.npy", saved)
    run("convert", "folder", tmp_path / "scans", "-o", tmp_path / "out.mcap")
    ((_, cloud),) = decoded(tmp_path / "out.mcap")["/points"]
    assert (cloud.height, cloud.width) == ((5, 12) if kind == "image" else (1, 60))
    assert cloud.is_bigendian == (kind == "big")
    if kind == "big":
        table = np.frombuffer(bytes(cloud.data), ">f4").reshape(-1, 4)
        assert (table == array).all()
        return
    table = points(cloud)
    for column, name in enumerate(("x", "y", "z", "intensity")):
        assert (table[name] == array[:, column]).all(), name
    if kind == "records":
        assert (table["ring"] == np.arange(60)).all()


@pytest.mark.parametrize("encoding", ["ASCII", "BINARY", "BINARY_COMPRESSED"])
def test_pcd_files_that_another_writer_makes(tmp_path, encoding):
    pypcd4 = needed("pypcd4")
    rng = np.random.default_rng(2)
    # Two digits behind the point, which repeat enough to be compressed.
    columns = {name: np.round(rng.normal(size=3000), 2).astype("f4") for name in ("x", "y", "z")}
    columns["intensity"] = rng.integers(0, 4, 3000).astype("u1")
    columns["t"] = np.round(rng.normal(size=3000), 3)
    columns["ring"] = rng.integers(0, 64, 3000).astype("u2")
    types = [column.dtype.type for column in columns.values()]
    cloud = pypcd4.PointCloud.from_points(list(columns.values()), list(columns), types)
    (tmp_path / "scans").mkdir()
    cloud.save(tmp_path / "scans" / "0.pcd", encoding=pypcd4.Encoding[encoding])
    run("convert", "folder", tmp_path / "scans", "-o", tmp_path / "out.mcap")
    ((_, message),) = decoded(tmp_path / "out.mcap")["/points"]
    table = points(message)
    assert table.dtype.names == tuple(columns)
    for name, column in columns.items():
        assert table[name].dtype == column.dtype and (table[name] == column).all(), name
