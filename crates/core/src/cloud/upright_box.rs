//! Upright boxes, of instances and of detectors.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::point_cloud::{PointCloud, wide};
use crate::geometry::footprint::{Rectangle, convex_hull, minimum_area_rectangle};

/// A box that stands upright: the minimum-area rectangle on the bird's-eye plane and a height.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UprightBox {
    /// Centre in metres, sensor frame.
    pub centre: [f64; 3],
    /// Length, width, height in metres; length is the longer horizontal side.
    pub size: [f64; 3],
    /// Direction of the length in radians from the x axis, in (-pi/2, pi/2].
    pub yaw: f64,
}

impl UprightBox {
    /// The box of a centre, the sides along `yaw` (radians), across it and upwards, all in metres.
    pub fn new(centre: [f64; 3], [along, across, height]: [f64; 3], yaw: f64) -> Self {
        let plane = Rectangle::new([centre[0], centre[1]], [along, across], yaw);
        UprightBox { centre, size: [plane.size[0], plane.size[1], height], yaw: plane.yaw }
    }

    /// From the box's own axes (x along the length, y along the width, z along the height, origin
    /// in the centre; metres) to the sensor frame.
    pub fn pose(&self) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw);
        Isometry3::from_parts(Translation3::from(self.centre), turn)
    }

    /// The same grown so that it holds what lies from `low` to `high` along its length, its width
    /// and its height, metres from the origin.
    pub fn holding(&self, low: [f64; 3], high: [f64; 3]) -> Self {
        let axes = self.axes();
        let mut centre = Vector3::zeros();
        let mut size = [0.0; 3];
        for (number, axis) in axes.iter().enumerate() {
            let (at, half) = (axis.dot(&Vector3::from(self.centre)), self.size[number] / 2.0);
            let (least, most) = (low[number].min(at - half), high[number].max(at + half));
            centre += axis * ((least + most) / 2.0);
            size[number] = most - least;
        }
        UprightBox::new(centre.into(), size, self.yaw)
    }

    /// The directions of its length, its width and its height.
    pub fn axes(&self) -> [Vector3<f64>; 3] {
        let (sin, cos) = self.yaw.sin_cos();
        [Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0), Vector3::z()]
    }

    /// The box around some points of a cloud. `None` of no points.
    pub fn around(cloud: &PointCloud, points: &[u32]) -> Option<Self> {
        let positions = points.iter().map(|&p| wide(cloud.position(p as usize)));
        let plane: Vec<[f64; 2]> = positions.clone().map(|[x, y, _]| [x, y]).collect();
        let rectangle = minimum_area_rectangle(&convex_hull(&plane))?;
        let (low, high) = positions.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
            (low.min(p[2]), high.max(p[2]))
        });
        Some(UprightBox {
            centre: [rectangle.centre[0], rectangle.centre[1], (low + high) / 2.0],
            size: [rectangle.size[0], rectangle.size[1], high - low],
            yaw: rectangle.yaw,
        })
    }
}

/// An object as a detector has it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Detection {
    /// Its box, in metres, sensor frame.
    pub bounds: UprightBox,
    /// Its class number; `None`: any.
    pub class: Option<u16>,
    /// How sure the detector is.
    pub score: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn a_box_is_longer_than_wide_and_its_yaw_in_half_a_turn() {
        let of = |size, yaw| {
            let made = UprightBox::new([1.0, 2.0, 3.0], size, yaw);
            assert_eq!(made.centre, [1.0, 2.0, 3.0]);
            (made.size, (made.yaw * 1e9).round() / 1e9)
        };
        let rounded = |yaw: f64| (yaw * 1e9).round() / 1e9;
        assert_eq!(of([4.0, 2.0, 1.5], 0.3), ([4.0, 2.0, 1.5], 0.3));
        assert_eq!(of([2.0, 4.0, 1.5], 0.3), ([4.0, 2.0, 1.5], rounded(0.3 - FRAC_PI_2)));
        assert_eq!(of([4.0, 2.0, 1.5], 0.3 - PI), ([4.0, 2.0, 1.5], 0.3));
        assert_eq!(of([4.0, 2.0, 1.5], -FRAC_PI_2), ([4.0, 2.0, 1.5], rounded(FRAC_PI_2)));
    }
}
