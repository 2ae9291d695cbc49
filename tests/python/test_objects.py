"""Boxes in each of their types, opened by readers that are not ours: the same boxes in all of them.

Needs the release binary (`cargo build --release`) and `pip install -r tests/python/requirements.txt`.
"""

import json
import subprocess
from types import SimpleNamespace

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from test_encodings import decoded
from test_independent_readers import BINARY, run

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


@pytest.mark.parametrize("encoding", ["ros1", "foxglove-ros2", "foxglove-protobuf", "foxglove-json"])
def test_the_same_boxes_in_every_encoding(tmp_path, encoding):
    found = {}
    for name in ("ros2", encoding):
        source, output = tmp_path / f"{name}.mcap", tmp_path / f"{name}.out.mcap"
        run("simulate", "--encoding", name, "--sensor", "vlp-16", "--scene", "crowd", "--frames", 2, "-o", source)
        run("annotate", source, "-o", output)
        found[name] = [boxes(message) for _, message in decoded(output)[TOPIC]]
    assert found["ros2"] == found[encoding] and len(found["ros2"]) == 2
    assert all(len(frame) > 3 for frame in found["ros2"])


def boxes(message):
    """Number, place, sides and text of each box of a MarkerArray or a SceneUpdate, however it was decoded."""
    if isinstance(message, dict):
        message = json.loads(json.dumps(message), object_hook=lambda fields: SimpleNamespace(**fields))
    if hasattr(message, "markers"):
        texts = {marker.id: marker.text for marker in message.markers if marker.ns == "ids"}
        cubes = [marker for marker in message.markers if marker.ns == "boxes"]
        return [(m.id, flat(m.pose.position, m.scale), texts[m.id]) for m in cubes]
    return [
        (int(e.id), flat(e.cubes[0].pose.position, e.cubes[0].size), e.texts[0].text) for e in message.entities
    ]


@pytest.mark.parametrize("kind", ["markers", "detection3d"])
def test_ros1_knows_our_definitions(tmp_path, kind):
    """Sums as ROS 1 makes them of the definitions in the file, and the same bytes again."""
    source, output = tmp_path / "in.mcap", tmp_path / "out.mcap"
    run("simulate", "--encoding", "ros1", "--sensor", "vlp-16", "--scene", "crowd", "--frames", 1, "-o", source)
    run("annotate", source, "-o", output, "--objects", kind)
    store = get_typestore(Stores.ROS1_NOETIC)
    with open(output, "rb") as file:
        [(schema, channel, message)] = make_reader(file).iter_messages(topics=[TOPIC])
    name = schema.name.replace("/", "/msg/")
    if kind == "detection3d":
        defined = get_types_from_msg(schema.data.decode(), name)
        store.register({key: value for key, value in defined.items() if key not in store.types})
    assert channel.metadata["md5sum"] == store.generate_msgdef(name, ros_version=1)[1]
    again = store.serialize_ros1(store.deserialize_ros1(message.data, name), name)
    assert bytes(again) == bytes(message.data)


def test_autoware_has_no_messages_in_ros_1(tmp_path):
    source, output = tmp_path / "in.mcap", tmp_path / "out.mcap"
    run("simulate", "--encoding", "ros1", "--sensor", "vlp-16", "--scene", "crowd", "--frames", 1, "-o", source)
    arguments = [BINARY, "annotate", source, "-o", output, "--objects", "autoware"]
    done = subprocess.run(arguments, capture_output=True, text=True)
    assert done.returncode == 1 and "ROS 1" in done.stderr and not output.exists()
