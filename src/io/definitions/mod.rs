//! Definitions (`ros2msg`) of the ROS 2 messages that are read or written, put together from parts
//! that several share. Those of ROS 1 are in [`ros1`].

use std::borrow::Cow;

use foxglove::Encode;
use serde_json::Value;

use crate::error::Result;
use crate::io::recording::RecordingWriter;

/// What a recording has to say of a type of messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MessageSchema {
    /// Name of the type.
    pub name: &'static str,
    /// Encoding of the schema.
    pub encoding: &'static str,
    /// The schema.
    pub data: Cow<'static, [u8]>,
    /// Encoding of the messages.
    pub message_encoding: &'static str,
    /// ROS 1's fingerprint of the type.
    pub md5: Option<&'static str>,
}

impl MessageSchema {
    /// One of Foxglove's types in protocol buffers, with the set of file descriptors that its crate has.
    pub(super) fn protobuf<M: Encode>(name: &'static str) -> Self {
        let data = M::get_schema().map(|schema| schema.data).unwrap_or_default();
        MessageSchema { name, encoding: "protobuf", data, message_encoding: "protobuf", md5: None }
    }

    /// Adds the type to a recording as a schema, and returns its id there.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::add_schema`].
    pub fn add_to(&self, writer: &mut RecordingWriter) -> Result<u16> {
        Ok(writer.add_schema(self.name, self.encoding, &self.data)?)
    }

    /// A type in JSON.
    pub(super) fn json(name: &'static str, schema: &Value) -> Self {
        let data = schema.to_string().into_bytes().into();
        MessageSchema { name, encoding: "jsonschema", data, message_encoding: "json", md5: None }
    }
}

/// A type of ROS 2.
const fn ros2(name: &'static str, definition: &'static str) -> MessageSchema {
    MessageSchema {
        name,
        encoding: "ros2msg",
        data: Cow::Borrowed(definition.as_bytes()),
        message_encoding: "cdr",
        md5: None,
    }
}

/// A message's own fields, then the line and the definition of each type in it.
macro_rules! definition {
    ($own:expr, $($part:tt)*) => { concat!($own, $(separator!(), part!($part)),*) };
}

macro_rules! separator {
    () => {
        "================================================================================\n"
    };
}

/// Definitions that ROS 1 and 2 have in common, and those that only one message has.
macro_rules! shared {
    (vector) => {
        "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
    };
    (point) => {
        "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n"
    };
    (pose) => {
        "MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n"
    };
    (pose_with_covariance) => {
        "MSG: geometry_msgs/PoseWithCovariance\nPose pose\nfloat64[36] covariance\n"
    };
    (point_field) => {
        "\
MSG: sensor_msgs/PointField
uint8 INT8=1
uint8 UINT8=2
uint8 INT16=3
uint8 UINT16=4
uint8 INT32=5
uint8 UINT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
string name
uint32 offset
uint8 datatype
uint32 count
"
    };
    ($other:literal) => {
        $other
    };
}

pub mod ros1;

macro_rules! part {
    (header) => {
        "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    };
    (time) => {
        "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    };
    (quaternion) => {
        "MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"
    };
    ($other:tt) => {
        shared!($other)
    };
}

/// `sensor_msgs/msg/PointCloud2`: a cloud.
pub const POINT_CLOUD2: MessageSchema = ros2("sensor_msgs/msg/PointCloud2", POINT_CLOUD2_TEXT);

const POINT_CLOUD2_TEXT: &str = definition!(
    "\
std_msgs/Header header
uint32 height
uint32 width
PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
",
    header
    time
    point_field
);

/// `foxglove_msgs/msg/PointCloud`: a cloud as Foxglove has it.
pub const FOXGLOVE_POINT_CLOUD: MessageSchema =
    ros2("foxglove_msgs/msg/PointCloud", FOXGLOVE_POINT_CLOUD_TEXT);

const FOXGLOVE_POINT_CLOUD_TEXT: &str = definition!(
    "\
builtin_interfaces/Time timestamp
string frame_id
geometry_msgs/Pose pose
uint32 point_stride
foxglove_msgs/PackedElementField[] fields
uint8[] data
",
    time
    pose
    point
    quaternion
    "\
MSG: foxglove_msgs/PackedElementField
uint8 UNKNOWN=0
uint8 UINT8=1
uint8 INT8=2
uint8 UINT16=3
uint8 INT16=4
uint8 UINT32=5
uint8 INT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
string name
uint32 offset
uint8 type
"
);

/// `visualization_msgs/msg/MarkerArray`: boxes and texts to draw.
pub const MARKER_ARRAY: MessageSchema =
    ros2("visualization_msgs/msg/MarkerArray", MARKER_ARRAY_TEXT);

const MARKER_ARRAY_TEXT: &str = definition!(
    "\
Marker[] markers
",
    "\
MSG: visualization_msgs/Marker
int32 ARROW=0
int32 CUBE=1
int32 SPHERE=2
int32 CYLINDER=3
int32 LINE_STRIP=4
int32 LINE_LIST=5
int32 CUBE_LIST=6
int32 SPHERE_LIST=7
int32 POINTS=8
int32 TEXT_VIEW_FACING=9
int32 MESH_RESOURCE=10
int32 TRIANGLE_LIST=11
int32 ADD=0
int32 MODIFY=0
int32 DELETE=2
int32 DELETEALL=3
std_msgs/Header header
string ns
int32 id
int32 type
int32 action
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
std_msgs/ColorRGBA color
builtin_interfaces/Duration lifetime
bool frame_locked
geometry_msgs/Point[] points
std_msgs/ColorRGBA[] colors
string texture_resource
sensor_msgs/CompressedImage texture
UVCoordinate[] uv_coordinates
string text
string mesh_resource
MeshFile mesh_file
bool mesh_use_embedded_materials
"
    header
    time
    "\
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
"
    pose
    point
    quaternion
    vector
    "\
MSG: std_msgs/ColorRGBA
float32 r
float32 g
float32 b
float32 a
"
    "\
MSG: sensor_msgs/CompressedImage
std_msgs/Header header
string format
uint8[] data
"
    "\
MSG: visualization_msgs/UVCoordinate
float32 u
float32 v
"
    "\
MSG: visualization_msgs/MeshFile
string filename
uint8[] data
"
);

/// `vision_msgs/msg/Detection3DArray` since version 4 (Humble): boxes with classes.
pub const DETECTION_ARRAY: MessageSchema =
    ros2("vision_msgs/msg/Detection3DArray", DETECTION_ARRAY_TEXT);

const DETECTION_ARRAY_TEXT: &str = definition!(
    "\
std_msgs/Header header
Detection3D[] detections
",
    header
    time
    "\
MSG: vision_msgs/Detection3D
std_msgs/Header header
ObjectHypothesisWithPose[] results
BoundingBox3D bbox
string id
"
    "\
MSG: vision_msgs/ObjectHypothesisWithPose
ObjectHypothesis hypothesis
geometry_msgs/PoseWithCovariance pose
"
    "\
MSG: vision_msgs/ObjectHypothesis
string class_id
float64 score
"
    pose_with_covariance
    pose
    point
    quaternion
    "\
MSG: vision_msgs/BoundingBox3D
geometry_msgs/Pose center
geometry_msgs/Vector3 size
"
    vector
);

/// `autoware_perception_msgs/msg/DetectedObjects`: boxes with Autoware's classes.
pub const DETECTED_OBJECTS: MessageSchema =
    ros2("autoware_perception_msgs/msg/DetectedObjects", DETECTED_OBJECTS_TEXT);

const DETECTED_OBJECTS_TEXT: &str = definition!(
    "\
std_msgs/Header header
DetectedObject[] objects
",
    header
    time
    "\
MSG: autoware_perception_msgs/DetectedObject
float32 existence_probability
ObjectClassification[] classification
DetectedObjectKinematics kinematics
Shape shape
"
    "\
MSG: autoware_perception_msgs/ObjectClassification
uint8 UNKNOWN=0
uint8 CAR=1
uint8 TRUCK=2
uint8 BUS=3
uint8 TRAILER=4
uint8 MOTORCYCLE=5
uint8 BICYCLE=6
uint8 PEDESTRIAN=7
uint8 ANIMAL=8
uint8 HAZARD=9
uint8 OVER_DRIVABLE=10
uint8 UNDER_DRIVABLE=11
uint8 label
float32 probability
"
    "\
MSG: autoware_perception_msgs/DetectedObjectKinematics
uint8 UNAVAILABLE=0
uint8 SIGN_UNKNOWN=1
uint8 AVAILABLE=2
geometry_msgs/PoseWithCovariance pose_with_covariance
bool has_position_covariance
uint8 orientation_availability
geometry_msgs/TwistWithCovariance twist_with_covariance
bool has_twist
bool has_twist_covariance
"
    "\
MSG: autoware_perception_msgs/Shape
uint8 BOUNDING_BOX=0
uint8 CYLINDER=1
uint8 POLYGON=2
uint8 type
geometry_msgs/Polygon footprint
geometry_msgs/Vector3 dimensions
"
    pose_with_covariance
    pose
    point
    quaternion
    vector
    "\
MSG: geometry_msgs/TwistWithCovariance
Twist twist
float64[36] covariance
"
    "\
MSG: geometry_msgs/Twist
Vector3 linear
Vector3 angular
"
    "\
MSG: geometry_msgs/Polygon
Point32[] points
"
    "\
MSG: geometry_msgs/Point32
float32 x
float32 y
float32 z
"
);

/// `tf2_msgs/msg/TFMessage`: poses.
pub const TF_MESSAGE: MessageSchema = ros2("tf2_msgs/msg/TFMessage", TF_MESSAGE_TEXT);

const TF_MESSAGE_TEXT: &str = definition!(
    "\
geometry_msgs/TransformStamped[] transforms
",
    "\
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
"
    header
    time
    "\
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
"
    vector
    quaternion
);

/// `diagnostic_msgs/msg/DiagnosticArray`: words and numbers beside a cloud.
pub const DIAGNOSTIC_ARRAY: MessageSchema =
    ros2("diagnostic_msgs/msg/DiagnosticArray", DIAGNOSTIC_ARRAY_TEXT);

const DIAGNOSTIC_ARRAY_TEXT: &str = definition!(
    "\
std_msgs/Header header
DiagnosticStatus[] status
",
    header
    time
    "\
MSG: diagnostic_msgs/DiagnosticStatus
byte OK=0
byte WARN=1
byte ERROR=2
byte STALE=3
byte level
string name
string message
string hardware_id
KeyValue[] values
"
    "\
MSG: diagnostic_msgs/KeyValue
string key
string value
"
);

/// `sensor_msgs/msg/CameraInfo`: a camera's calibration.
pub const CAMERA_INFO: MessageSchema = ros2("sensor_msgs/msg/CameraInfo", CAMERA_INFO_TEXT);

const CAMERA_INFO_TEXT: &str = definition!(
    "\
std_msgs/Header header
uint32 height
uint32 width
string distortion_model
float64[] d
float64[9] k
float64[9] r
float64[12] p
uint32 binning_x
uint32 binning_y
RegionOfInterest roi
",
    header
    time
    "\
MSG: sensor_msgs/RegionOfInterest
uint32 x_offset
uint32 y_offset
uint32 height
uint32 width
bool do_rectify
"
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_of_a_definition_is_defined_in_it() {
        let separator = "=".repeat(80);
        for (definition, types) in [
            (POINT_CLOUD2_TEXT, 3),
            (MARKER_ARRAY_TEXT, 12),
            (DETECTION_ARRAY_TEXT, 11),
            (DETECTED_OBJECTS_TEXT, 15),
            (FOXGLOVE_POINT_CLOUD_TEXT, 5),
            (TF_MESSAGE_TEXT, 6),
            (CAMERA_INFO_TEXT, 3),
            (DIAGNOSTIC_ARRAY_TEXT, 4),
        ] {
            assert_eq!(definition.lines().filter(|line| *line == separator).count(), types);
            let uses =
                definition.lines().filter(|line| line.contains('/') && !line.starts_with("MSG"));
            for line in uses {
                let name = line.split([' ', '[']).next().unwrap();
                assert!(definition.contains(&format!("MSG: {name}\n")), "{name}");
            }
        }
    }
}
