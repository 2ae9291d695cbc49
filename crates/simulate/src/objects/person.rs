//! People: a few capsules and ellipsoids each.

use rand::RngExt;
use rand_pcg::Pcg32;

use super::{Model, Parts};
use crate::material::Material;
use crate::shapes::Shape;

/// A body, standing or in mid-stride.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Person {
    /// Stature in metres.
    pub stature: f64,
    /// Breadth relative to the ordinary.
    pub breadth: f64,
    pub has_backpack: bool,
    /// Phase of the step at time 0, radians.
    pub phase: f64,
}

/// Steps of a walker, in radians of phase per second.
const CADENCE: f64 = std::f64::consts::TAU * 0.9;

impl Person {
    pub fn random(rng: &mut Pcg32) -> Self {
        Person {
            stature: rng.random_range(1.55..1.92),
            breadth: rng.random_range(0.92..1.12),
            has_backpack: rng.random_bool(0.25),
            phase: rng.random_range(0.0..std::f64::consts::TAU),
        }
    }

    /// Half of the room that the body takes from side to side, metres.
    pub fn half_width(&self) -> f64 {
        0.27 * self.scale() * self.breadth
    }

    fn scale(&self) -> f64 {
        self.stature / 1.75
    }

    /// The body standing still.
    pub fn standing(&self, class: u16) -> Model {
        self.model(class, 0.06)
    }

    /// The body walking, `time` in seconds.
    pub fn walking(&self, class: u16, time: f64) -> Model {
        self.model(class, 0.34 * (CADENCE * time + self.phase).sin())
    }

    /// `swing` is how far the left foot is ahead of the hip, metres at ordinary stature.
    fn model(&self, class: u16, swing: f64) -> Model {
        let (tall, wide) = (self.scale(), self.scale() * self.breadth);
        let at = |x: f64, y: f64, z: f64| [x * tall, y * wide, z * tall];
        let mut body = Parts::new(class);
        for side in [1.0, -1.0] {
            let step = side * swing;
            let knee = at(0.5 * step + 0.04, side * 0.10, 0.48);
            let limb = |from, to, radius: f64| Shape::capsule(from, to, radius * wide);
            body.add(limb(at(0.0, side * 0.09, 0.9), knee, 0.085), Material::Cloth);
            body.add(limb(knee, at(step, side * 0.10, 0.08), 0.06), Material::Cloth);
            let hand = at(-0.7 * step + 0.03, side * 0.225, 0.86);
            body.add(limb(at(0.0, side * 0.205, 1.40), hand, 0.045), Material::Cloth);
        }
        let axes = [0.13 * wide, 0.20 * wide, 0.34 * tall];
        body.add(Shape::ellipsoid(at(0.0, 0.0, 1.18), axes), Material::Cloth);
        let axes = [0.105 * tall, 0.08 * tall, 0.135 * tall];
        body.add(Shape::ellipsoid(at(0.02, 0.0, 1.615), axes), Material::Skin);
        if self.has_backpack {
            let axes = [0.11, 0.15, 0.22];
            body.add(Shape::ellipsoid(at(-0.17, 0.0, 1.24), axes), Material::Cloth);
        }
        Model::new(body.parts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};

    #[test]
    fn a_person_is_as_tall_and_wide_as_promised() {
        let mut rng = stream(5, Purpose::Tile, 0, 0);
        for _ in 0..20 {
            let person = Person::random(&mut rng);
            let model = person.walking(30, 0.3);
            assert!((model.high.z - person.stature).abs() < 0.02);
            assert!((model.high.y - person.half_width()).abs() < 0.005);
            assert!(model.low.z.abs() < 0.05, "{}", model.low.z);
        }
    }
}
