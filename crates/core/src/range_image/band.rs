//! The rows of an image that one sensor made, and where that sensor stands.

use std::ops::Range;

use nalgebra::{Isometry3, Point3};

use super::evidence::Evidence;
use super::projection::Projection;

/// The rows of an image that one sensor made. An image has one band, but for a cloud merged of
/// several sensors: there they lie one below the other, and no pixel of one is a neighbour of
/// another's.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// The sensor's number in the cloud, where the cloud has such numbers.
    pub source: Option<u16>,
    /// Its rows of the image.
    pub rows: Range<usize>,
    /// How its rows were found.
    pub projection: Projection,
    /// Angle from one shot of a beam to the next, radians.
    pub column_step: f64,
    /// Pose of the sensor in the cloud's frame, metres: where its beams leave from, and the axis
    /// that they turn about as z. The identity unless the data says otherwise.
    pub sensor: Isometry3<f64>,
    /// How that is known.
    pub evidence: Evidence,
}

impl Band {
    /// Whether ranges and angles are those of the cloud's own frame.
    pub fn is_at_origin(&self) -> bool {
        self.sensor == Isometry3::identity()
    }

    /// A position of the cloud as seen from where the sensor stands, in the directions of the
    /// cloud's frame, metres.
    #[inline]
    pub fn from_sensor(&self, position: [f64; 3]) -> [f64; 3] {
        let origin = &self.sensor.translation.vector;
        [position[0] - origin.x, position[1] - origin.y, position[2] - origin.z]
    }

    /// A position of the cloud in the sensor's own frame, metres.
    pub fn in_sensor(&self, position: [f32; 3]) -> [f64; 3] {
        let position = position.map(f64::from);
        if self.is_at_origin() {
            return position;
        }
        self.sensor.inverse_transform_point(&Point3::from(position)).into()
    }
}

/// A return seen from elsewhere, in single precision: still a return, even where it lies at the new
/// origin or too far away for a number.
pub(super) fn as_return(position: [f64; 3]) -> [f32; 3] {
    let [x, y, z] = position.map(|along| (along as f32).clamp(f32::MIN, f32::MAX));
    if [x, y, z] == [0.0; 3] { [0.0, 0.0, f32::MIN_POSITIVE] } else { [x, y, z] }
}
