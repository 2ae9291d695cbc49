//! `visualization_msgs/MarkerArray`: a box and a number for each instance.

use nalgebra::{Isometry3, Translation3};

use super::object_box::{BOX_ALPHA, ObjectBox, SHORTEST_SIDE, TEXT_HEIGHT, write_pose};
use crate::messages::ros::{Layout, RosWriter};

const CUBE: i32 = 1;
const TEXT_VIEW_FACING: i32 = 9;
const ADD: i32 = 0;
const DELETE_ALL: i32 = 3;

/// Writes a MarkerArray: first a marker that deletes those of the frame before, then for each
/// instance a box (namespace `boxes`) and a text above it (`ids`).
pub(super) fn write(
    layout: Layout,
    header: (i32, u32, &str),
    boxes: &[ObjectBox],
    writer: &mut RosWriter,
) {
    writer.length(1 + 2 * boxes.len());
    write_marker(layout, writer, header, &Marker::delete_all());
    for boxed in boxes {
        write_marker(layout, writer, header, &Marker::cube(boxed));
        write_marker(layout, writer, header, &Marker::label(boxed));
    }
}

/// The fields of a marker that are filled in here.
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

    fn cube(boxed: &'a ObjectBox) -> Self {
        let [red, green, blue] = boxed.colour();
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

    fn label(boxed: &'a ObjectBox) -> Self {
        Marker {
            namespace: "ids",
            id: boxed.id as i32,
            kind: TEXT_VIEW_FACING,
            action: ADD,
            pose: Translation3::from(boxed.above()).into(),
            scale: [0.0, 0.0, TEXT_HEIGHT],
            colour: [1.0; 4],
            text: &boxed.title,
        }
    }
}

/// ROS 1 has neither textures nor mesh files.
fn write_marker(layout: Layout, writer: &mut RosWriter, header: (i32, u32, &str), marker: &Marker) {
    let has_textures = layout != Layout::Ros1;
    writer.header(header);
    writer.string(marker.namespace);
    writer.i32(marker.id);
    writer.i32(marker.kind);
    writer.i32(marker.action);
    write_pose(writer, &marker.pose);
    writer.f64s(marker.scale);
    marker.colour.into_iter().for_each(|value| writer.f32(value));
    writer.i32(0); // lifetime: until deleted
    writer.u32(0);
    writer.bool(false); // frame_locked
    writer.length(0); // points
    writer.length(0); // colors
    if has_textures {
        writer.string(""); // texture_resource
        writer.header((0, 0, "")); // texture
        writer.string("");
        writer.length(0);
        writer.length(0); // uv_coordinates
    }
    writer.string(marker.text);
    writer.string(""); // mesh_resource
    if has_textures {
        writer.string(""); // mesh_file
        writer.length(0);
    }
    writer.bool(false); // mesh_use_embedded_materials
}

#[cfg(test)]
mod tests {
    use super::super::tests::upright;
    use super::*;
    use crate::messages::palette::{BACKGROUND_COLOUR, instance_colour};
    use crate::messages::ros::{ByteOrder, RosReader};

    const LAYOUTS: [Layout; 3] =
        [Layout::Cdr(ByteOrder::Little), Layout::Cdr(ByteOrder::Big), Layout::Ros1];

    fn written(layout: Layout, boxes: &[ObjectBox]) -> Vec<u8> {
        let mut bytes = vec![1; 9];
        let mut writer = RosWriter::new(layout, &mut bytes);
        write(layout, (-3, 4, "lidar"), boxes, &mut writer);
        bytes
    }

    type Read = (String, [i32; 3], [f64; 10], [f32; 4], String);

    /// Takes a message apart again, field by field.
    fn read(layout: Layout, bytes: &[u8]) -> Vec<Read> {
        let mut reader = match layout {
            Layout::Cdr(_) => RosReader::cdr("MarkerArray", bytes).unwrap(),
            Layout::Ros1 => RosReader::ros1("MarkerArray", bytes),
        };
        let r = &mut reader;
        let count = r.u32().unwrap();
        let mut markers = Vec::new();
        for _ in 0..count {
            let sec = if layout == Layout::Ros1 { i64::from(-3_i32 as u32) } else { -3 };
            assert_eq!(r.header().unwrap(), (sec, 4, "lidar".to_owned()));
            let namespace = r.string().unwrap();
            let codes = [(); 3].map(|()| r.i32().unwrap());
            let pose_and_scale = [(); 10].map(|()| r.f64().unwrap());
            let colour = [(); 4].map(|()| r.f32().unwrap());
            assert_eq!((r.i32().unwrap(), r.u32().unwrap()), (0, 0));
            assert!(!r.bool().unwrap());
            assert_eq!((r.u32().unwrap(), r.u32().unwrap()), (0, 0));
            if layout != Layout::Ros1 {
                assert_eq!(r.string().unwrap(), "");
                assert_eq!(r.header().unwrap(), Default::default());
                assert_eq!((r.string().unwrap(), r.u32().unwrap()), Default::default());
                assert_eq!(r.u32().unwrap(), 0);
            }
            let text = r.string().unwrap();
            assert_eq!(r.string().unwrap(), "");
            if layout != Layout::Ros1 {
                assert_eq!((r.string().unwrap(), r.u32().unwrap()), Default::default());
            }
            assert!(!r.bool().unwrap());
            markers.push((namespace, codes, pose_and_scale, colour, text));
        }
        assert_eq!(r.remaining(), 0);
        markers
    }

    #[test]
    fn a_box_and_a_text_for_each_instance() {
        let boxes = [upright(12, [1.0, 2.0, 3.0], [4.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2)];
        for layout in LAYOUTS {
            let markers = read(layout, &written(layout, &boxes));
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
    fn background_is_grey() {
        let mut boxed = upright(12, [1.0, 2.0, 3.0], [4.0, 2.0, 1.0], 0.0);
        boxed.is_object = false;
        let markers = read(LAYOUTS[0], &written(LAYOUTS[0], &[boxed]));
        let grey = BACKGROUND_COLOUR.map(|value| f32::from(value) / 255.0);
        assert_eq!(markers[1].3[..3], grey);
        assert!(grey[0] == grey[1] && grey[1] == grey[2]);
    }

    #[test]
    fn a_frame_without_instances_still_deletes_those_before() {
        let layout = LAYOUTS[0];
        let markers = read(layout, &written(layout, &[]));
        assert_eq!(markers.len(), 1);
        assert_eq!(markers[0].1[2], DELETE_ALL);
    }
}
