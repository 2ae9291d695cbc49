//! `visualization_msgs/msg/MarkerArray`: a box and a number for each instance.

use super::cdr::{ByteOrder, CdrWriter};
use crate::palette::instance_colour;

/// Name of the schema in a ROS 2 recording.
pub const MARKER_ARRAY_NAME: &str = "visualization_msgs/msg/MarkerArray";

/// Complete `ros2msg` definition of `visualization_msgs/msg/MarkerArray`.
pub const MARKER_ARRAY_SCHEMA: &str = "\
Marker[] markers
================================================================================
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
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Pose
Point position
Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: std_msgs/ColorRGBA
float32 r
float32 g
float32 b
float32 a
================================================================================
MSG: sensor_msgs/CompressedImage
std_msgs/Header header
string format
uint8[] data
================================================================================
MSG: visualization_msgs/UVCoordinate
float32 u
float32 v
================================================================================
MSG: visualization_msgs/MeshFile
string filename
uint8[] data
";

/// Opacity of a box.
const BOX_ALPHA: f32 = 0.35;
/// Shortest side of a drawn box in metres; a flat box would not be seen.
const SHORTEST_SIDE: f64 = 0.05;
/// Height of the letters in metres.
const TEXT_HEIGHT: f64 = 0.4;

const CUBE: i32 = 1;
const TEXT_VIEW_FACING: i32 = 9;
const ADD: i32 = 0;
const DELETE_ALL: i32 = 3;

/// One instance to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkerBox {
    /// Instance, which gives the marker its id and its colour.
    pub id: u32,
    /// Centre in metres.
    pub centre: [f64; 3],
    /// Rotation about the vertical in radians.
    pub yaw: f64,
    /// Length, width and height in metres.
    pub size: [f64; 3],
    /// What is written above the box.
    pub text: String,
}

/// Writes a MarkerArray message, replacing what is in `out`: first a marker that deletes those of
/// the frame before, then for each instance a box (namespace `boxes`) and a text above it (`ids`).
pub fn marker_array(
    byte_order: ByteOrder,
    stamp_sec: i32,
    stamp_nanosec: u32,
    frame_id: &str,
    boxes: &[MarkerBox],
    out: &mut Vec<u8>,
) {
    let mut writer = CdrWriter::new(byte_order, out);
    let header = (stamp_sec, stamp_nanosec, frame_id);
    writer.length(1 + 2 * boxes.len());
    write_marker(&mut writer, header, &Marker::delete_all());
    for boxed in boxes {
        write_marker(&mut writer, header, &Marker::cube(boxed));
        write_marker(&mut writer, header, &Marker::label(boxed));
    }
}

/// The fields of a marker that are not always empty here.
struct Marker<'a> {
    namespace: &'a str,
    id: i32,
    kind: i32,
    action: i32,
    position: [f64; 3],
    yaw: f64,
    scale: [f64; 3],
    colour: [f32; 4],
    text: &'a str,
}

impl<'a> Marker<'a> {
    fn delete_all() -> Self {
        Marker {
            namespace: "",
            id: 0,
            kind: 0,
            action: DELETE_ALL,
            position: [0.0; 3],
            yaw: 0.0,
            scale: [0.0; 3],
            colour: [0.0; 4],
            text: "",
        }
    }

    fn cube(boxed: &'a MarkerBox) -> Self {
        let [red, green, blue] = instance_colour(boxed.id).map(|value| f32::from(value) / 255.0);
        Marker {
            namespace: "boxes",
            id: boxed.id as i32,
            kind: CUBE,
            action: ADD,
            position: boxed.centre,
            yaw: boxed.yaw,
            scale: boxed.size.map(|side| side.max(SHORTEST_SIDE)),
            colour: [red, green, blue, BOX_ALPHA],
            text: "",
        }
    }

    fn label(boxed: &'a MarkerBox) -> Self {
        let [x, y, z] = boxed.centre;
        Marker {
            namespace: "ids",
            id: boxed.id as i32,
            kind: TEXT_VIEW_FACING,
            action: ADD,
            position: [x, y, z + boxed.size[2] / 2.0 + TEXT_HEIGHT],
            yaw: 0.0,
            scale: [0.0, 0.0, TEXT_HEIGHT],
            colour: [1.0; 4],
            text: &boxed.text,
        }
    }
}

fn write_marker(writer: &mut CdrWriter, header: (i32, u32, &str), marker: &Marker) {
    write_header(writer, header);
    writer.string(marker.namespace);
    writer.i32(marker.id);
    writer.i32(marker.kind);
    writer.i32(marker.action);
    let (sin, cos) = (marker.yaw / 2.0).sin_cos();
    let orientation = [0.0, 0.0, sin, cos];
    for value in marker.position.into_iter().chain(orientation) {
        writer.f64(value);
    }
    marker.scale.into_iter().for_each(|value| writer.f64(value));
    marker
        .colour
        .into_iter()
        .for_each(|value| writer.f32(value));
    writer.i32(0); // lifetime: until deleted
    writer.u32(0);
    writer.bool(false); // frame_locked
    writer.length(0); // points
    writer.length(0); // colors
    writer.string(""); // texture_resource
    write_header(writer, (0, 0, "")); // texture
    writer.string("");
    writer.length(0);
    writer.length(0); // uv_coordinates
    writer.string(marker.text);
    writer.string(""); // mesh_resource
    writer.string(""); // mesh_file
    writer.length(0);
    writer.bool(false); // mesh_use_embedded_materials
}

fn write_header(writer: &mut CdrWriter, (sec, nanosec, frame_id): (i32, u32, &str)) {
    writer.i32(sec);
    writer.u32(nanosec);
    writer.string(frame_id);
}
