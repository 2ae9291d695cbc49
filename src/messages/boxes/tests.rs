use super::*;
use crate::messages::objects::tests::upright;
use crate::messages::objects::{ObjectBox, ObjectEncoding, ObjectKind};
use crate::messages::ros::{ByteOrder, Layout, RosWriter};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

fn class(name: &str) -> Option<u16> {
    Some(Taxonomy::semantic_kitti().class_named(name).unwrap())
}

fn boxed(id: u32, yaw: f64, size: [f64; 3], text: &str) -> ObjectBox {
    ObjectBox { title: text.to_owned(), ..upright(id, [1.0, 2.0, 3.0], size, yaw) }
}

fn our_markers(order: ByteOrder, boxes: &[ObjectBox]) -> Vec<u8> {
    let encoding = ObjectEncoding::Ros(Layout::Cdr(order));
    let mut cdr = Vec::new();
    ObjectKind::Markers.write(encoding, (5, 6, "lidar"), boxes, &mut cdr).unwrap();
    cdr
}

#[test]
fn our_own_markers() {
    let boxes = [
        boxed(2, 0.5, [4.0, 2.0, 1.5], "2 car"),
        boxed(1, -1.0, [2.0, 4.0, 1.5], "1 other-vehicle"),
        boxed(7, 0.0, [1.0, 1.0, 1.0], "7 vehicle-like 83 %"),
    ];
    let taxonomy = Taxonomy::semantic_kitti();
    for byte_order in [ByteOrder::Little, ByteOrder::Big] {
        let cdr = our_markers(byte_order, &boxes);
        let read = marker_boxes(&cdr, true, &taxonomy).unwrap().unwrap();
        assert_eq!((read.stamp_ns, read.frame_id.as_str()), (5_000_000_006, "lidar"));
        let classes: Vec<_> = read.detections.iter().map(|found| found.class).collect();
        assert_eq!(classes, [class("other-vehicle"), class("car"), None]); // by id
        let [turned, plain, _] = [0, 1, 2].map(|i| read.detections[i].bounds);
        assert_eq!((plain.size, plain.centre), ([4.0, 2.0, 1.5], [1.0, 2.0, 3.0]));
        assert!((plain.yaw - 0.5).abs() < 1e-12);
        assert_eq!(turned.size, [4.0, 2.0, 1.5]);
        assert!((turned.yaw - (FRAC_PI_2 - 1.0)).abs() < 1e-12, "{turned:?}");
        assert!(read.detections.iter().all(|found| found.score == 1.0));
    }
}

#[test]
fn an_array_that_ends_early_or_late_or_has_no_marker() {
    let taxonomy = Taxonomy::semantic_kitti();
    let mut cdr = our_markers(ByteOrder::Little, &[boxed(1, 0.0, [1.0; 3], "")]);
    for cut in 0..cdr.len() {
        assert!(marker_boxes(&cdr[..cut], true, &taxonomy).is_err(), "{cut}");
    }
    assert!(marker_boxes(&cdr, false, &taxonomy).is_err());
    cdr.extend([0; 8]);
    assert!(marker_boxes(&cdr, true, &taxonomy).is_err());
    assert_eq!(marker_boxes(&[0, 1, 0, 0, 0, 0, 0, 0], true, &taxonomy).unwrap(), None);
    let cdr = our_markers(ByteOrder::Little, &[]);
    let empty = marker_boxes(&cdr, true, &taxonomy).unwrap().unwrap();
    assert_eq!((empty.stamp_ns, empty.detections.len()), (5_000_000_006, 0));
}

/// Namespace, id, kind and action of a marker, written as before Humble: without textures.
fn old_markers(markers: &[(&str, i32, i32, i32, &str, &str)]) -> Vec<u8> {
    let mut cdr = Vec::new();
    let mut w = RosWriter::new(Layout::Cdr(ByteOrder::Little), &mut cdr);
    w.length(markers.len());
    for &(namespace, id, kind, action, frame, text) in markers {
        w.i32(1);
        w.u32(2);
        w.string(frame);
        w.string(namespace);
        [id, kind, action].into_iter().for_each(|value| w.i32(value));
        let pose = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 2.0, 1.0];
        pose.into_iter().for_each(|value| w.f64(value));
        [0.0; 4].into_iter().for_each(|value| w.f32(value));
        w.i32(0);
        w.u32(0);
        w.bool(false);
        w.length(1);
        [0.0; 3].into_iter().for_each(|value| w.f64(value));
        w.length(0);
        w.string(text);
        w.string("");
        w.bool(false);
    }
    cdr
}

#[test]
fn what_is_deleted_is_no_box_and_namespaces_name_classes() {
    let taxonomy = Taxonomy::semantic_kitti();
    let cdr = old_markers(&[
        ("stale", 9, CUBE, ADD, "lidar", ""),
        ("", 0, 0, DELETE_ALL, "", ""),
        ("Car", 1, CUBE, ADD, "lidar", ""),
        ("Car", 2, CUBE, ADD, "lidar", "truck"),
        ("person", 3, CUBE, ADD, "lidar", ""),
        ("person", 3, CUBE, DELETE, "lidar", ""),
        ("detector", 4, CUBE, ADD, "lidar", "something"),
        ("detector", 5, 2, ADD, "lidar", "a sphere"),
    ]);
    let read = marker_boxes(&cdr, false, &taxonomy).unwrap().unwrap();
    let classes: Vec<_> = read.detections.iter().map(|found| found.class).collect();
    assert_eq!(classes, [class("car"), class("truck"), None]);
    assert_eq!(read.detections[0].bounds.yaw, 0.0); // a quaternion of zeros is no turn
    assert_eq!((read.stamp_ns, read.frame_id.as_str()), (1_000_000_002, "lidar"));

    let two_frames = [("a", 1, CUBE, ADD, "left", ""), ("a", 2, CUBE, ADD, "right", "")];
    let error = marker_boxes(&old_markers(&two_frames), false, &taxonomy).unwrap_err();
    assert!(error.to_string().contains("`left` and `right`"), "{error}");
}

/// Writes a Detection3DArray: hypotheses and the side in x of each detection.
fn detections(found: &[(&[(&str, f64)], f64)]) -> Vec<u8> {
    let mut cdr = Vec::new();
    let mut w = RosWriter::new(Layout::Cdr(ByteOrder::Little), &mut cdr);
    w.i32(3);
    w.u32(4);
    w.string("lidar");
    w.length(found.len());
    for &(hypotheses, side) in found {
        w.i32(0);
        w.u32(0);
        w.string("");
        w.length(hypotheses.len());
        for &(class, score) in hypotheses {
            w.string(class);
            w.f64(score);
            [0.0; 7 + 36].into_iter().for_each(|value| w.f64(value));
        }
        // A quarter turn about the vertical.
        let pose = [1.0, 2.0, 3.0, 0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2, side, 2.0, 1.5];
        pose.into_iter().for_each(|value| w.f64(value));
        w.string("17");
    }
    cdr
}

#[test]
fn detections_by_name_and_by_id() {
    let taxonomy = Taxonomy::semantic_kitti();
    let cdr = detections(&[
        (&[("person", 0.2), ("Car", 0.7)], 4.0),
        (&[("252", 0.5)], 4.0),
        (&[], 1.0),
        (&[("traffic cone", 0.4)], 4.0),
    ]);
    let read = detection_boxes(&cdr, &taxonomy).unwrap();
    assert_eq!((read.stamp_ns, read.frame_id.as_str()), (3_000_000_004, "lidar"));
    let said: Vec<_> = read.detections.iter().map(|found| (found.class, found.score)).collect();
    assert_eq!(said, [(class("car"), 0.7), (class("car"), 0.5), (None, 1.0), (None, 0.4)]);
    let [long, wide] = [0, 2].map(|i| read.detections[i].bounds);
    assert_eq!((long.centre, long.size), ([1.0, 2.0, 3.0], [4.0, 2.0, 1.5]));
    assert!((long.yaw - FRAC_PI_2).abs() < 1e-12, "{long:?}");
    assert_eq!(wide.size, [2.0, 1.0, 1.5]);
    assert!(wide.yaw.abs() < 1e-9, "{wide:?}");
    for cut in 0..cdr.len() {
        assert!(detection_boxes(&cdr[..cut], &taxonomy).is_err(), "{cut}");
    }
    let nowhere = detection_boxes(&detections(&[(&[], f64::NAN)]), &taxonomy).unwrap_err();
    assert!(nowhere.to_string().contains("NaN"), "{nowhere}");
}
