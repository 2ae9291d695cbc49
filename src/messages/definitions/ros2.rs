//! Definitions (`ros2msg`) of the ROS 2 messages that are read or written.

use super::schema::{MessageSchema, definition};

/// `sensor_msgs/msg/PointCloud2`: a cloud.
pub const POINT_CLOUD2: MessageSchema = MessageSchema::ros2(
    "sensor_msgs/msg/PointCloud2",
    definition!(
        ros2 "sensor_msgs/PointCloud2":
        ros2 "std_msgs/Header"
        ros2 "builtin_interfaces/Time"
        both "sensor_msgs/PointField"
    ),
);

/// `foxglove_msgs/msg/PointCloud`: a cloud as Foxglove has it.
pub const FOXGLOVE_POINT_CLOUD: MessageSchema = MessageSchema::ros2(
    "foxglove_msgs/msg/PointCloud",
    definition!(
        ros2 "foxglove_msgs/PointCloud":
        ros2 "builtin_interfaces/Time"
        both "geometry_msgs/Pose"
        both "geometry_msgs/Point"
        ros2 "geometry_msgs/Quaternion"
        ros2 "foxglove_msgs/PackedElementField"
    ),
);

/// `visualization_msgs/msg/MarkerArray`: boxes and texts to draw.
pub const MARKER_ARRAY: MessageSchema = MessageSchema::ros2(
    "visualization_msgs/msg/MarkerArray",
    definition!(
        both "visualization_msgs/MarkerArray":
        ros2 "visualization_msgs/Marker"
        ros2 "std_msgs/Header"
        ros2 "builtin_interfaces/Time"
        ros2 "builtin_interfaces/Duration"
        both "geometry_msgs/Pose"
        both "geometry_msgs/Point"
        ros2 "geometry_msgs/Quaternion"
        both "geometry_msgs/Vector3"
        both "std_msgs/ColorRGBA"
        ros2 "sensor_msgs/CompressedImage"
        ros2 "visualization_msgs/UVCoordinate"
        ros2 "visualization_msgs/MeshFile"
    ),
);

/// `vision_msgs/msg/Detection3DArray` since version 4 (Humble): boxes with classes.
pub const DETECTION_ARRAY: MessageSchema = MessageSchema::ros2(
    "vision_msgs/msg/Detection3DArray",
    definition!(
        ros2 "vision_msgs/Detection3DArray":
        ros2 "std_msgs/Header"
        ros2 "builtin_interfaces/Time"
        ros2 "vision_msgs/Detection3D"
        ros2 "vision_msgs/ObjectHypothesisWithPose"
        ros2 "vision_msgs/ObjectHypothesis"
        both "geometry_msgs/PoseWithCovariance"
        both "geometry_msgs/Pose"
        both "geometry_msgs/Point"
        ros2 "geometry_msgs/Quaternion"
        both "vision_msgs/BoundingBox3D"
        both "geometry_msgs/Vector3"
    ),
);

/// `autoware_perception_msgs/msg/DetectedObjects`: boxes with Autoware's classes.
pub const DETECTED_OBJECTS: MessageSchema = MessageSchema::ros2(
    "autoware_perception_msgs/msg/DetectedObjects",
    definition!(
        ros2 "autoware_perception_msgs/DetectedObjects":
        ros2 "std_msgs/Header"
        ros2 "builtin_interfaces/Time"
        ros2 "autoware_perception_msgs/DetectedObject"
        ros2 "autoware_perception_msgs/ObjectClassification"
        ros2 "autoware_perception_msgs/DetectedObjectKinematics"
        ros2 "autoware_perception_msgs/Shape"
        both "geometry_msgs/PoseWithCovariance"
        both "geometry_msgs/Pose"
        both "geometry_msgs/Point"
        ros2 "geometry_msgs/Quaternion"
        both "geometry_msgs/Vector3"
        ros2 "geometry_msgs/TwistWithCovariance"
        ros2 "geometry_msgs/Twist"
        ros2 "geometry_msgs/Polygon"
        ros2 "geometry_msgs/Point32"
    ),
);

/// `tf2_msgs/msg/TFMessage`: poses.
pub const TF_MESSAGE: MessageSchema = MessageSchema::ros2(
    "tf2_msgs/msg/TFMessage",
    definition!(
        both "tf2_msgs/TFMessage":
        ros2 "geometry_msgs/TransformStamped"
        ros2 "std_msgs/Header"
        ros2 "builtin_interfaces/Time"
        both "geometry_msgs/Transform"
        both "geometry_msgs/Vector3"
        ros2 "geometry_msgs/Quaternion"
    ),
);

/// `diagnostic_msgs/msg/DiagnosticArray`: words and numbers beside a cloud.
pub const DIAGNOSTIC_ARRAY: MessageSchema = MessageSchema::ros2(
    "diagnostic_msgs/msg/DiagnosticArray",
    definition!(
        ros2 "diagnostic_msgs/DiagnosticArray":
        ros2 "std_msgs/Header"
        ros2 "builtin_interfaces/Time"
        both "diagnostic_msgs/DiagnosticStatus"
        both "diagnostic_msgs/KeyValue"
    ),
);

/// `sensor_msgs/msg/CameraInfo`: a camera's calibration.
pub const CAMERA_INFO: MessageSchema = MessageSchema::ros2(
    "sensor_msgs/msg/CameraInfo",
    definition!(
        ros2 "sensor_msgs/CameraInfo":
        ros2 "std_msgs/Header"
        ros2 "builtin_interfaces/Time"
        ros2 "sensor_msgs/RegionOfInterest"
    ),
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_of_a_definition_is_defined_in_it() {
        let separator = "=".repeat(80);
        for (definition, types) in [
            (POINT_CLOUD2, 3),
            (MARKER_ARRAY, 12),
            (DETECTION_ARRAY, 11),
            (DETECTED_OBJECTS, 15),
            (FOXGLOVE_POINT_CLOUD, 5),
            (TF_MESSAGE, 6),
            (CAMERA_INFO, 3),
            (DIAGNOSTIC_ARRAY, 4),
        ] {
            let definition = std::str::from_utf8(&definition.data).unwrap();
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
