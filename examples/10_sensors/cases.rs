//! The clouds of the table: every simulated sensor, and what drivers and rigs make of some of them.

use divmerge::simulate::{Drive, Rig, Scene, Sensor, SimulatedFrame};

/// A kind of cloud.
pub struct Case {
    pub name: String,
    /// Frame 20 of the street of a seed.
    pub frame: Box<dyn Fn(u64) -> SimulatedFrame>,
}

pub fn all() -> Vec<Case> {
    let mut cases: Vec<Case> = Sensor::ALL
        .into_iter()
        .map(|sensor| case(&sensor.to_string(), move |seed| plain(sensor, seed)))
        .collect();
    cases.extend([
        case("hdl-32e, no ring", |seed| without_ring(plain(Sensor::Hdl32e, seed))),
        case("vlp-32c, no ring", |seed| without_ring(plain(Sensor::Vlp32c, seed))),
        case("vls-128, no ring", |seed| without_ring(plain(Sensor::Vls128, seed))),
        case("helios, no ring", |seed| without_ring(plain(Sensor::Helios, seed))),
        case("pandar-40p-dual, in halves", |seed| halves(plain(Sensor::Pandar40pDual, seed))),
        case("m1, no ring", |seed| without_ring(plain(Sensor::M1, seed))),
        case("hdl-32e, foot of the vehicle", |seed| lifted(plain(Sensor::Hdl32e, seed), 1.8)),
        case("hdl-32e, looking back", |seed| {
            turned(limited(Sensor::Hdl32e, seed), |[x, y, z]| [-x, -y, z])
        }),
        case("hdl-32e, x right, y ahead", |seed| {
            turned(plain(Sensor::Hdl32e, seed), |[x, y, z]| [-y, x, z])
        }),
        case("hdl-32e, tilted by 15 degrees", |seed| {
            mounted(Sensor::Hdl32e, seed, 15_f64.to_radians(), 0.0)
        }),
        case("hdl-32e, upside down", |seed| {
            mounted(Sensor::Hdl32e, seed, 0.0, std::f64::consts::PI)
        }),
        case("three merged, with source", |seed| Rig::robotaxi(Scene::Street, seed).frame(20)),
        case("three merged, no source", |seed| Rig::robotaxi(Scene::Street, seed).anonymous(20)),
    ]);
    cases.extend(of_unknown_place());
    cases
}

/// Clouds that do not show where their sensor stands: no beams, or rows that nothing tells.
fn of_unknown_place() -> Vec<Case> {
    let mut cases = Vec::new();
    for sensor in [Sensor::M1, Sensor::Hap, Sensor::Mid360] {
        let height = sensor.height() as f32;
        let places = [
            ("foot", [0.0, 0.0, height]),
            ("axle", [1.0, 0.2, height - 0.6]),
            ("map", [210.0, 85.0, 31.0]),
        ];
        cases.extend(places.map(|(name, by)| {
            let name = format!("unknown place: {sensor}, {name}");
            case(&name, move |seed| elsewhere(without_ring(plain(sensor, seed)), by))
        }));
    }
    for sensor in [Sensor::Hdl64e, Sensor::Vls128, Sensor::Os1_128] {
        let name = format!("unknown place: {sensor}, tilted, shuffled, map");
        cases.push(case(&name, move |seed| {
            let tilted = mounted(sensor, seed, 8_f64.to_radians(), 0.0);
            elsewhere(shuffled(without_ring(tilted)), [60.0, 35.0, 11.0])
        }));
    }
    for (name, by) in [("axle", [0.0; 3]), ("map", [300.0, -120.0, 7.0])] {
        let name = format!("unknown place: three merged, no source, shuffled, {name}");
        cases.push(case(&name, move |seed| {
            elsewhere(shuffled(Rig::robotaxi(Scene::Street, seed).anonymous(20)), by)
        }));
    }
    cases
}

/// The returns in a frame whose name says that the sensor is not at its origin.
fn elsewhere(frame: SimulatedFrame, by: [f32; 3]) -> SimulatedFrame {
    let returns: Vec<usize> = returns(&frame).collect();
    let moved =
        turned(frame.reordered(&returns), move |[x, y, z]| [x + by[0], y + by[1], z + by[2]]);
    let cloud = moved.cloud.with(|columns| columns.is_named_elsewhere = true);
    SimulatedFrame { cloud: cloud.expect("as many of each"), ..moved }
}

fn returns(frame: &SimulatedFrame) -> impl Iterator<Item = usize> {
    (0..frame.cloud.len()).filter(|&point| frame.cloud.is_return(point))
}

/// The returns in an order that says nothing.
fn shuffled(frame: SimulatedFrame) -> SimulatedFrame {
    let mut order: Vec<usize> = returns(&frame).collect();
    order.sort_by_key(|&point| (point as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 20);
    frame.reordered(&order)
}

fn case(name: &str, frame: impl Fn(u64) -> SimulatedFrame + 'static) -> Case {
    Case { name: name.to_owned(), frame: Box::new(frame) }
}

fn plain(sensor: Sensor, seed: u64) -> SimulatedFrame {
    Drive::new(sensor, Scene::Street, seed).frame(20)
}

fn mounted(sensor: Sensor, seed: u64, pitch: f64, roll: f64) -> SimulatedFrame {
    let mut drive = Drive::new(sensor, Scene::Street, seed);
    (drive.mount.pitch, drive.mount.roll) = (pitch, roll);
    drive.frame(20)
}

/// A sweep of 120 degrees.
fn limited(sensor: Sensor, seed: u64) -> SimulatedFrame {
    let mut drive = Drive::new(sensor, Scene::Street, seed);
    drive.mount.field_of_view = 120_f64.to_radians();
    drive.frame(20)
}

fn without_ring(frame: SimulatedFrame) -> SimulatedFrame {
    let cloud = frame.cloud.with(|columns| columns.ring = None).expect("fewer columns");
    SimulatedFrame { cloud, ..frame }
}

fn lifted(frame: SimulatedFrame, height: f32) -> SimulatedFrame {
    turned(frame, move |[x, y, z]| [x, y, z + height])
}

fn turned(mut frame: SimulatedFrame, turn: impl Fn([f32; 3]) -> [f32; 3]) -> SimulatedFrame {
    for point in 0..frame.cloud.len() {
        frame.cloud.set_position(point, turn(frame.cloud.position(point)));
    }
    frame
}

/// The farther returns of all beams behind all nearer and single ones.
fn halves(frame: SimulatedFrame) -> SimulatedFrame {
    let count = frame.cloud.len();
    let is_farther = |point: usize| {
        point + 1 < count && {
            let [a, b] = [point, point + 1].map(|p| frame.cloud.position(p).map(f64::from));
            let dot: f64 = (0..3).map(|i| a[i] * b[i]).sum();
            let [one, other] = [a, b].map(|p| p.iter().map(|x| x * x).sum::<f64>().sqrt());
            dot > (1.0 - 1e-10) * one * other && one > other
        }
    };
    let (farther, nearer): (Vec<usize>, Vec<usize>) = (0..count).partition(|&p| is_farther(p));
    let order: Vec<usize> = nearer.into_iter().chain(farther).collect();
    frame.reordered(&order)
}
