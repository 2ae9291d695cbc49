//! `vision_msgs/Detection3DArray`: a box with a class for each instance.

use super::object_box::{ObjectBox, write_pose, write_pose_with_covariance};
use crate::messages::ros::{Layout, RosWriter};

/// Writes a Detection3DArray: as vision_msgs has it since version 4 (Humble) in ROS 2, as version 0
/// (Noetic) in ROS 1.
///
/// A box of which nothing is known has no hypothesis. In ROS 2 a class is its name, and the
/// detection's id the number of the instance; ROS 1 has numbers for classes and no ids, and its
/// copy of the object's points is left empty.
pub(super) fn write(
    layout: Layout,
    header: (i32, u32, &str),
    boxes: &[ObjectBox],
    writer: &mut RosWriter,
) {
    writer.header(header);
    writer.length(boxes.len());
    for boxed in boxes {
        writer.header(header);
        write_hypotheses(layout, boxed, writer);
        write_pose(writer, &boxed.pose);
        writer.f64s(boxed.size);
        match layout {
            Layout::Cdr(_) => writer.string(&boxed.id.to_string()),
            Layout::Ros1 => write_no_cloud(writer, header),
        }
    }
}

fn write_hypotheses(layout: Layout, boxed: &ObjectBox, writer: &mut RosWriter) {
    if boxed.name.is_empty() {
        return writer.length(0);
    }
    writer.length(1);
    match layout {
        Layout::Cdr(_) => writer.string(&boxed.name),
        Layout::Ros1 => {
            writer.u32(u32::from(boxed.class));
            writer.u32(0); // upper half of the 64 bits
        }
    }
    writer.f64(boxed.probability);
    write_pose_with_covariance(writer, &boxed.pose);
}

/// A PointCloud2 of no points.
fn write_no_cloud(writer: &mut RosWriter, header: (i32, u32, &str)) {
    writer.header(header);
    writer.u32(0); // height
    writer.u32(0); // width
    writer.length(0); // fields
    writer.bool(false); // is_bigendian
    writer.u32(0); // point_step
    writer.u32(0); // row_step
    writer.length(0); // data
    writer.bool(true); // is_dense
}

#[cfg(test)]
mod tests {
    use super::super::tests::upright;
    use super::super::{ObjectEncoding, ObjectKind};
    use super::*;
    use crate::messages::boxes::detection_boxes;
    use crate::messages::ros::{ByteOrder, RosReader};
    use divmerge_core::cloud::taxonomy::Taxonomy;

    #[test]
    fn boxes_come_back_with_their_classes() {
        let known = upright(7, [1.0, 2.0, 3.0], [4.0, 2.0, 1.5], 0.5);
        let unknown = ObjectBox { name: String::new(), class: 0, ..known.clone() };
        for order in [ByteOrder::Little, ByteOrder::Big] {
            let mut message = Vec::new();
            let encoding = ObjectEncoding::Ros(Layout::Cdr(order));
            ObjectKind::Detection3d
                .write(encoding, (5, 6, "lidar"), &[known.clone(), unknown.clone()], &mut message)
                .unwrap();
            let taxonomy = Taxonomy::semantic_kitti();
            let read = detection_boxes(&message, &taxonomy).unwrap();
            assert_eq!((read.stamp_ns, read.frame_id.as_str()), (5_000_000_006, "lidar"));
            let classes: Vec<_> = read.detections.iter().map(|found| found.class).collect();
            assert_eq!(classes, [taxonomy.class_called("car"), None]);
            let bounds = read.detections[0].bounds;
            assert_eq!((bounds.centre, bounds.size), ([1.0, 2.0, 3.0], [4.0, 2.0, 1.5]));
            assert!((bounds.yaw - 0.5).abs() < 1e-12);
        }
    }

    #[test]
    fn ros_1_has_numbers_for_classes() {
        let mut message = Vec::new();
        let encoding = ObjectEncoding::Ros(Layout::Ros1);
        let boxed = upright(7, [1.0, 2.0, 3.0], [4.0, 2.0, 1.5], 0.0);
        ObjectKind::Detection3d.write(encoding, (5, 6, "lidar"), &[boxed], &mut message).unwrap();
        let mut reader = RosReader::ros1("Detection3DArray", &message);
        assert_eq!(reader.header().unwrap(), (5, 6, "lidar".to_owned()));
        assert_eq!(reader.u32().unwrap(), 1);
        reader.header().unwrap();
        assert_eq!(reader.u32().unwrap(), 1);
        assert_eq!((reader.u32().unwrap(), reader.u32().unwrap()), (10, 0));
        assert_eq!(reader.f64().unwrap(), 1.0);
        reader.bytes((7 + 36) * 8).unwrap();
        assert_eq!(reader.f64().unwrap(), 1.0);
        reader.bytes(6 * 8).unwrap();
        assert_eq!([(); 3].map(|()| reader.f64().unwrap()), [4.0, 2.0, 1.5]);
        reader.header().unwrap();
        reader.bytes(4 + 4 + 4 + 1 + 4 + 4 + 4 + 1).unwrap();
        assert_eq!(reader.remaining(), 0);
    }
}
