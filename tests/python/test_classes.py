"""Classes that others found: images and files by writers that are not ours.

Needs the release binary (`cargo build --release`) and `pip install -r tests/python/requirements.txt`.
"""

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros1.decoder import DecoderFactory as Ros1Factory
from mcap_ros2.decoder import DecoderFactory as Ros2Factory
from rosbags.typesys import Stores, get_typestore

import recording_writers as writers
from test_independent_readers import run

ROWS = 32
COLUMNS = len(writers.POINTS) // ROWS
CAR, TRUCK = 10, 18
# The near wall is a car, the far one a truck.
CLASSES = np.repeat([CAR, TRUCK], len(writers.POINTS) // 2)


def record(path, version):
    """A recording of one organised cloud, and its classes as an image."""
    store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)
    stamp = store.types["builtin_interfaces/msg/Time"](*writers.STAMP)
    counter = {"seq": 9} if version == 1 else {}
    header = store.types["std_msgs/msg/Header"](stamp=stamp, frame_id=writers.FRAME, **counter)
    field = store.types["sensor_msgs/msg/PointField"]
    fields = [field(name=n, offset=4 * i, datatype=7, count=1) for i, n in enumerate(writers.NAMES)]
    cloud = store.types["sensor_msgs/msg/PointCloud2"](
        header=header, height=ROWS, width=COLUMNS, fields=fields, is_bigendian=False, point_step=16,
        row_step=16 * COLUMNS, data=np.frombuffer(writers.DATA, np.uint8), is_dense=True,
    )
    pixels = CLASSES.reshape(ROWS, COLUMNS).astype(">u2")
    image = store.types["sensor_msgs/msg/Image"](
        header=header, height=ROWS, width=COLUMNS, encoding="mono16", is_bigendian=1,
        step=2 * COLUMNS, data=np.frombuffer(pixels.tobytes(), np.uint8),
    )
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start(profile=f"ros{version}")
        for topic, name, message in [
            ("/points", "sensor_msgs/msg/PointCloud2", cloud),
            ("/predictions", "sensor_msgs/msg/Image", image),
        ]:
            definition, _ = store.generate_msgdef(name, ros_version=version)
            short = name.replace("/msg/", "/") if version == 1 else name
            schema = writer.register_schema(short, f"ros{version}msg", definition.encode())
            channel = writer.register_channel(topic, "ros1" if version == 1 else "cdr", schema)
            serialize = store.serialize_ros1 if version == 1 else store.serialize_cdr
            writer.add_message(channel, 5, bytes(serialize(message, name)), 5)
        writer.finish()


def labels(path):
    """Class and instance of each point of the annotated cloud."""
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[Ros1Factory(), Ros2Factory()])
        for _, channel, _, cloud in reader.iter_decoded_messages():
            if channel.topic == "/points/instances":
                names = {field.name: field.offset for field in cloud.fields}
                rows = np.frombuffer(bytes(cloud.data), np.uint8).reshape(-1, cloud.point_step)

                def column(name, kind):
                    at, size = names[name], np.dtype(kind).itemsize
                    return rows[:, at : at + size].copy().view(kind)[:, 0]

                return column("semantic", "<u2"), column("instance", "<u4")
    raise AssertionError("no annotated cloud")


def check(output):
    classes, instances = labels(output)
    assert np.array_equal(classes, CLASSES)
    assert len(set(instances)) == 2 and len(set(instances[CLASSES == CAR])) == 1


@pytest.mark.parametrize("version", [1, 2])
def test_an_image_of_classes(tmp_path, version):
    drive, output = tmp_path / "drive.mcap", tmp_path / "out.mcap"
    record(drive, version)
    run("annotate", drive, "-o", output, "--semantics", "topic:/predictions")
    check(output)


@pytest.mark.parametrize("kind", ["int64", "uint8", "words", "column", "scores"])
def test_arrays_of_numpy(tmp_path, kind):
    drive, output, folder = tmp_path / "drive.mcap", tmp_path / "out.mcap", tmp_path / "labels"
    record(drive, 2)
    folder.mkdir()
    scores = np.zeros((len(CLASSES), 20), np.float64)
    scores[np.arange(len(CLASSES)), np.where(CLASSES == CAR, 1, 4)] = 9.0
    array = {
        "int64": CLASSES.astype(np.int64),
        "uint8": CLASSES.astype(np.uint8),
        "words": (CLASSES | (7 << 16)).astype(np.uint32),
        "column": CLASSES.astype(">i4")[:, None],
        "scores": np.asfortranarray(scores),
    }[kind]
    stamp = writers.STAMP[0] * 10**9 + writers.STAMP[1]
    name = "000000.npy" if kind != "uint8" else f"{stamp}.npy"
    np.save(folder / name, array)
    run("annotate", drive, "-o", output, "--semantics", f"labels:{folder}")
    check(output)
