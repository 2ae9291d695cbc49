//! Trees, poles, walls and fences: stuff.

use rand::RngExt;
use rand_pcg::Pcg32;

use super::{Model, Part, Parts, class};
use crate::material::{Coating, Material};
use crate::shapes::Shape;

/// How deep walls reach into the ground, so that no slope shows their lower edge; metres.
const FOUNDATION: f64 = 1.5;

/// A trunk under a crown of several ellipsoids; the crown's radius is at most `crown` metres.
pub(crate) fn tree(rng: &mut Pcg32, crown: f64) -> Model {
    let (clear, radius) = (rng.random_range(1.9..2.8), rng.random_range(0.12..0.24));
    let mut parts = Parts::new(class::TRUNK);
    let trunk = Shape::cylinder([0.0, 0.0, -0.2], [0.0, 0.0, clear + 1.2], radius);
    parts.add(trunk, Material::Bark);
    parts.class = class::VEGETATION;
    let tall = rng.random_range(1.2..2.0);
    parts.add(
        Shape::ellipsoid([0.0, 0.0, clear + tall], [0.75 * crown, 0.75 * crown, tall]),
        Material::Leaves,
    );
    for lobe in 0..4 {
        let around = std::f64::consts::FRAC_PI_2 * (lobe as f64 + rng.random_range(-0.4..0.4));
        let size = rng.random_range(0.38..0.52) * crown;
        let out = (crown - size) * rng.random_range(0.8..1.0);
        let z = clear + rng.random_range(0.7..1.6) * tall;
        let centre = [out * around.cos(), out * around.sin(), z];
        parts.add(Shape::ellipsoid(centre, [size, size, 0.9 * size]), Material::Leaves);
    }
    Model::new(parts.parts)
}

/// A lamp post with an arm of a metre towards +y.
pub(crate) fn lamp_post(rng: &mut Pcg32) -> Model {
    let height = rng.random_range(5.0..8.0);
    let mut parts = Parts::new(class::POLE);
    let post = Shape::cylinder([0.0, 0.0, -0.2], [0.0, 0.0, height], 0.09);
    parts.add(post, Material::Metal);
    let arm = Shape::capsule([0.0, 0.0, height], [0.0, 1.0, height + 0.2], 0.06);
    parts.add(arm, Material::Metal);
    Model::new(parts.parts)
}

/// A traffic sign that faces -x, on its pole.
pub(crate) fn traffic_sign(rng: &mut Pcg32) -> Model {
    let height = rng.random_range(2.2..2.7);
    let mut parts = Parts::new(class::POLE);
    let post = Shape::cylinder([0.0, 0.0, -0.2], [0.0, 0.0, height + 0.3], 0.04);
    parts.add(post, Material::Metal);
    parts.class = class::TRAFFIC_SIGN;
    let plate = if rng.random_bool(0.5) {
        Shape::cylinder([-0.06, 0.0, height], [-0.045, 0.0, height], 0.30)
    } else {
        Shape::cuboid([-0.06, -0.3, height - 0.3], [-0.045, 0.3, height + 0.3])
    };
    parts.add(plate, Material::Retroreflector);
    Model::new(parts.parts)
}

/// A bollard.
pub(crate) fn bollard() -> Model {
    let mut parts = Parts::new(class::POLE);
    let post = Shape::capsule([0.0, 0.0, -0.2], [0.0, 0.0, 0.85], 0.10);
    parts.add(post, Material::Metal);
    Model::new(parts.parts)
}

/// A block of a building: `length` along x and `depth` along y from the front at y = 0, metres.
pub(crate) fn building(length: f64, depth: f64, height: f64) -> Model {
    let half = 0.5 * length;
    let [near, far] = [depth.min(0.0), depth.max(0.0)];
    Model::new(vec![Part {
        shape: Shape::cuboid([-half, near, -FOUNDATION], [half, far, height]),
        coating: Coating::Facade,
        class: class::BUILDING,
    }])
}

/// A wire fence along x with a post at its start, metres.
pub(crate) fn fence(length: f64, height: f64) -> Model {
    let half = 0.5 * length;
    let mut parts = Parts::new(class::FENCE);
    let wire = Shape::cuboid([-half, -0.01, -FOUNDATION], [half, 0.01, height]);
    parts.add(wire, Material::Mesh);
    let post = Shape::cylinder([-half, 0.0, -0.5], [-half, 0.0, height], 0.05);
    parts.add(post, Material::Metal);
    Model::new(parts.parts)
}

/// A garden wall along x, metres.
pub(crate) fn wall(length: f64, height: f64) -> Model {
    let half = 0.5 * length;
    let mut parts = Parts::new(class::FENCE);
    let block = Shape::cuboid([-half, -0.12, -FOUNDATION], [half, 0.12, height]);
    parts.add(block, Material::Masonry);
    Model::new(parts.parts)
}

/// A hedge along x, metres.
pub(crate) fn hedge(length: f64, height: f64) -> Model {
    let half = 0.5 * length;
    let mut parts = Parts::new(class::VEGETATION);
    let block = Shape::cuboid([-half, -0.4, -0.3], [half, 0.4, height]);
    parts.add(block, Material::Leaves);
    Model::new(parts.parts)
}

/// A bush, metres.
pub(crate) fn bush(radius: f64) -> Model {
    let mut parts = Parts::new(class::VEGETATION);
    let ball = Shape::ellipsoid([0.0, 0.0, 0.5 * radius], [radius, radius, 0.9 * radius]);
    parts.add(ball, Material::Leaves);
    Model::new(parts.parts)
}
