//! What comes out: a reason or an instance for every point, and the instances themselves.

use serde::{Deserialize, Serialize};

use super::coarse_class::CoarseClass;
use super::shape::Classification;
use super::upright_box::UprightBox;

/// Why a point has no instance. The numbers are those of the field `reason` in an annotated cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum Reason {
    /// It has an instance.
    None = 0,
    /// The beam came back with nothing: NaN, infinite, at the origin, or a fill value
    /// ([`PointCloud::without_fill_values`](super::PointCloud::without_fill_values)).
    NoReturn = 1,
    /// Its class is no thing, or the taxonomy does not know it.
    NotAnObject = 2,
    /// Ground, by geometry.
    Ground = 3,
    /// Hidden behind another point of its pixel, and no pixel of its class nearby to take a label
    /// from.
    Shadowed = 4,
    /// An object pixel that no seed reached.
    Unreached = 5,
    /// Its instance had fewer pixels than the minimum.
    TooSmall = 6,
    /// Left out on purpose: too near, too far, outside the region, or of the vehicle itself.
    Cropped = 7,
    /// Of a group of too few pixels to be an instance, where there are no classes.
    Scattered = 8,
}

impl Reason {
    /// All reasons in the order of their numbers.
    pub const ALL: [Reason; 9] = [
        Reason::None,
        Reason::NoReturn,
        Reason::NotAnObject,
        Reason::Ground,
        Reason::Shadowed,
        Reason::Unreached,
        Reason::TooSmall,
        Reason::Cropped,
        Reason::Scattered,
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
            Reason::Cropped => "cropped",
            Reason::Scattered => "scattered",
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Instance {
    /// Id from 1, as in [`PointLabels::instance`].
    pub id: u32,
    /// Class in the recording's ids, 0 where there are no classes.
    pub semantic: u16,
    /// Name of the class, empty where there are no classes.
    pub class_name: String,
    /// Mean over its points of the confidence in that class, 0 where a point has another; `None`
    /// where classes come without any.
    pub confidence: Option<f64>,
    /// Its coarse class, where there are no classes.
    #[serde(rename = "likeness")]
    pub coarse_class: Option<Classification>,
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
        match self.coarse_class {
            Some(Classification { class: CoarseClass::Unknown, .. }) => self.id.to_string(),
            Some(Classification { class, probability, .. }) => {
                format!("{} {} {}", self.id, class.name(), percent(probability))
            }
            None => format!("{} {}", self.id, self.class_name).trim_end().to_owned(),
        }
    }

    /// Whether it is an object: all are where there are classes, else those with the coarse class
    /// of one.
    pub fn is_object(&self) -> bool {
        self.coarse_class.is_none_or(|found| found.class.is_object())
    }
}

/// A probability for people, as in `83 %`; never 0.
fn percent(probability: f64) -> String {
    match probability < 0.01 {
        true => "<1 %".to_owned(),
        false => format!("{:.0} %", probability * 100.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_probability_in_percent_is_never_0() {
        assert_eq!([0.002, 0.01, 0.834, 1.0].map(percent), ["<1 %", "1 %", "83 %", "100 %"]);
    }
}
