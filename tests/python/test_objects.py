"""Boxes in each of their types, opened by readers that are not ours: the same boxes in all of them.

Needs the release binary (`cargo build --release`) and `pip install -r tests/python/requirements.txt`.
"""

import json

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from test_independent_readers import run

TOPIC = "/lidar/points/objects"


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    path = tmp_path_factory.mktemp("objects") / "drive.mcap"
    run("simulate", "--sensor", "hdl-32e", "--scene", "parking", "--frames", 2, "-o", path)
    return path


def objects(drive, tmp_path, kind):
    """Schema and decoded messages of the boxes; each is read by two readers, which must agree with our bytes."""
    output = tmp_path / f"{kind}.mcap"
    run("annotate", drive, "-o", output, "--objects", kind)
    store = get_typestore(Stores.EMPTY)
    seen = []
    with open(output, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, _, message, decoded in reader.iter_decoded_messages(topics=[TOPIC]):
            if not seen:
                store.register(get_types_from_msg(schema.data.decode(), schema.name))
            again = store.serialize_cdr(store.deserialize_cdr(message.data, schema.name), schema.name)
            assert bytes(again) == bytes(message.data)
            seen.append(decoded)
    assert len(seen) == 2
    return seen


def flat(position, size):
    return [round(value, 9) for value in (position.x, position.y, position.z, size.x, size.y, size.z)]


def test_the_same_boxes_in_every_type(drive, tmp_path):
    markers = objects(drive, tmp_path, "markers")
    detections = objects(drive, tmp_path, "detection3d")
    autoware = objects(drive, tmp_path, "autoware")
    for drawn, detected, perceived in zip(markers, detections, autoware):
        cubes = [marker for marker in drawn.markers if marker.ns == "boxes"]
        expected = [flat(cube.pose.position, cube.scale) for cube in cubes]
        assert len(expected) > 3
        boxes = [detection.bbox for detection in detected.detections]
        # What is drawn is at least 5 cm thick.
        for box, cube in zip(boxes, expected, strict=True):
            found = flat(box.center.position, box.size)
            assert found[:3] == cube[:3]
            assert [max(side, 0.05) for side in found[3:]] == cube[3:]
        poses = [item.kinematics.pose_with_covariance.pose.position for item in perceived.objects]
        shapes = [item.shape.dimensions for item in perceived.objects]
        assert [flat(*pair) for pair in zip(poses, shapes)] == [
            flat(box.center.position, box.size) for box in boxes
        ]
        assert [int(item.id) for item in detected.detections] == [cube.id for cube in cubes]
        headers = [detected.header, cubes[0].header, perceived.header]
        assert len({repr(header) for header in headers}) == 1


def test_classes_are_named_and_are_autoware_s(drive, tmp_path):
    car = 1
    for detected, perceived in zip(
        objects(drive, tmp_path, "detection3d"), objects(drive, tmp_path, "autoware")
    ):
        names = [item.results[0].hypothesis.class_id for item in detected.detections]
        labels = [item.classification[0].label for item in perceived.objects]
        assert "car" in names
        assert [name == "car" for name in names] == [label == car for label in labels]


def test_a_layout_shows_what_is_there(drive, tmp_path):
    output = tmp_path / "out.mcap"
    run("annotate", drive, "-o", output)
    layout = json.loads((tmp_path / "out.layout.json").read_text())
    scene = layout["configById"][layout["layout"]["first"]]
    with open(output, "rb") as file:
        topics = {channel.topic for channel in make_reader(file).get_summary().channels.values()}
    assert set(scene["topics"]) <= topics
    visible = {topic for topic, shown in scene["topics"].items() if shown["visible"]}
    assert visible == {"/lidar/points/instances", TOPIC}
