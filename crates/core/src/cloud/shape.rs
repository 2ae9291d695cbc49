//! The coarse class of an instance by its shape: vehicle, person, pole, structure or vegetation, by
//! size, thickness and roughness.
//!
//! Each class has a score between 0 and 1, a product of soft limits (logistic curves) on what can
//! be measured; the scores and a constant for "none of these", divided by their sum, are the
//! probabilities. Limits come from what the classes are; the functions below give them:
//!
//! - vehicle: car to bus, or a face of one: 1.2 to 12 m long, up to 2.9 m wide (the 2.55 m that a
//!   bus may be, and mirrors), 0.5 to 3.8 m high and no higher than its length allows, standing on
//!   the ground, smooth;
//! - person: upright, 1.2 to 2.05 m tall, within 1.1 m by 0.9 m (arms and stride), standing on the
//!   ground;
//! - pole: upright and thin: to 0.6 m across and taller than people, or to 0.3 m and 0.5 m tall;
//! - structure: smooth, and flat or larger than a vehicle; longer than 4 m or reaching higher than
//!   2.3 m: buildings, walls, fences;
//! - vegetation: rough: leaves, branches.
//!
//! One limit was taken from labelled drives, the roughness of leaves. The probability says how far
//! the measures are inside the limits of one class alone. It is not calibrated.
//!
//! The measure that tells leaves from walls is *roughness*: by how much the range of a pixel
//! departs from the mean of its neighbours in the row, half of them by more. Along a smooth
//! surface, however slanted, it is the noise of the sensor (2 cm); beams into leaves stop at depths
//! of their own.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use serde::{Deserialize, Serialize};

use super::coarse_class::{Body, CoarseClass};
use super::upright_box::UprightBox;
use crate::geometry::statistics::median_by;

/// The coarse class of an instance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Classification {
    /// The class.
    #[serde(rename = "kind")]
    pub class: CoarseClass,
    /// Its probability, 0 to 1.
    pub probability: f64,
    /// What was measured.
    pub measures: ShapeMeasures,
}

/// The likeliest coarse class of a shape.
pub fn classify_shape(measures: ShapeMeasures) -> Classification {
    likeliest(measures, |_| true)
}

/// The likeliest coarse class of a shape that is known to be no object: neither a vehicle nor a
/// person.
pub fn classify_background(measures: ShapeMeasures) -> Classification {
    likeliest(measures, |class| !class.is_object())
}

fn likeliest(measures: ShapeMeasures, is_possible: impl Fn(CoarseClass) -> bool) -> Classification {
    let scores = measures.scores();
    let possible = || scores.iter().filter(|(class, _)| is_possible(*class));
    let total: f64 = possible().map(|(_, score)| score).sum();
    let none = (CoarseClass::Unknown, 0.0);
    let (class, score) =
        possible().fold(none, |best, next| if next.1 > best.1 { *next } else { best });
    Classification { class, probability: score / total, measures }
}

/// What is measured on an instance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ShapeMeasures {
    /// Number of its points.
    pub points: usize,
    /// Length, width and height of its upright box, metres.
    pub size: [f64; 3],
    /// Height of its lowest and of its highest point above the ground, metres, where there is
    /// ground nearby.
    pub above_ground: Option<[f64; 2]>,
    /// Standard deviation along its thinnest direction, metres.
    pub thickness: f64,
    /// Median departure of a pixel's range from the mean of its neighbours in the row, metres,
    /// where there are such.
    pub roughness: Option<f64>,
}

impl ShapeMeasures {
    /// The measures of points in metres, given their box, the height of the ground below them (in
    /// the sensor's frame) and the departures of their ranges.
    pub fn new(
        positions: &[[f64; 3]],
        bounds: &UprightBox,
        ground: Option<f64>,
        departures: &mut [f32],
    ) -> Self {
        let [low, high] = [-0.5, 0.5].map(|half| bounds.centre[2] + half * bounds.size[2]);
        ShapeMeasures {
            points: positions.len(),
            size: bounds.size,
            above_ground: ground.map(|ground| [low - ground, high - ground]),
            thickness: thickness(positions),
            roughness: roughness(departures),
        }
    }

    /// A score for each class that a shape may tell.
    fn scores(&self) -> [(CoarseClass, f64); 6] {
        const NONE_OF_THESE: f64 = 0.1;
        let seen = above(self.points as f64, 8.0, 2.0);
        [
            (CoarseClass::Body(Body::Car), seen * self.vehicle()),
            (CoarseClass::Body(Body::Person), seen * self.person()),
            (CoarseClass::Pole, seen * self.pole()),
            (CoarseClass::Structure, seen * self.structure()),
            (CoarseClass::Vegetation, seen * self.leaves()),
            (CoarseClass::Unknown, NONE_OF_THESE),
        ]
    }

    /// Height of the highest point above the ground, or the height of the box where there is no
    /// ground.
    fn top(&self) -> f64 {
        self.above_ground.map_or(self.size[2], |[_, top]| top)
    }

    /// Whether it reaches down to that height above the ground, metres.
    fn stands(&self, at: f64) -> f64 {
        self.above_ground.map_or(1.0, |[bottom, _]| below(bottom, at, 0.12))
    }

    /// Height to length; a single point is not slender.
    fn slenderness(&self) -> f64 {
        const THINNEST: f64 = 0.01;
        self.size[2] / self.size[0].max(THINNEST)
    }

    /// Whether its range is rougher than that, metres. Roughness is judged by ratios, and where it
    /// could not be measured most things are smooth.
    fn rougher(&self, at: f64) -> f64 {
        const UNMEASURED: f64 = 0.35;
        self.roughness.map_or(UNMEASURED, |roughness| above((roughness / at).ln(), 0.0, 0.2))
    }

    /// Whether it is smoother than leaves, 0 to 1.
    pub fn smoothness(&self) -> f64 {
        1.0 - self.rougher(LEAVES)
    }

    fn vehicle(&self) -> f64 {
        let [length, width, height] = self.size;
        // A face alone, seen from the side, is no longer than a car.
        let face = below(width, 0.3, 0.05);
        let longest = 12.0 - 6.5 * face;
        // What is as high as a van is as long as one; the back of a car is 1.8 m wide.
        let highest = (0.9 * length + 0.6).min(3.8);
        above(length, 1.2, 0.15)
            * below(length, longest, 0.4)
            * below(width, 2.9, 0.15)
            * above(height, 0.5, 0.1)
            * below(self.top(), highest, 0.2)
            * self.stands(0.9)
            * self.smoothness()
    }

    fn person(&self) -> f64 {
        let [length, width, _] = self.size;
        below(length, 1.1, 0.08)
            * below(width, 0.9, 0.08)
            * above(length, 0.25, 0.04)
            * above(self.top(), 1.2, 0.08)
            * below(self.top(), 2.05, 0.06)
            * above(self.slenderness(), 1.3, 0.12)
            * self.stands(0.6)
            * (1.0 - self.rougher(2.0 * LEAVES)) // clothes and limbs are round
    }

    fn pole(&self) -> f64 {
        let [length, _, height] = self.size;
        let tall = below(length, 0.6, 0.06) * above(self.top(), 2.1, 0.06);
        let thin = below(length, 0.3, 0.03) * above(height, 0.5, 0.06);
        tall.max(thin) * above(self.slenderness(), 2.0, 0.2)
    }

    fn structure(&self) -> f64 {
        let [length, _, height] = self.size;
        let flat = below(self.thickness, 0.25, 0.05);
        let higher_than_vehicles = above(self.top(), 3.8, 0.25);
        let longer_than_vehicles = above(length, 12.0, 1.0);
        let surface = flat.max(higher_than_vehicles);
        let long =
            above(length, 4.0, 0.4) * above(height, 0.5, 0.1) * surface.max(longer_than_vehicles);
        let high = above(length, 1.0, 0.1) * above(self.top(), 2.3, 0.15) * surface;
        long.max(high) * self.smoothness()
    }

    fn leaves(&self) -> f64 {
        self.rougher(LEAVES) * above(self.size[0], 0.5, 0.08)
    }
}

/// Roughness that parts leaves from surfaces, metres: nine in ten cars of labelled drives measure
/// less than 0.034, half of the vegetation more than 0.1, one in ten less than 0.031.
const LEAVES: f64 = 0.042;

/// Goes from 0 to 1 at a value, over about four widths.
fn above(x: f64, at: f64, width: f64) -> f64 {
    1.0 / (1.0 + ((at - x) / width).exp())
}

fn below(x: f64, at: f64, width: f64) -> f64 {
    above(-x, -at, width)
}

/// Standard deviation of points along the direction in which it is least, metres.
fn thickness(positions: &[[f64; 3]]) -> f64 {
    let count = positions.len().max(1) as f64;
    let mean = positions.iter().map(|&p| Vector3::from(p)).sum::<Vector3<f64>>() / count;
    let spread = |p: &[f64; 3]| {
        let from_mean = Vector3::from(*p) - mean;
        from_mean * from_mean.transpose()
    };
    let covariance = positions.iter().map(spread).sum::<Matrix3<f64>>() / count;
    SymmetricEigen::new(covariance).eigenvalues.min().max(0.0).sqrt()
}

/// The median departure in metres; `None` of too few.
fn roughness(departures: &mut [f32]) -> Option<f64> {
    const FEW: usize = 5;
    let is_enough = departures.len() >= FEW;
    is_enough.then(|| median_by(departures, f32::total_cmp)).flatten().map(f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ShapeMeasures of something that stands on the ground.
    fn standing(size: [f64; 3], thickness: f64, roughness: f64) -> ShapeMeasures {
        ShapeMeasures {
            points: 200,
            size,
            above_ground: Some([0.1, 0.1 + size[2]]),
            thickness,
            roughness: Some(roughness),
        }
    }

    fn class(measures: ShapeMeasures) -> CoarseClass {
        let found = classify_shape(measures);
        assert!(found.probability > 0.5 && found.probability <= 1.0, "{found:?} of {measures:?}");
        found.class
    }

    #[test]
    fn things_of_usual_size() {
        assert_eq!(class(standing([4.6, 1.9, 1.4], 0.4, 0.012)), CoarseClass::Body(Body::Car));
        assert_eq!(class(standing([1.8, 0.3, 1.3], 0.1, 0.012)), CoarseClass::Body(Body::Car));
        assert_eq!(class(standing([0.7, 0.5, 1.65], 0.1, 0.02)), CoarseClass::Body(Body::Person));
        assert_eq!(class(standing([0.2, 0.15, 5.5], 0.05, 0.01)), CoarseClass::Pole);
        assert_eq!(class(standing([0.2, 0.2, 0.8], 0.05, 0.01)), CoarseClass::Pole);
        assert_eq!(class(standing([15.0, 0.8, 6.0], 0.2, 0.012)), CoarseClass::Structure);
        assert_eq!(class(standing([8.0, 0.2, 1.6], 0.05, 0.012)), CoarseClass::Structure);
        assert_eq!(class(standing([3.0, 2.0, 1.5], 0.5, 0.12)), CoarseClass::Vegetation);
    }

    #[test]
    fn background_is_neither_a_vehicle_nor_a_person() {
        let of = |measures| classify_background(measures).class;
        assert_eq!(of(standing([4.6, 1.9, 1.4], 0.4, 0.012)), CoarseClass::Unknown);
        assert_eq!(of(standing([15.0, 0.8, 6.0], 0.2, 0.012)), CoarseClass::Structure);
        assert_eq!(of(standing([3.0, 2.0, 1.5], 0.5, 0.12)), CoarseClass::Vegetation);
        let [pole, wall] = [[0.2, 0.2, 0.8], [4.5, 0.2, 1.6]];
        for measures in [standing(pole, 0.05, 0.01), standing(wall, 0.05, 0.012)] {
            let found = classify_background(measures);
            assert!(found.probability >= classify_shape(measures).probability, "{found:?}");
        }
    }

    #[test]
    fn few_points_tell_nothing() {
        let few = ShapeMeasures { points: 3, ..standing([4.6, 1.9, 1.4], 0.4, 0.012) };
        assert_eq!(classify_shape(few).class, CoarseClass::Unknown);
        let one = ShapeMeasures { points: 1, roughness: None, ..standing([0.0; 3], 0.0, 0.0) };
        assert_eq!(classify_shape(one).class, CoarseClass::Unknown);
        assert!(classify_shape(one).probability > 0.9, "{:?}", classify_shape(one));
    }

    #[test]
    fn what_floats_is_no_person() {
        let mut floating = standing([0.7, 0.5, 1.2], 0.1, 0.02);
        assert_eq!(classify_shape(floating).class, CoarseClass::Body(Body::Person));
        floating.above_ground = Some([3.0, 4.2]);
        assert_ne!(classify_shape(floating).class, CoarseClass::Body(Body::Person));
        floating.above_ground = None;
        assert_eq!(classify_shape(floating).class, CoarseClass::Body(Body::Person));
    }

    #[test]
    fn thickness_of_a_plane_and_of_a_cube() {
        let grid = |k: usize| [(k % 3) as f64, (k / 3 % 3) as f64, (k / 9) as f64];
        let cube: Vec<_> = (0..27).map(grid).collect();
        assert!((thickness(&cube) - (2.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!(thickness(&cube[..9]) < 1e-9);
        assert_eq!(thickness(&[]), 0.0);
    }

    #[test]
    fn soft_limits() {
        assert_eq!(above(1.0, 1.0, 0.1), 0.5);
        assert!(above(1.3, 1.0, 0.1) > 0.95 && below(1.3, 1.0, 0.1) < 0.05);
    }
}
