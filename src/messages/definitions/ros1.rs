//! Definitions (`ros1msg`) and fingerprints of the ROS 1 messages that are written.

use super::schema::{MessageSchema, definition};

/// `sensor_msgs/PointCloud2`: a cloud.
pub const POINT_CLOUD2: MessageSchema = MessageSchema::ros1(
    "sensor_msgs/PointCloud2",
    definition!(
        ros1 "sensor_msgs/PointCloud2":
        ros1 "std_msgs/Header"
        both "sensor_msgs/PointField"
    ),
    "1158d486dd51d683ce2f1be655c3c181",
);

/// `tf2_msgs/TFMessage`: poses.
pub const TF_MESSAGE: MessageSchema = MessageSchema::ros1(
    "tf2_msgs/TFMessage",
    definition!(
        both "tf2_msgs/TFMessage":
        ros1 "geometry_msgs/TransformStamped"
        ros1 "std_msgs/Header"
        both "geometry_msgs/Transform"
        both "geometry_msgs/Vector3"
        ros1 "geometry_msgs/Quaternion"
    ),
    "94810edda583a504dfda3829e70d7eec",
);

/// `visualization_msgs/MarkerArray` since Kinetic: boxes and texts to draw.
pub const MARKER_ARRAY: MessageSchema = MessageSchema::ros1(
    "visualization_msgs/MarkerArray",
    definition!(
        both "visualization_msgs/MarkerArray":
        ros1 "visualization_msgs/Marker"
        ros1 "std_msgs/Header"
        both "geometry_msgs/Pose"
        both "geometry_msgs/Point"
        ros1 "geometry_msgs/Quaternion"
        both "geometry_msgs/Vector3"
        both "std_msgs/ColorRGBA"
    ),
    "d155b9ce5188fbaf89745847fd5882d7",
);

/// `vision_msgs/Detection3DArray` of version 0.0 (Melodic, Noetic): boxes with classes.
pub const DETECTION_ARRAY: MessageSchema = MessageSchema::ros1(
    "vision_msgs/Detection3DArray",
    definition!(
        ros1 "vision_msgs/Detection3DArray":
        ros1 "std_msgs/Header"
        ros1 "vision_msgs/Detection3D"
        ros1 "vision_msgs/ObjectHypothesisWithPose"
        both "geometry_msgs/PoseWithCovariance"
        both "geometry_msgs/Pose"
        both "geometry_msgs/Point"
        ros1 "geometry_msgs/Quaternion"
        both "vision_msgs/BoundingBox3D"
        both "geometry_msgs/Vector3"
        ros1 "sensor_msgs/PointCloud2"
        both "sensor_msgs/PointField"
    ),
    "05c51d9aea1fb4cfdc8effb94f197b6f",
);

/// `diagnostic_msgs/DiagnosticArray`: words and numbers beside a cloud.
pub const DIAGNOSTIC_ARRAY: MessageSchema = MessageSchema::ros1(
    "diagnostic_msgs/DiagnosticArray",
    definition!(
        ros1 "diagnostic_msgs/DiagnosticArray":
        ros1 "std_msgs/Header"
        both "diagnostic_msgs/DiagnosticStatus"
        both "diagnostic_msgs/KeyValue"
    ),
    "60810da900de1dd6ddd437c3503511da",
);

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use md5::{Digest, Md5};

    use super::*;

    /// The fingerprint of a complete definition: MD5 of its constants and fields, in which other
    /// types stand as their own fingerprints.
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
