//! Cars, vans, trucks and trailers.

use rand::RngExt;
use rand_pcg::Pcg32;

use super::{Model, Parts, class};
use crate::material::{Coating, Glazing, Material};
use crate::shapes::Shape;

/// What kind of body a vehicle has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Body {
    Hatchback,
    Saloon,
    Estate,
    /// One body for driver and cargo, which SemanticKITTI counts among the cars.
    Van,
    /// A cab with a separate box behind it.
    Truck,
    /// A truck whose box has skirts almost down to the ground.
    Lorry,
    /// A caravan, an "other vehicle".
    Caravan,
}

/// A vehicle's outer measures, metres, and what is special about it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vehicle {
    pub body: Body,
    pub length: f64,
    pub width: f64,
    pub height: f64,
    pub is_black: bool,
    pub has_driver: bool,
}

/// Where the cabin stands on the lower body, all in metres in the vehicle's frame.
struct Cabin {
    /// Height of the lower body.
    belt: f64,
    /// x of the windscreen's foot and of the rear window's foot.
    feet: [f64; 2],
    /// How far the roof begins behind the windscreen's foot, and before the rear window's.
    runs: [f64; 2],
    /// How far the roof's edge is inside the belt.
    tumblehome: f64,
    /// Where the side windows begin at the back.
    windows_from: f64,
}

impl Vehicle {
    /// Any passenger car.
    pub fn car(rng: &mut Pcg32) -> Self {
        let (body, length, height) = match rng.random_range(0..10) {
            0..4 => (Body::Hatchback, 3.7..4.3, 1.44..1.56),
            4..7 => (Body::Saloon, 4.3..4.8, 1.40..1.48),
            _ => (Body::Estate, 4.3..4.75, 1.46..1.66),
        };
        Vehicle {
            body,
            length: rng.random_range(length),
            width: rng.random_range(1.66..1.84),
            height: rng.random_range(height),
            is_black: rng.random_bool(0.14),
            has_driver: false,
        }
    }

    /// A delivery van.
    pub fn van(rng: &mut Pcg32) -> Self {
        Vehicle {
            body: Body::Van,
            length: rng.random_range(4.7..5.3),
            width: rng.random_range(1.86..1.98),
            height: rng.random_range(1.9..2.35),
            is_black: false,
            has_driver: false,
        }
    }

    /// A lorry with a box.
    pub fn truck(rng: &mut Pcg32) -> Self {
        Vehicle {
            body: Body::Truck,
            length: rng.random_range(6.5..8.2),
            width: rng.random_range(2.2..2.3),
            height: rng.random_range(2.9..3.3),
            is_black: false,
            has_driver: false,
        }
    }

    /// A lorry of a given length, metres, that nothing is seen through but at its cab.
    pub fn lorry(rng: &mut Pcg32, length: f64) -> Self {
        Vehicle { body: Body::Lorry, length, ..Vehicle::truck(rng) }
    }

    /// A caravan without its car.
    pub fn caravan(rng: &mut Pcg32) -> Self {
        Vehicle {
            body: Body::Caravan,
            length: rng.random_range(4.4..5.2),
            width: rng.random_range(2.0..2.15),
            height: rng.random_range(2.4..2.6),
            is_black: false,
            has_driver: false,
        }
    }

    /// A passenger car or, with the given chances, a van.
    pub fn car_or_van(rng: &mut Pcg32, van: f64) -> Self {
        if rng.random_bool(van) { Vehicle::van(rng) } else { Vehicle::car(rng) }
    }

    /// The same vehicle with someone at the wheel.
    pub fn driven(mut self) -> Self {
        self.has_driver = true;
        self
    }

    /// SemanticKITTI's raw id of the vehicle at rest.
    pub fn class(&self) -> u16 {
        match self.body {
            Body::Truck | Body::Lorry => class::TRUCK,
            Body::Caravan => class::OTHER_VEHICLE,
            _ => class::CAR,
        }
    }

    /// The vehicle at rest.
    pub fn parked(&self) -> Model {
        self.model(self.class())
    }

    /// The vehicle under way.
    pub fn moving(&self) -> Model {
        self.driven().model(match self.body {
            Body::Truck | Body::Lorry => class::MOVING_TRUCK,
            _ => class::MOVING_CAR,
        })
    }

    fn model(&self, class: u16) -> Model {
        let mut parts = Parts::new(class);
        match self.body {
            Body::Truck => self.add_truck(&mut parts, 0.95),
            Body::Lorry => self.add_truck(&mut parts, 0.35),
            Body::Caravan => self.add_caravan(&mut parts),
            _ => self.add_body(&mut parts, self.length, 0.0, self.height, &self.cabin()),
        }
        self.add_wheels(&mut parts);
        Model::new(parts.parts).leaning()
    }

    fn paint(&self) -> Material {
        if self.is_black { Material::BlackPaint } else { Material::Paint }
    }

    fn cabin(&self) -> Cabin {
        let (length, half) = (self.length, 0.5 * self.length);
        let belt = 0.59 * self.height;
        match self.body {
            Body::Saloon => Cabin {
                belt,
                feet: [0.20 * length, -0.36 * length],
                runs: [0.80, 0.65],
                tumblehome: 0.17,
                windows_from: -0.26 * length,
            },
            Body::Van => Cabin {
                belt: 1.05,
                feet: [half - 0.75, -half + 0.03],
                runs: [0.65, 0.05],
                tumblehome: 0.10,
                windows_from: half - 1.9,
            },
            _ => Cabin {
                belt,
                feet: [0.23 * length, -half + 0.06],
                runs: [0.80, 0.35],
                tumblehome: 0.15,
                windows_from: -half + 0.45,
            },
        }
    }

    /// Lower body, cabin and what is inside; the body reaches from `-length / 2` to `length / 2`,
    /// moved by `shift` along x.
    fn add_body(&self, parts: &mut Parts, length: f64, shift: f64, roof: f64, cabin: &Cabin) {
        let half = [0.5 * length, 0.5 * self.width];
        let move_x = |[x, y, z]: [f64; 3]| [x + shift, y, z];
        let belt = cabin.belt;
        let mut lower =
            Shape::cuboid(move_x([-half[0], -half[1], 0.2]), move_x([half[0], half[1], belt]));
        for y in [1.0, -1.0] {
            for x in [1.0, -1.0] {
                let corner = move_x([x * half[0], y * (half[1] - 0.2), 0.0]);
                lower = lower.cut([x, y, 0.0], corner);
            }
            lower = lower.cut([0.0, y, 0.18], move_x([0.0, y * half[1], 0.62]));
            lower = lower.cut([0.0, y, -0.25], move_x([0.0, y * half[1], 0.45]));
        }
        lower = lower
            .cut([1.0, 0.0, 0.2], move_x([half[0], 0.0, 0.5]))
            .cut([1.0, 0.0, -0.35], move_x([half[0], 0.0, 0.4]))
            .cut([-1.0, 0.0, 0.12], move_x([-half[0], 0.0, 0.6]))
            .cut([-1.0, 0.0, -0.35], move_x([-half[0], 0.0, 0.4]))
            .cut([0.13, 0.0, 1.0], move_x([cabin.feet[0], 0.0, belt]));
        let coating = Coating::Bodywork {
            paint: self.paint(),
            half_length: half[0] + shift.abs(),
            half_width: half[1],
        };
        parts.add_coated(lower, coating);
        self.add_cabin(parts, shift, roof, cabin);
        self.add_interior(parts, shift, cabin);
    }

    fn add_cabin(&self, parts: &mut Parts, shift: f64, roof: f64, cabin: &Cabin) {
        let (belt, rise) = (cabin.belt, roof - cabin.belt);
        let [front, rear] = cabin.feet.map(|x| x + shift);
        let side = 0.5 * self.width - 0.05;
        let mut shell = Shape::cuboid([rear, -side, belt], [front, side, roof])
            .cut([rise, 0.0, cabin.runs[0]], [front, 0.0, belt])
            .cut([-rise, 0.0, cabin.runs[1]], [rear, 0.0, belt])
            .cut([0.25, 0.0, 1.0], [front - cabin.runs[0] - 0.3, 0.0, roof])
            .cut([-0.2, 0.0, 1.0], [rear + cabin.runs[1] + 0.5, 0.0, roof]);
        for y in [1.0, -1.0] {
            shell = shell
                .cut([0.0, y * rise, cabin.tumblehome], [0.0, y * side, belt])
                .cut([0.0, y * 0.5, 1.0], [0.0, y * (side - cabin.tumblehome - 0.12), roof]);
        }
        let rake = cabin.runs[0] / rise;
        let glazing = Glazing {
            paint: self.paint(),
            sill: belt + 0.05,
            header: roof - 0.11,
            half_width: side - 0.16,
            sides: [cabin.windows_from + shift, front - 0.12],
            rake,
            pillar: front - 1.35,
            rear: !matches!(self.body, Body::Van | Body::Truck | Body::Lorry),
        };
        parts.add_coated(shell, Coating::Cabin(glazing));
    }

    /// Front seats, and a driver on the left one.
    fn add_interior(&self, parts: &mut Parts, shift: f64, cabin: &Cabin) {
        let x = cabin.feet[0] + shift - 1.25;
        let (z, seat) = (cabin.belt, 0.21 * self.width);
        for y in [seat, -seat] {
            let back = Shape::cuboid([x - 0.30, y - 0.22, z], [x - 0.18, y + 0.22, z + 0.12]);
            parts.add(back, Material::Upholstery);
            let rest = Shape::ellipsoid([x - 0.24, y, z + 0.20], [0.05, 0.13, 0.10]);
            parts.add(rest, Material::Upholstery);
        }
        if self.has_driver {
            let torso = Shape::ellipsoid([x, seat, z - 0.02], [0.14, 0.22, 0.20]);
            parts.add(torso, Material::Cloth);
            let head = Shape::ellipsoid([x + 0.04, seat, z + 0.28], [0.10, 0.08, 0.13]);
            parts.add(head, Material::Skin);
            let arm = [[x, seat + 0.18, z + 0.06], [x + 0.45, seat + 0.1, z + 0.08]];
            parts.add(Shape::capsule(arm[0], arm[1], 0.05), Material::Cloth);
        }
    }

    /// The box reaches down to `clearance` metres above the ground.
    fn add_truck(&self, parts: &mut Parts, clearance: f64) {
        let (half, cab) = (0.5 * self.length, 1.9);
        let cabin = Cabin {
            belt: 1.25,
            feet: [0.5 * cab - 0.05, -0.5 * cab],
            runs: [0.25, 0.02],
            tumblehome: 0.08,
            windows_from: -0.2,
        };
        self.add_body(parts, cab, half - 0.5 * cab, 2.4, &cabin);
        let side = 0.5 * self.width;
        let low = [-half, -side, clearance];
        let cargo = Shape::cuboid(low, [half - cab - 0.12, side, self.height]);
        parts.add(cargo, Material::Paint);
        let frame = Shape::cuboid([-half + 0.2, -0.45, 0.5], [half - cab, 0.45, 0.95]);
        parts.add(frame, Material::Metal);
    }

    fn add_caravan(&self, parts: &mut Parts) {
        let (half, side) = (0.5 * self.length, 0.5 * self.width);
        let shell = Shape::cuboid([-half, -side, 0.4], [half - 0.9, side, self.height])
            .cut([1.0, 0.0, 0.5], [half - 0.9, 0.0, 1.3])
            .cut([-1.0, 0.0, 0.2], [-half, 0.0, 1.5]);
        parts.add(shell, Material::Paint);
        let bar = Shape::capsule([half - 0.95, 0.0, 0.45], [half - 0.05, 0.0, 0.45], 0.05);
        parts.add(bar, Material::Metal);
    }

    fn add_wheels(&self, parts: &mut Parts) {
        let radius = if self.height > 2.8 { 0.42 } else { 0.32 };
        let half = 0.5 * self.length;
        let axles: &[f64] = match self.body {
            Body::Caravan => &[-0.2],
            Body::Truck | Body::Lorry => &[half - 1.1, -half + 1.6],
            _ => &[half - 0.82, -half + 0.75],
        };
        let outer = 0.5 * self.width - 0.03;
        for &x in axles {
            for side in [1.0, -1.0] {
                let [inner, outer] = [outer - 0.2, outer].map(|y| [x, side * y, radius]);
                parts.add(Shape::cylinder(inner, outer, radius), Material::Rubber);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};

    #[test]
    fn a_vehicle_keeps_its_measures() {
        let mut rng = stream(5, Purpose::Tile, 0, 0);
        let lorry = |rng: &mut Pcg32| Vehicle::lorry(rng, 11.0);
        for make in [Vehicle::car, Vehicle::van, Vehicle::truck, lorry, Vehicle::caravan] {
            let vehicle = make(&mut rng);
            let size = vehicle.moving().high - vehicle.moving().low;
            assert!((size.x - vehicle.length).abs() < 0.06, "{vehicle:?} {size}");
            assert!((size.y - vehicle.width).abs() < 0.02, "{vehicle:?} {size}");
            assert!((size.z - vehicle.height).abs() < 0.02, "{vehicle:?} {size}");
        }
    }
}
