//! One instance as messages of objects show it, and how a box is drawn in all of them.

use std::f64::consts::PI;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::messages::palette::{BACKGROUND_COLOUR, instance_colour};
use crate::messages::ros::RosWriter;
use divmerge_core::cloud::{Classification, CoarseClass, Instance};
use divmerge_core::over_time::ObjectVelocity;

/// Opacity of a box.
pub(super) const BOX_ALPHA: f32 = 0.35;
/// Shortest side of a drawn box in metres; a flat box would not be seen.
pub(super) const SHORTEST_SIDE: f64 = 0.05;
/// Height of the letters in metres.
pub(super) const TEXT_HEIGHT: f64 = 0.4;

/// One instance as messages show it.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectBox {
    /// Instance or track, which gives the box its id and, if it is an object, its colour.
    pub id: u32,
    /// Whether that is a track.
    pub is_track: bool,
    /// How it moves in the coordinate frame of the message, in its unit; of a track.
    pub velocity: Option<ObjectVelocity>,
    /// From the box's own axes (x along the length, y along the width, z along the height, origin
    /// in the centre) to the coordinate frame of the message, in its unit.
    pub pose: Isometry3<f64>,
    /// Length, width and height in the unit of the message's frame.
    pub size: [f64; 3],
    /// Class in the recording's own ids, 0 without classes.
    pub class: u16,
    /// Name of the class or of the coarse class; empty where nothing is known.
    pub name: String,
    /// How likely that is, 0 to 1; 1 for a class of the recording.
    pub probability: f64,
    /// What is written above the box.
    pub title: String,
    /// Points in it.
    pub points: u32,
    /// Whether it is an object; background is drawn grey.
    pub is_object: bool,
}

impl ObjectBox {
    /// An instance's box. `frame` takes the sensor frame to the coordinate frame of the message,
    /// whose unit there are `per_metre` of to a metre.
    pub fn of(instance: &Instance, per_metre: f64, frame: &Isometry3<f64>) -> Self {
        let mut bounds = instance.bounds;
        bounds.centre = bounds.centre.map(|along| along * per_metre);
        bounds.size = bounds.size.map(|along| along * per_metre);
        let (name, probability) = match instance.coarse_class {
            Some(Classification { class: CoarseClass::Unknown, .. }) => ("", 0.0),
            Some(Classification { class, probability, .. }) => (class.name(), probability),
            None => (instance.class_name.as_str(), instance.confidence.unwrap_or(1.0)),
        };
        ObjectBox {
            id: instance.id,
            is_track: false,
            velocity: None,
            pose: frame * bounds.pose(),
            size: bounds.size,
            class: instance.semantic,
            name: name.to_owned(),
            probability,
            title: instance.title(),
            points: instance.points,
            is_object: instance.is_object(),
        }
    }

    /// The same as that of a track, with what is known of how it moves in the sensor frame. Where
    /// it moves, the box's x axis points ahead.
    pub fn of_track(
        self,
        velocity: Option<&ObjectVelocity>,
        per_metre: f64,
        frame: &Isometry3<f64>,
    ) -> Self {
        let velocity = velocity.map(|velocity| ObjectVelocity {
            along: (frame.rotation * Vector3::from(velocity.along) * per_metre).into(),
            error: velocity.error * per_metre,
            is_moving: velocity.is_moving,
        });
        let mut pose = self.pose;
        let ahead = pose.rotation * Vector3::x();
        let is_moving = |velocity: &ObjectVelocity| velocity.is_moving;
        if let Some(velocity) = velocity.filter(is_moving)
            && ahead.dot(&Vector3::from(velocity.along)) < 0.0
        {
            let about = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI);
            pose.rotation *= about;
        }
        ObjectBox { is_track: true, velocity, pose, ..self }
    }

    /// Red, green and blue of the box, 0 to 1.
    pub(super) fn colour(&self) -> [f32; 3] {
        let colour = if self.is_object { instance_colour(self.id) } else { BACKGROUND_COLOUR };
        colour.map(|value| f32::from(value) / 255.0)
    }

    /// Where the text of a box stands: above its middle.
    pub(super) fn above(&self) -> [f64; 3] {
        let up = self.size[2] / 2.0 + TEXT_HEIGHT;
        let nalgebra::Point3 { coords } = self.pose * nalgebra::Point3::new(0.0, 0.0, up);
        coords.into()
    }
}

/// Appends a `geometry_msgs/Pose`.
pub(super) fn write_pose(writer: &mut RosWriter, pose: &Isometry3<f64>) {
    let rotation = pose.rotation.coords; // x, y, z, w
    // Never -0, which turning boxes back makes of zeros.
    writer.f64s(pose.translation.vector.iter().chain(rotation.iter()).map(|value| value + 0.0));
}

/// Appends a `geometry_msgs/PoseWithCovariance` of unknown covariance.
pub(super) fn write_pose_with_covariance(writer: &mut RosWriter, pose: &Isometry3<f64>) {
    write_pose(writer, pose);
    writer.f64s([0.0; 36]);
}
