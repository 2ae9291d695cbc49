"""Bags, streams and other forms of the output, opened by readers that are not ours.

Needs the release binary (`cargo build --release`) and `pip install -r tests/python/requirements.txt`.
"""

import subprocess
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from test_independent_readers import BINARY, run

TYPES = get_typestore(Stores.ROS2_HUMBLE)
POINTS = "/lidar/points"


@pytest.fixture
def drive(tmp_path):
    path = tmp_path / "drive.mcap"
    run("simulate", "--sensor", "vlp-16", "--frames", 3, "-o", path)
    return path


def messages(path):
    """Topic, log time and bytes of each message, every checksum checked."""
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        return [(c.topic, m.log_time, m.data) for _, c, m in reader.iter_messages(log_time_order=False)]


def of(found, topic):
    return [message for message in found if message[0] == topic]


def make_bag(folder, drive, version):
    """A bag of the drive's clouds, as rosbags writes one."""
    with Writer(folder, version=version, storage_plugin=StoragePlugin.MCAP) as writer:
        cloud = writer.add_connection(POINTS, "sensor_msgs/msg/PointCloud2", typestore=TYPES)
        for _, time, data in of(messages(drive), POINTS):
            writer.write(cloud, time, data)


@pytest.mark.parametrize("version", [8, 9])
def test_a_bag_comes_out_as_a_bag(drive, tmp_path, version):
    bag, out = tmp_path / "bag", tmp_path / "out"
    make_bag(bag, drive, version)
    run("annotate", bag, "-o", out)
    with Reader(bag) as before, Reader(out) as after:
        counts = {c.topic: c.msgcount for c in after.connections}
        assert counts == {POINTS: 3, POINTS + "/instances": 3, POINTS + "/objects": 3}
        assert after.message_count == 9
        assert (after.start_time, after.end_time) == (before.start_time, before.end_time)
        original = [bytes(data) for _, _, data in before.messages()]
        kept = [bytes(data) for c, _, data in after.messages() if c.topic == POINTS]
        assert kept == original
        for connection, _, data in after.messages():
            TYPES.deserialize_cdr(data, connection.msgtype)


def test_only_and_in_place(drive, tmp_path):
    beside, only, in_place = (tmp_path / name for name in ["b.mcap", "o.mcap", "i.mcap"])
    run("annotate", drive, "-o", beside)
    run("annotate", drive, "-o", only, "--only")
    run("annotate", drive, "-o", in_place, "--in-place-fields")
    found = messages(beside)
    instances = of(found, POINTS + "/instances")
    objects = of(found, POINTS + "/objects")
    assert sorted(messages(only)) == sorted(instances + objects)
    placed = [(POINTS + "/instances", time, data) for _, time, data in of(messages(in_place), POINTS)]
    assert placed == instances
    assert len(messages(in_place)) == len(messages(drive)) + 3


def test_standard_input_and_output(drive, tmp_path):
    with open(drive, "rb") as source:
        done = subprocess.run([BINARY, "annotate", "-", "-o", "-"], stdin=source, capture_output=True)
    assert done.returncode == 0, done.stderr
    output = tmp_path / "out.mcap"
    output.write_bytes(done.stdout)
    with open(output, "rb") as file:
        assert len(list(StreamReader(file, validate_crcs=True).records)) > 0
    assert of(messages(output), POINTS) == of(messages(drive), POINTS)
    assert len(of(messages(output), POINTS + "/objects")) == 3
