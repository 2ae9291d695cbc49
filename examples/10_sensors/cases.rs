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
    cases
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
