//! What stands and moves in the scenes, built of shapes; x forward, y left, z up from the ground,
//! metres.

pub(super) mod cycle;
pub(super) mod person;
pub(super) mod surroundings;
pub(super) mod vehicle;

use nalgebra::{Isometry3, Point3};

use super::ground::Ground;
use super::material::{Coating, Material};
use super::shapes::Shape;

/// SemanticKITTI's raw ids.
pub(super) mod class {
    pub const OUTLIER: u16 = 1;
    pub const CAR: u16 = 10;
    pub const BICYCLE: u16 = 11;
    pub const MOTORCYCLE: u16 = 15;
    pub const TRUCK: u16 = 18;
    pub const OTHER_VEHICLE: u16 = 20;
    pub const PERSON: u16 = 30;
    pub const BICYCLIST: u16 = 31;
    pub const ROAD: u16 = 40;
    pub const PARKING: u16 = 44;
    pub const SIDEWALK: u16 = 48;
    pub const BUILDING: u16 = 50;
    pub const FENCE: u16 = 51;
    pub const VEGETATION: u16 = 70;
    pub const TRUNK: u16 = 71;
    pub const TERRAIN: u16 = 72;
    pub const POLE: u16 = 80;
    pub const TRAFFIC_SIGN: u16 = 81;
    pub const MOVING_CAR: u16 = 252;
    pub const MOVING_BICYCLIST: u16 = 253;
    pub const MOVING_PERSON: u16 = 254;
    pub const MOVING_TRUCK: u16 = 258;

    /// Whether objects of the class are counted.
    pub fn is_thing(class: u16) -> bool {
        !(ROAD..=TRAFFIC_SIGN).contains(&class)
    }
}

/// One convex piece of an object.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub shape: Shape,
    pub coating: Coating,
    pub class: u16,
}

/// An object in its own frame.
#[derive(Debug, Clone)]
pub(super) struct Model {
    pub parts: Vec<Part>,
    /// Opposite corners of the box around all parts.
    pub low: Point3<f64>,
    pub high: Point3<f64>,
    /// Whether it leans with the ground instead of standing upright.
    pub leans: bool,
}

impl Model {
    /// An upright object of at least one part.
    pub fn new(parts: Vec<Part>) -> Self {
        let corners = parts.iter().map(|part| part.shape.bounds());
        let (low, high) = corners.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1))).unwrap_or_default();
        Model { parts, low, high, leans: false }
    }

    /// The same object standing on wheels.
    pub fn leaning(mut self) -> Self {
        self.leans = true;
        self
    }

    pub fn is_thing(&self) -> bool {
        self.parts.iter().any(|part| class::is_thing(part.class))
    }
}

/// An object in the world.
#[derive(Debug, Clone)]
pub(super) struct Placed {
    /// The instance of a thing, 0 for stuff.
    pub id: u16,
    pub model: Model,
    pub world_from_object: Isometry3<f64>,
}

impl Placed {
    /// An object on the ground at x and y, metres, turned by `yaw` radians.
    pub fn on(ground: &Ground, id: u16, model: Model, [x, y, yaw]: [f64; 3]) -> Self {
        let world_from_object = match model.leans {
            true => ground.frame_on_slope(x, y, yaw),
            false => ground.frame_upright(x, y, yaw),
        };
        Placed { id, model, world_from_object }
    }
}

/// Collects parts of one class.
struct Parts {
    class: u16,
    parts: Vec<Part>,
}

impl Parts {
    fn new(class: u16) -> Self {
        Parts { class, parts: Vec::new() }
    }

    fn add(&mut self, shape: Shape, material: Material) {
        self.add_coated(shape, Coating::Plain(material));
    }

    fn add_coated(&mut self, shape: Shape, coating: Coating) {
        self.parts.push(Part { shape, coating, class: self.class });
    }
}
