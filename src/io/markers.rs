//! `visualization_msgs/msg/MarkerArray`: a box and a number for each instance.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::ros::{Layout, RosWriter};
use crate::palette::instance_colour;

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
    /// Its centre and its axes in the message's frame, metres; z is upwards in the world.
    pub pose: Isometry3<f64>,
    /// Length, width and height in metres.
    pub size: [f64; 3],
    /// What is written above the box.
    pub text: String,
}

impl MarkerBox {
    /// A box that stands upright in the message's frame: its centre (metres) and the direction of its length
    /// (radians from the x axis).
    pub fn upright(id: u32, centre: [f64; 3], yaw: f64, size: [f64; 3], text: String) -> Self {
        MarkerBox { id, pose: upright_pose(centre, yaw), size, text }
    }
}

/// The pose of an upright box.
pub fn upright_pose(centre: [f64; 3], yaw: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
    Isometry3::from_parts(Translation3::from(centre), turn)
}

/// Writes a MarkerArray message, replacing what is in `out`: first a marker that deletes those of
/// the frame before, then for each instance a box (namespace `boxes`) and a text above it (`ids`).
pub fn marker_array(
    layout: Layout,
    stamp_sec: i32,
    stamp_nanosec: u32,
    frame_id: &str,
    boxes: &[MarkerBox],
    out: &mut Vec<u8>,
) {
    let mut writer = RosWriter::new(layout, out);
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
    pose: Isometry3<f64>,
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
            pose: Isometry3::identity(),
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
            pose: boxed.pose,
            scale: boxed.size.map(|side| side.max(SHORTEST_SIDE)),
            colour: [red, green, blue, BOX_ALPHA],
            text: "",
        }
    }

    fn label(boxed: &'a MarkerBox) -> Self {
        let up = boxed.pose.rotation * Vector3::z();
        let above = boxed.pose.translation.vector + up * (boxed.size[2] / 2.0) + up * TEXT_HEIGHT;
        Marker {
            namespace: "ids",
            id: boxed.id as i32,
            kind: TEXT_VIEW_FACING,
            action: ADD,
            pose: Translation3::from(above).into(),
            scale: [0.0, 0.0, TEXT_HEIGHT],
            colour: [1.0; 4],
            text: &boxed.text,
        }
    }
}

fn write_marker(writer: &mut RosWriter, header: (i32, u32, &str), marker: &Marker) {
    writer.header(header);
    writer.string(marker.namespace);
    writer.i32(marker.id);
    writer.i32(marker.kind);
    writer.i32(marker.action);
    let Isometry3 { rotation, translation } = &marker.pose;
    for value in translation.vector.iter().chain(rotation.coords.iter()) {
        writer.f64(value + 0.0); // never -0
    }
    marker.scale.into_iter().for_each(|value| writer.f64(value));
    marker.colour.into_iter().for_each(|value| writer.f32(value));
    writer.i32(0); // lifetime: until deleted
    writer.u32(0);
    writer.bool(false); // frame_locked
    writer.length(0); // points
    writer.length(0); // colors
    writer.string(""); // texture_resource
    writer.header((0, 0, "")); // texture
    writer.string("");
    writer.length(0);
    writer.length(0); // uv_coordinates
    writer.string(marker.text);
    writer.string(""); // mesh_resource
    writer.string(""); // mesh_file
    writer.length(0);
    writer.bool(false); // mesh_use_embedded_materials
}

#[cfg(test)]
mod tests {
    use super::super::ros::{ByteOrder, RosReader};
    use super::*;

    type Read = (String, [i32; 3], [f64; 10], [f32; 4], String);

    /// Takes a message apart again, field by field.
    fn read(cdr: &[u8]) -> Vec<Read> {
        let mut reader = RosReader::cdr("MarkerArray", cdr).unwrap();
        let r = &mut reader;
        let count = r.u32().unwrap();
        let mut markers = Vec::new();
        for _ in 0..count {
            assert_eq!((r.i32().unwrap(), r.u32().unwrap()), (-3, 4));
            assert_eq!(r.string().unwrap(), "lidar");
            let namespace = r.string().unwrap();
            let codes = [(); 3].map(|()| r.i32().unwrap());
            let pose_and_scale = [(); 10].map(|()| r.f64().unwrap());
            let colour = [(); 4].map(|()| r.f32().unwrap());
            assert_eq!((r.i32().unwrap(), r.u32().unwrap()), (0, 0));
            assert!(!r.bool().unwrap());
            assert_eq!((r.u32().unwrap(), r.u32().unwrap()), (0, 0));
            assert_eq!(r.string().unwrap(), "");
            assert_eq!((r.i32().unwrap(), r.u32().unwrap()), (0, 0));
            assert_eq!((r.string().unwrap(), r.string().unwrap()), Default::default());
            assert_eq!((r.u32().unwrap(), r.u32().unwrap()), (0, 0));
            let text = r.string().unwrap();
            assert_eq!((r.string().unwrap(), r.string().unwrap()), Default::default());
            assert_eq!(r.u32().unwrap(), 0);
            assert!(!r.bool().unwrap());
            markers.push((namespace, codes, pose_and_scale, colour, text));
        }
        assert_eq!(r.remaining(), 0);
        markers
    }

    #[test]
    fn a_box_and_a_text_for_each_instance() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let text = "12 car".to_owned();
        let boxes = [MarkerBox::upright(12, [1.0, 2.0, 3.0], quarter, [4.0, 0.0, 1.0], text)];
        for byte_order in [ByteOrder::Little, ByteOrder::Big] {
            let mut cdr = Vec::new();
            marker_array(Layout::Cdr(byte_order), -3, 4, "lidar", &boxes, &mut cdr);
            let markers = read(&cdr);
            assert_eq!(markers.len(), 3);
            assert_eq!(markers[0].1, [0, 0, DELETE_ALL]);
            let (namespace, codes, pose, colour, text) = &markers[1];
            assert_eq!((namespace.as_str(), *codes, text.as_str()), ("boxes", [12, CUBE, ADD], ""));
            let half = std::f64::consts::FRAC_1_SQRT_2;
            let expected = [1.0, 2.0, 3.0, 0.0, 0.0, half, half, 4.0, SHORTEST_SIDE, 1.0];
            assert!(pose.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{pose:?}");
            assert_eq!(colour[0], f32::from(instance_colour(12)[0]) / 255.0);
            assert_eq!(colour[3], BOX_ALPHA);
            let (namespace, codes, pose, colour, text) = &markers[2];
            assert_eq!(namespace, "ids");
            assert_eq!((*codes, text.as_str()), ([12, TEXT_VIEW_FACING, ADD], "12 car"));
            assert!(pose[2] > 3.5);
            assert_eq!((pose[9], *colour), (TEXT_HEIGHT, [1.0; 4]));
        }
    }

    #[test]
    fn a_frame_without_instances_still_deletes_those_before() {
        let mut cdr = vec![1; 9];
        marker_array(Layout::Cdr(ByteOrder::Little), -3, 4, "lidar", &[], &mut cdr);
        let markers = read(&cdr);
        assert_eq!(markers.len(), 1);
        assert_eq!(markers[0].1[2], DELETE_ALL);
    }
}
