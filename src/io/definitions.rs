//! Names and definitions (`ros2msg`, and `ros1msg` where the name says so) of the ROS messages that are read or written,
//! put together from parts that several share.

/// Name of the schema of point clouds.
pub const POINT_CLOUD2_NAME: &str = "sensor_msgs/msg/PointCloud2";
/// Name of the schema of boxes and texts to draw.
pub const MARKER_ARRAY_NAME: &str = "visualization_msgs/msg/MarkerArray";
/// Sum of the definition of point clouds in ROS 1, by which its tools tell definitions apart.
pub const POINT_CLOUD2_ROS1_MD5: &str = "1158d486dd51d683ce2f1be655c3c181";
/// Name of the schema of poses in ROS 1.
pub const TF_MESSAGE_ROS1_NAME: &str = "tf2_msgs/TFMessage";
/// Sum of the definition of poses in ROS 1.
pub const TF_MESSAGE_ROS1_MD5: &str = "94810edda583a504dfda3829e70d7eec";
/// Name of the schema of poses.
pub const TF_MESSAGE_NAME: &str = "tf2_msgs/msg/TFMessage";
/// Name of the schema of a camera's calibration.
pub const CAMERA_INFO_NAME: &str = "sensor_msgs/msg/CameraInfo";
/// Name of the schema of words and numbers beside a cloud in ROS 1.
pub const DIAGNOSTIC_ARRAY_ROS1_NAME: &str = "diagnostic_msgs/DiagnosticArray";
/// Sum of the definition of words and numbers beside a cloud in ROS 1.
pub const DIAGNOSTIC_ARRAY_ROS1_MD5: &str = "60810da900de1dd6ddd437c3503511da";
/// Name of the schema of words and numbers beside a cloud.
pub const DIAGNOSTIC_ARRAY_NAME: &str = "diagnostic_msgs/msg/DiagnosticArray";

/// A message's own fields, then the line and the definition of each type in it.
macro_rules! definition {
    ($own:literal, $($part:tt)*) => { concat!($own, $(separator!(), part!($part)),*) };
}

macro_rules! separator {
    () => {
        "================================================================================\n"
    };
}

macro_rules! part {
    (header) => {
        "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    };
    (header_of_ros1) => {
        "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
    };
    (time) => {
        "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    };
    (vector) => {
        "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
    };
    (quaternion) => {
        "MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"
    };
    (pose) => {
        "MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n"
    };
    (point) => {
        "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n"
    };
    (transform_stamped) => {
        "\
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
"
    };
    (transform) => {
        "\
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
"
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

/// The fields of `sensor_msgs/PointCloud2`, the same in ROS 1 and 2.
macro_rules! point_cloud2 {
    ($($part:tt)*) => {
        definition!(
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
            $($part)*
            point_field
        )
    };
}

/// The fields of `diagnostic_msgs/DiagnosticArray`, the same in ROS 1 and 2.
macro_rules! diagnostic_array {
    ($($part:tt)*) => {
        definition!(
            "std_msgs/Header header\nDiagnosticStatus[] status\n",
            $($part)*
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
        )
    };
}

/// Complete definition of `sensor_msgs/msg/PointCloud2`.
pub const POINT_CLOUD2_SCHEMA: &str = point_cloud2!(header time);

/// Complete definition of `sensor_msgs/PointCloud2` in ROS 1.
pub const POINT_CLOUD2_ROS1_SCHEMA: &str = point_cloud2!(header_of_ros1);

/// Complete definition of `foxglove_msgs/msg/PointCloud`.
pub const FOXGLOVE_POINT_CLOUD_SCHEMA: &str = definition!(
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

/// Complete definition of `visualization_msgs/msg/MarkerArray`.
pub const MARKER_ARRAY_SCHEMA: &str = definition!(
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

/// Complete definition of `tf2_msgs/msg/TFMessage`.
pub const TF_MESSAGE_SCHEMA: &str = definition!(
    "\
geometry_msgs/TransformStamped[] transforms
",
    transform_stamped
    header
    time
    transform
    vector
    quaternion
);

/// Complete definition of `tf2_msgs/TFMessage` in ROS 1.
pub const TF_MESSAGE_ROS1_SCHEMA: &str = definition!(
    "\
geometry_msgs/TransformStamped[] transforms
",
    transform_stamped
    header_of_ros1
    transform
    vector
    "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
);

/// Complete definition of `diagnostic_msgs/msg/DiagnosticArray`.
pub const DIAGNOSTIC_ARRAY_SCHEMA: &str = diagnostic_array!(header time);

/// Complete definition of `diagnostic_msgs/DiagnosticArray` in ROS 1.
pub const DIAGNOSTIC_ARRAY_ROS1_SCHEMA: &str = diagnostic_array!(header_of_ros1);

/// Complete definition of `sensor_msgs/msg/CameraInfo`.
pub const CAMERA_INFO_SCHEMA: &str = definition!(
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
            (POINT_CLOUD2_SCHEMA, 3),
            (MARKER_ARRAY_SCHEMA, 12),
            (TF_MESSAGE_SCHEMA, 6),
            (FOXGLOVE_POINT_CLOUD_SCHEMA, 5),
            (POINT_CLOUD2_ROS1_SCHEMA, 2),
            (TF_MESSAGE_ROS1_SCHEMA, 5),
            (CAMERA_INFO_SCHEMA, 3),
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

    /// The sum of a definition as ROS 1 makes it: of its constants, then of its fields, where instead of the name of
    /// a type that is defined stands that type's own sum.
    fn ros1_sum(definition: &str) -> String {
        let separator = "=".repeat(80) + "\n";
        let mut parts = definition.split(separator.as_str());
        let own = parts.next().unwrap();
        let parts: Vec<(&str, &str)> = parts
            .map(|part| part.strip_prefix("MSG: ").and_then(|part| part.split_once('\n')).unwrap())
            .collect();
        sum_of(own, &parts)
    }

    fn sum_of(fields: &str, parts: &[(&str, &str)]) -> String {
        use md5::{Digest, Md5};
        let (constants, fields): (Vec<&str>, Vec<&str>) =
            fields.lines().partition(|line| line.contains('='));
        let fields = fields.into_iter().map(|line| {
            let (full, name) = line.split_once(' ').unwrap();
            let bare = full.split('[').next().unwrap();
            let is_it = |known: &str| known == bare || known.ends_with(&format!("/{bare}"));
            match parts.iter().find(|(known, _)| is_it(known)) {
                Some((_, part)) => format!("{} {name}", sum_of(part, parts)),
                None => line.to_owned(),
            }
        });
        let lines: Vec<String> = constants.into_iter().map(str::to_owned).chain(fields).collect();
        Md5::digest(lines.join("\n")).iter().map(|byte| format!("{byte:02x}")).collect()
    }

    #[test]
    fn definitions_of_ros1_have_the_official_sums() {
        assert_eq!(ros1_sum(POINT_CLOUD2_ROS1_SCHEMA), POINT_CLOUD2_ROS1_MD5);
        assert_eq!(ros1_sum(TF_MESSAGE_ROS1_SCHEMA), TF_MESSAGE_ROS1_MD5);
        assert_eq!(ros1_sum(DIAGNOSTIC_ARRAY_ROS1_SCHEMA), DIAGNOSTIC_ARRAY_ROS1_MD5);
        assert_ne!(ros1_sum(TF_MESSAGE_SCHEMA), TF_MESSAGE_ROS1_MD5);
    }
}
