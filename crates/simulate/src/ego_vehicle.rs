//! The vehicle that carries the sensor, as the sensor sees it.

use nalgebra::Isometry3;

use super::material::{Coating, Material};
use super::objects::{Model, Part, Placed, class};
use super::shapes::Shape;

/// The instance of the vehicle that carries the sensor.
pub const EGO_INSTANCE: u16 = u16::MAX;

/// The vehicle with its foot at a pose: a saloon without wheels, with mirrors.
pub(super) fn placed(world_from_vehicle: Isometry3<f64>) -> Placed {
    let part = |low: [f64; 3], high: [f64; 3], material: Material| Part {
        shape: Shape::cuboid(low, high),
        coating: Coating::Plain(material),
        class: class::OUTLIER,
    };
    let mirror = |y: f64| part([0.55, y - 0.1, 0.95], [0.7, y + 0.1, 1.15], Material::Paint);
    let parts = vec![
        part([-2.3, -0.9, 0.3], [2.3, 0.9, 0.95], Material::Paint),
        part([-1.7, -0.75, 0.95], [0.6, 0.75, 1.45], Material::Paint),
        mirror(1.0),
        mirror(-1.0),
    ];
    Placed { id: EGO_INSTANCE, model: Model::new(parts), world_from_object: world_from_vehicle }
}
