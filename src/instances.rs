//! What comes out: a reason or an instance for every point, and the instances themselves.

pub mod likeness;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde::Serialize;

use crate::cloud::{PointCloud, wide};
use crate::footprint::{Rectangle, convex_hull, minimum_area_rectangle};

use likeness::Kind;
pub use likeness::Likeness;

/// Why a point has no instance. The numbers are those of the field `reason` in an annotated cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum Reason {
    /// It has an instance.
    None = 0,
    /// The beam came back with nothing: NaN, infinite, or at the origin.
    NoReturn = 1,
    /// Its class is no thing, or the taxonomy does not know it.
    NotAnObject = 2,
    /// Ground, by geometry.
    Ground = 3,
    /// Hidden behind another point of its pixel, and no pixel of its class nearby to take a label from.
    Shadowed = 4,
    /// An object pixel that no seed reached.
    Unreached = 5,
    /// Its instance had fewer pixels than the minimum.
    TooSmall = 6,
}

impl Reason {
    /// All reasons in the order of their numbers.
    pub const ALL: [Reason; 7] = [
        Reason::None,
        Reason::NoReturn,
        Reason::NotAnObject,
        Reason::Ground,
        Reason::Shadowed,
        Reason::Unreached,
        Reason::TooSmall,
    ];

    /// A few words for people; "instance" for points that have one.
    pub fn describe(self) -> &'static str {
        match self {
            Reason::None => "instance",
            Reason::NoReturn => "no return",
            Reason::NotAnObject => "not an object",
            Reason::Ground => "ground",
            Reason::Shadowed => "shadowed without a match",
            Reason::Unreached => "unreached",
            Reason::TooSmall => "too small",
        }
    }
}

/// One verdict per point; all columns have length N.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct PointLabels {
    /// Instance from 1, or 0 with a reason.
    pub instance: Vec<u32>,
    /// Local component before the merge, from 1, or 0.
    pub component: Vec<u32>,
    /// Class of the point's instance (majority vote), else its own, in the recording's ids; 0 where
    /// there are no classes.
    pub semantic: Vec<u16>,
    /// Why there is no instance.
    pub reason: Vec<Reason>,
}

impl PointLabels {
    /// Points per reason, in the order of [`Reason::ALL`].
    pub fn counts(&self) -> [u64; Reason::ALL.len()] {
        let mut counts = [0; Reason::ALL.len()];
        for &reason in &self.reason {
            counts[reason as usize] += 1;
        }
        counts
    }
}

/// One instance of a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Instance {
    /// Id from 1, as in [`PointLabels::instance`].
    pub id: u32,
    /// Class in the recording's ids, 0 where there are no classes.
    pub semantic: u16,
    /// Name of the class, empty where there are no classes.
    pub class_name: String,
    /// Mean over its points of the confidence in that class, 0 where a point has another; `None` where classes come
    /// without any.
    pub confidence: Option<f64>,
    /// What it looks like, where there are no classes.
    pub likeness: Option<Likeness>,
    /// Number of its points.
    pub points: u32,
    /// Number of its pixels.
    pub pixels: u32,
    /// Number of local components it was merged from.
    pub components: u32,
    /// Its box.
    pub bounds: UprightBox,
}

impl Instance {
    /// Its number and what is known of it, as in `12 car` or `12 vehicle-like 83 %`.
    pub fn title(&self) -> String {
        match self.likeness {
            Some(Likeness { kind: Kind::Unknown, .. }) => self.id.to_string(),
            Some(Likeness { kind, probability, .. }) => {
                format!("{} {} {:.0} %", self.id, kind.name(), probability * 100.0)
            }
            None => format!("{} {}", self.id, self.class_name).trim_end().to_owned(),
        }
    }
}

/// A box that stands upright: the minimum-area rectangle on the bird's-eye plane and a height.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
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

    /// From the box's own axes (x along the length, y along the width, z along the height, origin in the centre;
    /// metres) to the sensor frame.
    pub fn pose(&self) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw);
        Isometry3::from_parts(Translation3::from(self.centre), turn)
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
