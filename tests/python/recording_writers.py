"""Recordings made by writers that are not ours, a format each. No file but this knows those writers."""

import base64
import json
import struct

import numpy as np
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from google.protobuf.json_format import MessageToJson
from mcap.writer import Writer
from mcap_protobuf.writer import Writer as ProtobufWriter
from mcap_ros2.writer import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

STAMP = (1_700_000_000, 25)
FRAME = "lidar_top"


def points():
    """Two walls of points, 16 rows high: x, y, z, intensity."""
    for distance in (8.0, 14.0):
        for row in range(16):
            for column in range(60):
                y = (column - 30) * 0.05 + (distance - 8.0)
                yield distance, y, row * 0.1 - 0.7, float(column)


POINTS = list(points())
DATA = b"".join(struct.pack("<4f", *point) for point in POINTS)
NAMES = ["x", "y", "z", "intensity"]


def foxglove_cloud():
    cloud = PointCloud(frame_id=FRAME, point_stride=16, data=DATA)
    cloud.timestamp.seconds, cloud.timestamp.nanos = STAMP
    cloud.pose.orientation.w = 1.0
    for number, name in enumerate(NAMES):
        cloud.fields.add(name=name, offset=4 * number, type=PackedElementField.FLOAT32)
    return cloud


def protobuf(path):
    with open(path, "wb") as file, ProtobufWriter(file) as writer:
        writer.write_message("/points", foxglove_cloud(), log_time=5, publish_time=5)


def json_recording(path, message):
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("foxglove.PointCloud", "jsonschema", b'{"type": "object"}')
        channel = writer.register_channel("/points", "json", schema)
        writer.add_message(channel, 5, message.encode(), 5)
        writer.finish()


def json_by_schema(path):
    fields = [{"name": name, "offset": 4 * i, "type": 7} for i, name in enumerate(NAMES)]
    message = {
        "timestamp": {"sec": STAMP[0], "nsec": STAMP[1]},
        "frame_id": FRAME,
        "pose": {"position": {"x": 0, "y": 0, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}},
        "point_stride": 16,
        "fields": fields,
        "data": base64.b64encode(DATA).decode(),
    }
    json_recording(path, json.dumps(message))


def json_by_protobuf(path):
    json_recording(path, MessageToJson(foxglove_cloud()))


def ros1(path):
    store = get_typestore(Stores.ROS1_NOETIC)
    name = "sensor_msgs/msg/PointCloud2"
    field = store.types["sensor_msgs/msg/PointField"]
    header = store.types["std_msgs/msg/Header"](
        seq=9, stamp=store.types["builtin_interfaces/msg/Time"](*STAMP), frame_id=FRAME
    )
    cloud = store.types[name](
        header=header,
        height=1,
        width=len(POINTS),
        fields=[field(name=n, offset=4 * i, datatype=7, count=1) for i, n in enumerate(NAMES)],
        is_bigendian=False,
        point_step=16,
        row_step=len(DATA),
        data=np.frombuffer(DATA, np.uint8),
        is_dense=True,
    )
    definition, md5 = store.generate_msgdef(name, ros_version=1)
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start(profile="ros1")
        schema = writer.register_schema("sensor_msgs/PointCloud2", "ros1msg", definition.encode())
        metadata = {"callerid": "/driver", "latching": "0", "md5sum": md5, "topic": "/points"}
        channel = writer.register_channel("/points", "ros1", schema, metadata)
        writer.add_message(channel, 5, bytes(store.serialize_ros1(cloud, name)), 5)
        writer.finish()


FOXGLOVE_MSGS = """\
builtin_interfaces/Time timestamp
string frame_id
geometry_msgs/Pose pose
uint32 point_stride
foxglove_msgs/PackedElementField[] fields
uint8[] data
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================================================================================
MSG: foxglove_msgs/PackedElementField
string name
uint32 offset
uint8 type
"""


def foxglove_ros2(path):
    message = {
        "timestamp": {"sec": STAMP[0], "nanosec": STAMP[1]},
        "frame_id": FRAME,
        "pose": {"orientation": {"w": 1.0}},
        "point_stride": 16,
        "fields": [{"name": n, "offset": 4 * i, "type": 7} for i, n in enumerate(NAMES)],
        "data": DATA,
    }
    with open(path, "wb") as file:
        writer = Ros2Writer(file)
        schema = writer.register_msgdef("foxglove_msgs/msg/PointCloud", FOXGLOVE_MSGS)
        writer.write_message("/points", schema, message, log_time=5, publish_time=5)
        writer.finish()


WRITERS = {
    "foxglove-protobuf": protobuf,
    "foxglove-json": json_by_schema,
    "foxglove-json of protobuf": json_by_protobuf,
    "ros1": ros1,
    "foxglove-ros2": foxglove_ros2,
}
