"""What divmerge writes, opened by readers that are not ours.

Needs the release binary (`cargo build --release`) and `pip install -r tests/python/requirements.txt`.
"""

import csv
import subprocess
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_typestore

ROOT = Path(__file__).resolve().parents[2]
BINARY = ROOT / "target" / "release" / "divmerge"
RECORDINGS = ROOT / ".." / "shared" / "data" / "recordings"
CLOUD_TYPES = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8",
}


def run(*arguments):
    done = subprocess.run([BINARY, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def inputs():
    names = ["semantickitti_04_ros2", "sensors_ros2", "pointcloud2_32ring_unaligned", "xyz_ros2"]
    return ["simulated", *names]


@pytest.fixture(params=inputs())
def pair(request, tmp_path):
    """An input and what annotate makes of it."""
    source = RECORDINGS / f"{request.param}.mcap"
    if request.param == "simulated":
        source = tmp_path / "simulated.mcap"
        run("simulate", "--sensor", "os1-128", "--scene", "crowd", "--frames", 2, "-o", source)
    elif not source.exists():
        pytest.skip(f"no {source}")
    output = tmp_path / "out.mcap"
    run("annotate", source, "-o", output, "--objects", "all")
    return source, output


def records(path):
    """Everything a recording holds, by kind."""
    found = {"schemas": {}, "channels": {}, "messages": [], "attachments": [], "metadata": []}
    with open(path, "rb") as file:
        for record in StreamReader(file, validate_crcs=True).records:
            kind = type(record).__name__
            if kind == "Header":
                found["profile"] = record.profile
            elif kind == "Schema":
                found["schemas"][record.id] = (record.name, record.encoding, record.data)
            elif kind == "Channel":
                content = (record.topic, record.schema_id, record.message_encoding)
                found["channels"][record.id] = (*content, record.metadata)
            elif kind == "Message":
                times = (record.log_time, record.publish_time)
                found["messages"].append((record.channel_id, record.sequence, *times, record.data))
            elif kind == "Attachment":
                times = (record.log_time, record.create_time)
                found["attachments"].append((record.name, record.media_type, *times, record.data))
            elif kind == "Metadata":
                found["metadata"].append((record.name, record.metadata))
    return found


def test_everything_of_the_input_is_there(pair):
    before, after = map(records, pair)
    assert before["profile"] == after["profile"]
    for kind in ("schemas", "channels"):
        for number, content in before[kind].items():
            assert after[kind][number] == content
    rest = iter(after["messages"])
    assert all(message in rest for message in before["messages"]), "missing or out of order"
    for kind in ("attachments", "metadata"):
        assert all(content in after[kind] for content in before[kind])
    assert "divmerge" in [name for name, _ in after["metadata"]]


def points(message):
    """The points of a PointCloud2 as a structured array."""
    layout = np.dtype(
        {
            "names": [field.name for field in message.fields],
            "formats": [CLOUD_TYPES[field.datatype] for field in message.fields],
            "offsets": [field.offset for field in message.fields],
            "itemsize": message.point_step,
        }
    )
    return np.frombuffer(bytes(message.data), layout)


def test_both_topics_decode(pair):
    _, output = pair
    clouds, annotated, objects = {}, {}, {}
    with open(output, "rb") as file:
        reader = make_reader(file)
        decoder = DecoderFactory()
        for schema, channel, message in reader.iter_messages():
            if schema is None or channel.message_encoding != "cdr":
                continue
            if not schema.name.endswith(("PointCloud2", "MarkerArray")):
                continue
            decoded = decoder.decoder_for("cdr", schema)(message.data)
            key = (message.log_time, message.sequence)
            if channel.topic.endswith("/objects"):
                objects[channel.topic.removesuffix("/objects"), key] = decoded
            elif channel.topic.endswith("/instances"):
                annotated[channel.topic.removesuffix("/instances"), key] = decoded
            else:
                clouds[channel.topic, key] = decoded
    assert clouds and clouds.keys() == annotated.keys() == objects.keys()
    for key, cloud in clouds.items():
        check_cloud(cloud, annotated[key])
        check_objects(annotated[key], objects[key])


def check_cloud(cloud, annotated):
    assert (cloud.height, cloud.width) == (annotated.height, annotated.width)
    assert cloud.header == annotated.header
    names = [field.name for field in annotated.fields]
    assert names[: len(cloud.fields)] == [field.name for field in cloud.fields]
    ours = names[len(cloud.fields) :]
    # How likely a point is ground is said where objects come from ground removal, which is where there are no classes.
    has_ground = "ground" in ours
    assert has_ground != ("label" in names)
    # Objects are followed where a topic has several clouds.
    has_tracks = "track" in ours
    assert ours == [
        "instance", "component", "semantic", "reason", *["ground"] * has_ground, "rgb", "colors",
        *["track"] * has_tracks,
    ]
    assert all(field.count == 1 for field in annotated.fields[len(cloud.fields) :])
    rows = np.frombuffer(bytes(cloud.data), np.uint8).reshape(-1, cloud.point_step)
    after = np.frombuffer(bytes(annotated.data), np.uint8).reshape(-1, annotated.point_step)
    assert (after[:, : cloud.point_step] == rows).all()
    table = points(annotated)
    assert ((table["instance"] != 0) == (table["reason"] == 0)).all()
    assert ((table["instance"] != 0) == (table["component"] != 0)).all()
    if has_ground:
        is_ground = table["reason"] == 3
        assert (table["ground"][is_ground] >= 128).all()
        assert (table["ground"][table["instance"] != 0] < 128).all()
    packed = table["rgb"].copy().view(np.uint32)
    assert ((packed & 0xFFFFFF) == (table["colors"] >> 8)).all()
    assert ((packed >> 24) == 255).all() and ((table["colors"] & 255) == 255).all()


def check_objects(annotated, array):
    delete_all, cube, text = 3, 1, 9
    assert array.markers[0].action == delete_all
    table = points(annotated)
    column = "track" if "track" in table.dtype.names else "instance"
    ids = {int(number) for number in np.unique(table[column])} - {0}
    assert {marker.id for marker in array.markers if marker.type == cube} == ids
    assert {marker.id for marker in array.markers if marker.type == text} == ids
    for marker in array.markers:
        if marker.action == delete_all:
            continue
        assert marker.header.frame_id == annotated.header.frame_id
        if marker.type == cube:
            check_box(marker, table[table[column] == marker.id])


def check_box(marker, members):
    """Every point of the instance lies in its box."""
    yaw = 2 * np.arctan2(marker.pose.orientation.z, marker.pose.orientation.w)
    centre = marker.pose.position
    x, y = members["x"] - centre.x, members["y"] - centre.y
    along, across = x * np.cos(yaw) + y * np.sin(yaw), y * np.cos(yaw) - x * np.sin(yaw)
    slack = 2e-3
    assert (np.abs(along) <= marker.scale.x / 2 + slack).all()
    assert (np.abs(across) <= marker.scale.y / 2 + slack).all()
    assert (np.abs(members["z"] - centre.z) <= marker.scale.z / 2 + slack).all()


def test_rosbags_reads_our_messages(pair):
    """Decoding and encoding again with a third reader gives our bytes back."""
    _, output = pair
    store = get_typestore(Stores.ROS2_HUMBLE)
    seen = 0
    with open(output, "rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.topic.endswith(("/instances", "/objects")):
                decoded = store.deserialize_cdr(message.data, schema.name)
                again = store.serialize_cdr(decoded, schema.name)
                assert bytes(again) == bytes(message.data)
                seen += 1
    assert seen


def test_suspicion_decodes(tmp_path):
    source, output, table = tmp_path / "in.mcap", tmp_path / "out.mcap", tmp_path / "out.csv"
    run("simulate", "--sensor", "vlp-16", "--scene", "parking", "--frames", 2, "-o", source)
    run("triage", source, "-o", output, "--csv", table)
    seen = []
    with open(output, "rb") as file:
        decoder = DecoderFactory()
        store = get_typestore(Stores.ROS2_HUMBLE)
        for schema, channel, message in make_reader(file).iter_messages():
            if not channel.topic.endswith("/suspicion"):
                continue
            assert schema.name == "diagnostic_msgs/msg/DiagnosticArray"
            seen.append((message.log_time, decoder.decoder_for("cdr", schema)(message.data)))
            again = store.serialize_cdr(store.deserialize_cdr(message.data, schema.name), schema.name)
            assert bytes(again) == bytes(message.data)
    assert len(seen) == 2
    with open(table, newline="") as file:
        rows = list(csv.DictReader(file))
    for log_time, array in seen:
        frame, *suspects = array.status
        of_frame = {pair.key: float(pair.value) for pair in frame.values}
        assert frame.name == "frame" and 0 < of_frame["score"] <= 1
        own = [row for row in rows if int(row["log_time_ns"]) == log_time]
        told = [row for row in own if float(row["score"]) >= 0.01]
        assert suspects and abs(len(suspects) - len(told)) <= 2  # four digits at the threshold
        for status, row in zip(suspects, told):
            level = status.level[0] if isinstance(status.level, bytes) else status.level
            assert level in (1, 2)
            values = {pair.key: pair.value for pair in status.values}
            assert (status.name, status.message) == (row["kind"], row["sentence"])
            assert values["score"] == row["score"] and float(values["x"]) == pytest.approx(float(row["x"]), abs=1e-3)
            assert of_frame["score"] == pytest.approx(float(row["frame_score"]))
