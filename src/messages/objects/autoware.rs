//! `autoware_perception_msgs/DetectedObjects`: a box with one of Autoware's classes for each
//! instance.

use nalgebra::Vector3;

use super::object_box::{ObjectBox, write_pose_with_covariance};
use crate::messages::ros::RosWriter;

const UNKNOWN: u8 = 0;
/// A rectangle's direction does not tell front from back, as that of what moves does.
const SIGN_UNKNOWN: u8 = 1;
const AVAILABLE: u8 = 2;
const BOUNDING_BOX: u8 = 0;

/// Writes a DetectedObjects message. That something is there is certain; what it is, is given as
/// one class with its probability, and as unknown with the rest.
pub(super) fn write(header: (i32, u32, &str), boxes: &[ObjectBox], writer: &mut RosWriter) {
    writer.header(header);
    writer.length(boxes.len());
    for boxed in boxes {
        writer.f32(1.0); // existence_probability
        write_classification(boxed, writer);
        write_kinematics(boxed, writer);
        writer.u8(BOUNDING_BOX);
        writer.length(0); // footprint
        writer.f64s(boxed.size);
    }
}

fn write_classification(boxed: &ObjectBox, writer: &mut RosWriter) {
    let label = label(&boxed.name);
    let rest = 1.0 - boxed.probability;
    let classes = match label {
        UNKNOWN => vec![(UNKNOWN, 1.0)],
        label if rest > 0.0 => vec![(label, boxed.probability), (UNKNOWN, rest)],
        label => vec![(label, 1.0)],
    };
    writer.length(classes.len());
    for (label, probability) in classes {
        writer.u8(label);
        writer.f32(probability as f32);
    }
}

/// Autoware's class for a name of SemanticKITTI's, nuScenes' or Autoware's own classes, or of a
/// coarse class. Of two that a coarse class may be it is the one whose motion fits both: TRUCK for
/// BUS, BICYCLE for MOTORCYCLE.
fn label(name: &str) -> u8 {
    let name = name.to_ascii_lowercase();
    let name = name.strip_prefix("moving-").unwrap_or(&name);
    match name {
        "car" | "vehicle-like" => 1,
        "truck" | "large-vehicle-like" => 2,
        "bus" | "bus_bendy" | "bus_rigid" => 3,
        "trailer" => 4,
        "motorcycle" | "motorcyclist" => 5,
        "bicycle" | "bicyclist" | "two-wheeler-like" => 6,
        "person" | "pedestrian" | "person-like" => 7,
        "animal" => 8,
        _ => UNKNOWN,
    }
}

fn write_kinematics(boxed: &ObjectBox, writer: &mut RosWriter) {
    write_pose_with_covariance(writer, &boxed.pose);
    writer.bool(false); // has_position_covariance
    let moving = boxed.velocity.filter(|velocity| velocity.is_moving);
    writer.u8(if moving.is_some() { AVAILABLE } else { SIGN_UNKNOWN });
    // The twist is that of the box in its own axes: ahead, to the left, up, and turns.
    let mut twist = [0.0; 6];
    let mut covariance = [0.0; 36];
    if let Some(velocity) = boxed.velocity {
        let own = boxed.pose.rotation.inverse() * Vector3::from(velocity.along);
        twist[..3].copy_from_slice(own.as_slice());
        for axis in 0..2 {
            covariance[axis * 7] = velocity.error.powi(2);
        }
    }
    writer.f64s(twist.into_iter().chain(covariance));
    let has_twist = boxed.velocity.is_some();
    writer.bool(has_twist);
    writer.bool(has_twist); // has_twist_covariance
}

#[cfg(test)]
mod tests {
    use super::super::tests::upright;
    use super::super::{ObjectEncoding, ObjectKind};
    use super::*;
    use crate::messages::ros::{ByteOrder, Layout, RosReader};

    /// Classes with their probabilities, and the size.
    type Object = (Vec<(u8, f32)>, [f64; 3]);

    fn read(cdr: &[u8]) -> Vec<Object> {
        let mut reader = RosReader::cdr("DetectedObjects", cdr).unwrap();
        assert_eq!(reader.header().unwrap(), (5, 6, "lidar".to_owned()));
        let r = &mut reader;
        let mut objects = Vec::new();
        for _ in 0..r.u32().unwrap() {
            assert_eq!(r.f32().unwrap(), 1.0);
            let count = r.u32().unwrap();
            let classes = (0..count).map(|_| (r.u8().unwrap(), r.f32().unwrap())).collect();
            assert_eq!([(); 3].map(|()| r.f64().unwrap()), [1.0, 2.0, 3.0]);
            r.bytes((4 + 36) * 8).unwrap();
            assert_eq!((r.bool().unwrap(), r.u8().unwrap()), (false, SIGN_UNKNOWN));
            assert!((0..6 + 36).all(|_| r.f64().unwrap() == 0.0));
            assert_eq!((r.bool().unwrap(), r.bool().unwrap()), (false, false));
            assert_eq!((r.u8().unwrap(), r.u32().unwrap()), (BOUNDING_BOX, 0));
            objects.push((classes, [(); 3].map(|()| r.f64().unwrap())));
        }
        assert_eq!(r.remaining(), 0);
        objects
    }

    #[test]
    fn classes_are_autoware_s_and_what_is_left_is_unknown() {
        let car = upright(1, [1.0, 2.0, 3.0], [4.0, 2.0, 1.5], 0.5);
        let named = |name: &str, probability| ObjectBox {
            name: name.to_owned(),
            probability,
            ..car.clone()
        };
        let boxes = [
            car.clone(),
            named("person-like", 0.75),
            named("structure", 0.9),
            named("two-wheeler-like", 0.5),
            named("large-vehicle-like", 0.5),
            named("", 0.0),
            named("moving-bus", 1.0),
        ];
        let mut message = Vec::new();
        let encoding = ObjectEncoding::Ros(Layout::Cdr(ByteOrder::Big));
        ObjectKind::Autoware.write(encoding, (5, 6, "lidar"), &boxes, &mut message).unwrap();
        let objects = read(&message);
        assert!(objects.iter().all(|(_, size)| *size == [4.0, 2.0, 1.5]));
        let classes: Vec<_> = objects.into_iter().map(|(classes, _)| classes).collect();
        let unknown = vec![(UNKNOWN, 1.0)];
        let person = vec![(7, 0.75), (UNKNOWN, 0.25)];
        let [bicycle, truck] = [6, 2].map(|label| vec![(label, 0.5), (UNKNOWN, 0.5)]);
        let [car, bus] = [1, 3].map(|label| vec![(label, 1.0)]);
        assert_eq!(classes, [car, person, unknown.clone(), bicycle, truck, unknown, bus]);
    }
}
