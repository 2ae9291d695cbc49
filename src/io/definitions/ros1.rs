//! Definitions (`ros1msg`) and fingerprints of the ROS 1 messages that are written.

use std::borrow::Cow;

use super::MessageSchema;

/// A type of ROS 1 and its fingerprint.
const fn ros1(name: &'static str, definition: &'static str, md5: &'static str) -> MessageSchema {
    MessageSchema {
        name,
        encoding: "ros1msg",
        data: Cow::Borrowed(definition.as_bytes()),
        message_encoding: "ros1",
        md5: Some(md5),
    }
}

/// The fields of `sensor_msgs/PointCloud2`.
macro_rules! cloud {
    () => {
        "\
Header header
uint32 height
uint32 width
PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
"
    };
}

macro_rules! part {
    (header) => {
        "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
    };
    (quaternion) => {
        "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
    };
    (cloud) => {
        concat!("MSG: sensor_msgs/PointCloud2\n", cloud!())
    };
    ($other:tt) => {
        shared!($other)
    };
}

/// `sensor_msgs/PointCloud2`: a cloud.
pub const POINT_CLOUD2: MessageSchema =
    ros1("sensor_msgs/PointCloud2", POINT_CLOUD2_TEXT, "1158d486dd51d683ce2f1be655c3c181");

const POINT_CLOUD2_TEXT: &str = definition!(
    cloud!(),
    header
    point_field
);

/// `tf2_msgs/TFMessage`: poses.
pub const TF_MESSAGE: MessageSchema =
    ros1("tf2_msgs/TFMessage", TF_MESSAGE_TEXT, "94810edda583a504dfda3829e70d7eec");

const TF_MESSAGE_TEXT: &str = definition!(
    "\
geometry_msgs/TransformStamped[] transforms
",
    "\
MSG: geometry_msgs/TransformStamped
Header header
string child_frame_id
geometry_msgs/Transform transform
"
    header
    "\
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
"
    vector
    quaternion
);

/// `visualization_msgs/MarkerArray` since Kinetic: boxes and texts to draw.
pub const MARKER_ARRAY: MessageSchema =
    ros1("visualization_msgs/MarkerArray", MARKER_ARRAY_TEXT, "d155b9ce5188fbaf89745847fd5882d7");

const MARKER_ARRAY_TEXT: &str = definition!(
    "\
Marker[] markers
",
    "\
MSG: visualization_msgs/Marker
uint8 ARROW=0
uint8 CUBE=1
uint8 SPHERE=2
uint8 CYLINDER=3
uint8 LINE_STRIP=4
uint8 LINE_LIST=5
uint8 CUBE_LIST=6
uint8 SPHERE_LIST=7
uint8 POINTS=8
uint8 TEXT_VIEW_FACING=9
uint8 MESH_RESOURCE=10
uint8 TRIANGLE_LIST=11
uint8 ADD=0
uint8 MODIFY=0
uint8 DELETE=2
uint8 DELETEALL=3
Header header
string ns
int32 id
int32 type
int32 action
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
std_msgs/ColorRGBA color
duration lifetime
bool frame_locked
geometry_msgs/Point[] points
std_msgs/ColorRGBA[] colors
string text
string mesh_resource
bool mesh_use_embedded_materials
"
    header
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
);

/// `vision_msgs/Detection3DArray` of version 0.0 (Melodic, Noetic): boxes with classes.
pub const DETECTION_ARRAY: MessageSchema =
    ros1("vision_msgs/Detection3DArray", DETECTION_ARRAY_TEXT, "05c51d9aea1fb4cfdc8effb94f197b6f");

const DETECTION_ARRAY_TEXT: &str = definition!(
    "\
Header header
Detection3D[] detections
",
    header
    "\
MSG: vision_msgs/Detection3D
Header header
ObjectHypothesisWithPose[] results
BoundingBox3D bbox
sensor_msgs/PointCloud2 source_cloud
"
    "\
MSG: vision_msgs/ObjectHypothesisWithPose
int64 id
float64 score
geometry_msgs/PoseWithCovariance pose
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
    cloud
    point_field
);

/// `diagnostic_msgs/DiagnosticArray`: words and numbers beside a cloud.
pub const DIAGNOSTIC_ARRAY: MessageSchema = ros1(
    "diagnostic_msgs/DiagnosticArray",
    DIAGNOSTIC_ARRAY_TEXT,
    "60810da900de1dd6ddd437c3503511da",
);

const DIAGNOSTIC_ARRAY_TEXT: &str = definition!(
    "\
Header header
DiagnosticStatus[] status
",
    header
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use md5::{Digest, Md5};

    use super::*;

    /// The fingerprint of a complete definition: MD5 of its constants and fields, in which other types stand as
    /// their own fingerprints.
    fn fingerprint(definition: &str) -> String {
        let separator = format!("{}\n", "=".repeat(80));
        let mut parts = definition.split(&separator);
        let own = parts.next().unwrap();
        let types: BTreeMap<&str, &str> = parts
            .map(|part| {
                let (name, body) = part.split_once('\n').unwrap();
                let name = name.strip_prefix("MSG: ").unwrap();
                (name.rsplit('/').next().unwrap(), body)
            })
            .collect();
        fingerprint_of(own, &types)
    }

    fn fingerprint_of(body: &str, types: &BTreeMap<&str, &str>) -> String {
        let (constants, fields): (Vec<&str>, Vec<&str>) =
            body.lines().partition(|line| line.contains('='));
        let field = |line: &str| {
            let (kind, name) = line.split_once(' ').unwrap();
            let bare = kind.split('[').next().unwrap().rsplit('/').next().unwrap();
            match types.get(bare) {
                Some(body) => format!("{} {name}", fingerprint_of(body, types)),
                None => line.to_owned(),
            }
        };
        let lines: Vec<String> =
            constants.into_iter().map(str::to_owned).chain(fields.into_iter().map(field)).collect();
        Md5::digest(lines.join("\n")).iter().map(|byte| format!("{byte:02x}")).collect()
    }

    #[test]
    fn definitions_have_the_fingerprints_that_ros_knows() {
        for schema in [POINT_CLOUD2, TF_MESSAGE, MARKER_ARRAY, DETECTION_ARRAY, DIAGNOSTIC_ARRAY] {
            let text = std::str::from_utf8(&schema.data).unwrap();
            assert_eq!(Some(fingerprint(text).as_str()), schema.md5, "{}", schema.name);
        }
    }
}
