//! Bicycles with and without riders, and motorcycles.

use super::{Model, Parts, class};
use crate::material::{Coating, Material};
use crate::shapes::Shape;

const WHEEL_RADIUS: f64 = 0.34;

/// A bicycle leaning on its stand.
pub(crate) fn bicycle() -> Model {
    let mut parts = Parts::new(class::BICYCLE);
    add_bicycle(&mut parts);
    Model::new(parts.parts).leaning()
}

/// A rider on a bicycle: one object. `pedal` is the angle of the cranks in radians.
pub(crate) fn bicyclist(class: u16, pedal: f64) -> Model {
    let mut parts = Parts::new(class);
    add_bicycle(&mut parts);
    let limb = |from, to, radius| Shape::capsule(from, to, radius);
    for side in [1.0, -1.0] {
        let (sin, cos) = (pedal + if side > 0.0 { 0.0 } else { std::f64::consts::PI }).sin_cos();
        let foot = [0.05 + 0.17 * cos, side * 0.12, 0.30 + 0.17 * sin];
        let knee = [0.22 + 0.08 * cos, side * 0.13, 0.70 + 0.10 * sin];
        parts.add(limb([-0.18, side * 0.09, 0.98], knee, 0.08), Material::Cloth);
        parts.add(limb(knee, foot, 0.06), Material::Cloth);
        let shoulder = [0.12, side * 0.19, 1.42];
        parts.add(limb(shoulder, [0.46, side * 0.24, 1.06], 0.045), Material::Cloth);
    }
    let back = limb([-0.15, 0.0, 1.02], [0.10, 0.0, 1.38], 0.16);
    parts.add(back, Material::Cloth);
    let head = Shape::ellipsoid([0.20, 0.0, 1.66], [0.11, 0.09, 0.14]);
    parts.add(head, Material::Skin);
    Model::new(parts.parts).leaning()
}

fn add_bicycle(parts: &mut Parts) {
    for x in [-0.52, 0.52] {
        let [left, right] = [0.02, -0.02].map(|y| [x, y, WHEEL_RADIUS]);
        let coating = Coating::SpokedWheel { x, z: WHEEL_RADIUS, rim: WHEEL_RADIUS - 0.05 };
        parts.add_coated(Shape::cylinder(left, right, WHEEL_RADIUS), coating);
    }
    let (crank, saddle, head) = ([0.0, 0.0, 0.30], [-0.18, 0.0, 0.92], [0.40, 0.0, 0.88]);
    let tubes = [
        (crank, saddle),
        (crank, head),
        ([-0.13, 0.0, 0.78], head),
        (head, [0.52, 0.0, 0.34]),
        (crank, [-0.52, 0.0, 0.34]),
        ([0.42, 0.26, 1.02], [0.42, -0.26, 1.02]),
    ];
    for (from, to) in tubes {
        parts.add(Shape::capsule(from, to, 0.022), Material::Metal);
    }
    let saddle = Shape::ellipsoid([-0.20, 0.0, 0.95], [0.14, 0.08, 0.04]);
    parts.add(saddle, Material::Rubber);
}

/// A parked motorcycle.
pub(crate) fn motorcycle() -> Model {
    let mut parts = Parts::new(class::MOTORCYCLE);
    for x in [-0.70, 0.70] {
        let [left, right] = [0.07, -0.07].map(|y| [x, y, 0.31]);
        parts.add(Shape::cylinder(left, right, 0.31), Material::Rubber);
    }
    let engine = Shape::ellipsoid([0.0, 0.0, 0.45], [0.38, 0.20, 0.24]);
    parts.add(engine, Material::Metal);
    let tank = Shape::ellipsoid([0.15, 0.0, 0.82], [0.34, 0.17, 0.17]);
    parts.add(tank, Material::Paint);
    let seat = Shape::ellipsoid([-0.45, 0.0, 0.78], [0.45, 0.15, 0.10]);
    parts.add(seat, Material::Rubber);
    let fairing = Shape::ellipsoid([0.55, 0.0, 0.95], [0.16, 0.20, 0.22]);
    parts.add(fairing, Material::Paint);
    let fork = Shape::capsule([0.48, 0.0, 0.95], [0.70, 0.0, 0.31], 0.06);
    parts.add(fork, Material::Metal);
    let bar = Shape::capsule([0.42, 0.36, 1.05], [0.42, -0.36, 1.05], 0.03);
    parts.add(bar, Material::Metal);
    Model::new(parts.parts).leaning()
}
