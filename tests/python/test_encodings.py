"""Every encoding of clouds: what we write is opened by readers that are not ours, what others write is read by us."""

import base64
import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as ProtobufFactory
from mcap_ros1.decoder import DecoderFactory as Ros1Factory
from mcap_ros2.decoder import DecoderFactory as Ros2Factory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

import recording_writers

ROOT = Path(__file__).resolve().parents[2]
BINARY = ROOT / "target" / "release" / "divmerge"
TOPIC = "/lidar/points"
ROS_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
FOXGLOVE_TYPES = {1: "u1", 2: "i1", 3: "u2", 4: "i2", 5: "u4", 6: "i4", 7: "f4", 8: "f8"}
ENCODINGS = ["ros2", "ros1", "foxglove-ros2", "foxglove-protobuf", "foxglove-json"]


def run(*arguments):
    done = subprocess.run([BINARY, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def decoded(path):
    """Every message of a recording, by topic, decoded by the reader for its encoding; JSON by Python itself."""
    found = {}
    factories = [Ros1Factory(), Ros2Factory(), ProtobufFactory()]
    with open(path, "rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            decoders = [f.decoder_for(channel.message_encoding, schema) for f in factories]
            decoder = next((decoder for decoder in decoders if decoder), json.loads)
            found.setdefault(channel.topic, []).append((message, decoder(message.data)))
    return found


def table(cloud):
    """A cloud of any encoding as a structured array, and the bytes of its points."""
    get = cloud.get if isinstance(cloud, dict) else lambda name: getattr(cloud, name, None)
    is_foxglove = get("point_stride") is not None
    types, step = (FOXGLOVE_TYPES, get("point_stride")) if is_foxglove else (ROS_TYPES, get("point_step"))
    fields = [(f["name"], f["offset"], f["type"]) if isinstance(f, dict) else
              (f.name, f.offset, f.type if is_foxglove else f.datatype) for f in get("fields")]
    data = base64.b64decode(get("data"), validate=True) if isinstance(cloud, dict) else bytes(get("data"))
    layout = np.dtype({
        "names": [name for name, *_ in fields],
        "formats": [types[kind] for *_, kind in fields],
        "offsets": [offset for _, offset, _ in fields],
        "itemsize": step,
    })
    return np.frombuffer(data, layout), np.frombuffer(data, np.uint8).reshape(-1, step)


def stamp(cloud):
    if isinstance(cloud, dict):
        return cloud["timestamp"]["sec"], cloud["timestamp"]["nsec"]
    time = cloud.timestamp if hasattr(cloud, "timestamp") else cloud.header.stamp
    for seconds, nanoseconds in (("seconds", "nanos"), ("sec", "nanosec"), ("secs", "nsecs")):
        if hasattr(time, seconds):
            return getattr(time, seconds), getattr(time, nanoseconds)
    raise AssertionError(time)


def check(clouds, annotated):
    assert len(clouds) == len(annotated) > 0
    for (before, cloud), (after, ours) in zip(clouds, annotated):
        assert (before.log_time, before.sequence) == (after.log_time, after.sequence)
        assert stamp(cloud) == stamp(ours)
        (_, rows), (points, our_rows) = table(cloud), table(ours)
        assert (our_rows[:, : rows.shape[1]] == rows).all()
        assert ((points["instance"] != 0) == (points["reason"] == 0)).all()
        assert points["instance"].max() > 0
        if "red" in points.dtype.names:
            colours = np.stack([points[name] for name in ("red", "green", "blue", "alpha")], 1)
        else:
            colours = points["colors"].astype(">u4").view(np.uint8).reshape(-1, 4)
        assert (colours[:, 3] == 255).all()
        yield np.stack([points[name] for name in ("instance", "component", "semantic", "reason")]), colours


@pytest.fixture(scope="module")
def annotated(tmp_path_factory):
    """A simulated drive in every encoding, annotated."""
    folder, outputs = tmp_path_factory.mktemp("encodings"), {}
    for encoding in ENCODINGS:
        source, output = folder / f"{encoding}.mcap", folder / f"{encoding}.out.mcap"
        run("simulate", "--encoding", encoding, "--sensor", "vlp-16", "--scene", "crowd", "--frames", 2, "-o", source)
        run("annotate", source, "-o", output)
        outputs[encoding] = output
    return outputs


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_our_recordings_decode_with_the_same_labels(annotated, encoding):
    messages = decoded(annotated[encoding])
    assert set(messages) >= {TOPIC, f"{TOPIC}/instances", "/tf"}
    found = list(check(messages[TOPIC], messages[f"{TOPIC}/instances"]))
    expected = decoded(annotated["ros2"])
    expected = list(check(expected[TOPIC], expected[f"{TOPIC}/instances"]))
    for ours, theirs in zip(found, expected, strict=True):
        assert (ours[0] == theirs[0]).all() and (ours[1] == theirs[1]).all()


SENSORS = [
    "vlp-16", "hdl-32e", "hdl-64e", "os1-128", "vlp-32c", "vls-128", "pandar-40p-dual", "helios", "os1-64-gradient",
    "os1-64-staggered", "m1", "hap", "mid-360",
]


@pytest.mark.parametrize("sensor", SENSORS)
def test_every_sensor_in_every_encoding(tmp_path, sensor):
    """The same labels whatever the messages are; organised clouds have rows in ROS alone."""
    found = {}
    for encoding in ENCODINGS:
        source, output = tmp_path / f"{encoding}.mcap", tmp_path / f"{encoding}.out.mcap"
        run("simulate", "--encoding", encoding, "--sensor", sensor, "--scene", "crowd", "--frames", 1, "-o", source)
        run("annotate", source, "-o", output, "--no-layout")
        messages = decoded(output)
        [(labels, _)] = check(messages[TOPIC], messages[f"{TOPIC}/instances"])
        found[encoding] = labels
    assert (found["ros2"] == found["ros1"]).all()
    foxglove = [found[encoding] for encoding in ENCODINGS[2:]]
    assert all((labels == foxglove[0]).all() for labels in foxglove)
    if not sensor.startswith("os1"):
        assert (found["ros2"] == foxglove[0]).all()


def test_poses_decode(annotated):
    ros1 = decoded(annotated["ros1"])["/tf"][1][1].transforms[0]
    protobuf = decoded(annotated["foxglove-protobuf"])["/tf"][1][1]
    plain = decoded(annotated["foxglove-json"])["/tf"][1][1]
    assert ros1.transform.translation.x == protobuf.translation.x == plain["translation"]["x"]
    assert ros1.transform.rotation.w == protobuf.rotation.w == plain["rotation"]["w"]
    assert ros1.child_frame_id == protobuf.child_frame_id == plain["child_frame_id"] == "lidar"


def test_rosbags_knows_our_ros1_definitions(annotated):
    """Sums as ROS 1 makes them, and the same bytes again."""
    store = get_typestore(Stores.ROS1_NOETIC)
    seen = 0
    with open(annotated["ros1"], "rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if schema.name != "sensor_msgs/PointCloud2":
                continue
            assert schema.encoding == "ros1msg" and channel.metadata["topic"] == channel.topic
            name = "sensor_msgs/msg/PointCloud2"
            assert channel.metadata["md5sum"] == store.generate_msgdef(name, ros_version=1)[1]
            again = store.serialize_ros1(store.deserialize_ros1(message.data, name), name)
            assert bytes(again) == bytes(message.data)
            seen += 1
    assert seen == 4


def test_rosbags_opens_annotated_recordings_of_ros2(annotated):
    """The whole file with the reader that fails on schemas it does not know. (It has no ROS 1 in MCAP.)"""
    with AnyReader([annotated["ros2"]], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        topics = {connection.topic for connection, *_ in reader.messages()}
    assert {TOPIC, f"{TOPIC}/instances", f"{TOPIC}/objects"} <= topics


def test_descriptors_are_those_of_foxglove(annotated):
    """The schema in the file has every field of PyPI's own, under the same number and type."""
    from foxglove_schemas_protobuf import PointCloud_pb2
    from google.protobuf.descriptor_pb2 import FileDescriptorSet

    theirs = {f.name: (f.number, f.type) for f in PointCloud_pb2.PointCloud.DESCRIPTOR.fields}
    with open(annotated["foxglove-protobuf"], "rb") as file:
        schemas = make_reader(file).get_summary().schemas.values()
    data = next(schema.data for schema in schemas if schema.name == "foxglove.PointCloud")
    files = FileDescriptorSet.FromString(data).file
    message = next(m for file in files for m in file.message_type if m.name == "PointCloud")
    assert {f.name: (f.number, f.type) for f in message.field} == theirs


@pytest.mark.parametrize("writer", recording_writers.WRITERS)
def test_recordings_of_other_writers_are_annotated(tmp_path, writer):
    source, output = tmp_path / "in.mcap", tmp_path / "out.mcap"
    recording_writers.WRITERS[writer](source)
    run("annotate", source, "-o", output, "--semantics", "all")
    messages = decoded(output)
    if writer == "foxglove-json of protobuf":
        # Its numbers are words and its names are others: only ours can be held against what went in.
        _, ours = messages["/points/instances"][0]
        assert stamp(ours) == recording_writers.STAMP and ours["frame_id"] == recording_writers.FRAME
        points, rows = table(ours)
        assert rows[:, :16].tobytes() == recording_writers.DATA
    else:
        list(check(messages["/points"], messages["/points/instances"]))
        points, rows = table(messages["/points/instances"][0][1])
    # Two walls are two instances.
    assert len(points) == len(recording_writers.POINTS)
    near = points["x"] < 10
    assert set(points["instance"][near]) != set(points["instance"][~near])
    assert len(set(points["instance"][near])) == len(set(points["instance"][~near])) == 1


def test_the_flavor_foxglove(tmp_path):
    """ROS 2 clouds in a recording that is not of ROS: protobuf beside them, decoded by its own reader."""
    source, output = tmp_path / "in.mcap", tmp_path / "out.mcap"
    recording_writers.foxglove_ros2(source)
    done = subprocess.run([BINARY, "annotate", source, "-o", output, "--flavor", "foxglove"], capture_output=True, text=True)
    # The writer says profile ros2, where this is refused.
    assert done.returncode == 1 and "ros2" in done.stderr and not output.exists()
    recording_writers.json_by_schema(source)
    run("annotate", source, "-o", output, "--flavor", "foxglove", "--semantics", "all")
    messages = decoded(output)
    list(check(messages["/points"], messages["/points/instances"]))
    assert hasattr(messages["/points/instances"][0][1], "DESCRIPTOR")
