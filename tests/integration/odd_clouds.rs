//! Random sensors, frames, fields and orders: a cloud comes out as good as its control, the same
//! sweep as the sensor gives it, or with a remark. None is silent and wrong.
//!
//! `DIVMERGE_CLOUDS=500 cargo test --test integration odd_clouds -- --nocapture` makes the table of
//! docs/sensors.md.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;

use divmerge::annotate::{Clustered, cluster, remarks};
use divmerge::cloud::Reason;
use divmerge::datasets::drive::cloud_message;
use divmerge::messages::clouds::CloudFormat;
use divmerge::nalgebra::{self, Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use divmerge::simulate::{Drive, Scene, Sensor, SimulatedFrame};
use divmerge::{AnnotateConfig, CloudKey, Semantics, SensorOrigin};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Clouds tried without the variable `DIVMERGE_CLOUDS`.
const FEW: u64 = 40;

/// Where a node has moved the sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Frame {
    Sensor,
    /// The foot of the vehicle, on the ground.
    Foot,
    /// The foot, with the sensor's place given.
    FootGiven,
    /// Somewhere over the vehicle, above the ground.
    Axle,
    /// Metres to kilometres off.
    Map,
    /// x to the right, y down, z ahead, by name.
    Optical,
}

/// What became of the ring field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Ring {
    Kept,
    Missing,
    Constant,
    Random,
    /// Numbered from the other end.
    Reversed,
}

/// In which order the points are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Order {
    Kept,
    Shuffled,
    Reversed,
}

#[derive(Debug, Clone, Copy)]
struct Trial {
    number: u64,
    sensor: Sensor,
    scene: Scene,
    frame: Frame,
    ring: Ring,
    order: Order,
}

impl fmt::Display for Trial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Trial { number, sensor, scene, frame, ring, order } = self;
        write!(f, "{number}: {sensor} in {scene}, {frame:?}, ring {ring:?}, order {order:?}")
    }
}

fn pick<T: Copy>(draws: &mut Pcg64Mcg, from: &[T]) -> T {
    from[draws.random_range(0..from.len())]
}

impl Trial {
    fn new(number: u64) -> Trial {
        use Frame::{Axle, Foot, FootGiven, Map, Optical};
        let mut draws = Pcg64Mcg::seed_from_u64(number);
        let rings = [Ring::Kept, Ring::Missing, Ring::Constant, Ring::Random, Ring::Reversed];
        Trial {
            number,
            sensor: pick(&mut draws, &Sensor::ALL),
            scene: pick(&mut draws, &Scene::ALL),
            frame: pick(&mut draws, &[Frame::Sensor, Foot, FootGiven, Axle, Map, Optical]),
            ring: pick(&mut draws, &rings),
            order: pick(&mut draws, &[Order::Kept, Order::Shuffled, Order::Reversed]),
        }
    }

    /// The pose of the sensor in the cloud's frame.
    fn frame_from_sensor(&self, draws: &mut Pcg64Mcg) -> Isometry3<f64> {
        let mut place = |reach: f64| draws.random_range(-reach..reach);
        let [x, y] = [place(1.5), place(0.5)];
        let height = self.sensor.height();
        match self.frame {
            Frame::Sensor => Isometry3::identity(),
            Frame::Foot | Frame::FootGiven => Isometry3::translation(x, y, height),
            Frame::Axle => Isometry3::translation(x, y, height - 0.6),
            Frame::Map => {
                let scale = 10_f64.powf(draws.random_range(1.3..3.3));
                Isometry3::translation(scale * x, scale, 0.01 * scale + y)
            }
            Frame::Optical => {
                // Of a frame with x ahead and z up.
                let [right, down, ahead]: [Vector3<f64>; 3] =
                    [-Vector3::y(), -Vector3::z(), Vector3::x()];
                let axes = [right, down, ahead].map(|axis| axis.transpose());
                let turn = Rotation3::from_matrix_unchecked(Matrix3::from_rows(&axes));
                nalgebra::convert(UnitQuaternion::from_rotation_matrix(&turn))
            }
        }
    }

    fn altered(&self, frame: &SimulatedFrame) -> (SimulatedFrame, Isometry3<f64>) {
        let mut draws = Pcg64Mcg::seed_from_u64(self.number ^ 0x5EED);
        let pose = self.frame_from_sensor(&mut draws);
        let mut altered = frame.clone();
        for point in (0..frame.cloud.len()).filter(|&point| frame.cloud.is_return(point)) {
            let at = pose * Point3::from(frame.cloud.position(point).map(f64::from));
            altered.cloud.set_position(point, [at.x as f32, at.y as f32, at.z as f32]);
        }
        let ring = altered.cloud.ring.clone().and_then(|ring| {
            let highest = ring.iter().copied().max().unwrap_or(0);
            match self.ring {
                Ring::Kept => Some(ring),
                Ring::Missing => None,
                Ring::Constant => Some(vec![draws.random_range(0..64); ring.len()]),
                Ring::Random => {
                    Some(ring.iter().map(|_| draws.random_range(0..=highest.max(3))).collect())
                }
                Ring::Reversed => Some(ring.iter().map(|&ring| highest - ring).collect()),
            }
        });
        altered.cloud = altered.cloud.with(|columns| columns.ring = ring).expect("as many");
        (self.reordered(altered, &mut draws), pose)
    }

    /// Organised clouds keep their order.
    fn reordered(&self, frame: SimulatedFrame, draws: &mut Pcg64Mcg) -> SimulatedFrame {
        if frame.cloud.is_organised() || self.order == Order::Kept {
            return frame;
        }
        let mut order: Vec<usize> = (0..frame.cloud.len()).collect();
        match self.order {
            Order::Reversed => order.reverse(),
            _ => {
                let keys: Vec<u64> = order.iter().map(|_| draws.random()).collect();
                order.sort_by_key(|&point| keys[point]);
            }
        }
        frame.reordered(&order)
    }

    fn run(&self) -> Outcome {
        let frame = Drive::new(self.sensor, self.scene, self.number % 7).frame(3);
        let control = Scores::of(&frame, &clustered(&frame, "lidar", None));
        let (altered, pose) = self.altered(&frame);
        let frame_id = match self.frame {
            Frame::Sensor => "lidar",
            Frame::Foot | Frame::FootGiven => "base_footprint",
            Frame::Axle => "rear_axle",
            Frame::Map => "map",
            Frame::Optical => "front_optical",
        };
        let given = (self.frame == Frame::FootGiven).then(|| pose.translation.vector.into());
        let found = clustered(&altered, frame_id, given);
        let scores = Scores::of(&altered, &found);
        let remarks: Vec<&str> = remarks_of(&found).into_iter().map(|(kind, _)| kind).collect();
        let place = pose.translation.vector.as_slice();
        let what = format!("{self} at {place:?}: {scores:?} for {control:?}; {remarks:?}");
        match (scores.are_as_good_as(&control), remarks.is_empty()) {
            (true, _) => Outcome::Good,
            (false, false) => Outcome::Said(what),
            (false, true) => Outcome::Wrong(what),
        }
    }
}

fn remarks_of(found: &Clustered) -> Vec<(&'static str, String)> {
    remarks(found)
}

fn clustered(frame: &SimulatedFrame, frame_id: &str, origin: Option<[f64; 3]>) -> Clustered {
    let mut message = Vec::new();
    cloud_message(frame, &mut message).expect("a cloud");
    let mut wire = CloudFormat::Ros2.decode(&message).expect("a message");
    wire.frame_id = frame_id.to_owned();
    let mut config = AnnotateConfig { semantics: Semantics::Ground, ..AnnotateConfig::default() };
    config.frames.sensor_origins =
        origin.into_iter().map(|origin| SensorOrigin { topic: None, origin }).collect();
    cluster(&wire, &CloudKey::new("/points", 0, &wire), &config).expect("a clustered cloud")
}

enum Outcome {
    Good,
    Said(String),
    Wrong(String),
}

/// How good a result is.
#[derive(Debug)]
struct Scores {
    /// F1 of the ground, percent.
    ground: f64,
    /// Things of 25 returns and more of which more than half of all points are one instance's.
    whole: usize,
    things: usize,
    /// Instances most of whose points are of the ground.
    false_instances: usize,
}

impl Scores {
    fn of(frame: &SimulatedFrame, found: &Clustered) -> Scores {
        const GROUND: [u16; 6] = [40, 44, 48, 49, 60, 72];
        let class = frame.cloud.class.as_deref().expect("a simulated cloud has classes");
        let labels = &found.stages.labels;
        let mut ground = [0.0; 2];
        let mut things: BTreeMap<u16, usize> = BTreeMap::new();
        let mut instances: BTreeMap<u32, [usize; 2]> = BTreeMap::new();
        let mut both: BTreeMap<(u16, u32), usize> = BTreeMap::new();
        for point in (0..class.len()).filter(|&p| frame.cloud.is_return(p)) {
            let is_ground = GROUND.contains(&class[point]);
            let is_found = labels.reason[point] == Reason::Ground;
            ground[0] += f64::from(u8::from(is_ground && is_found));
            ground[1] += f64::from(u8::from(is_ground)) + f64::from(u8::from(is_found));
            let (thing, instance) = (frame.true_instance[point], labels.instance[point]);
            *things.entry(thing).or_default() += 1;
            let counts = instances.entry(instance).or_default();
            counts[0] += 1;
            counts[1] += usize::from(is_ground);
            *both.entry((thing, instance)).or_default() += 1;
        }
        things.retain(|&thing, count| thing != 0 && *count >= 25);
        let is_whole = |((thing, instance), shared): (&(u16, u32), &usize)| {
            *instance != 0
                && things
                    .get(thing)
                    .is_some_and(|count| 2 * shared > count + instances[instance][0] - shared)
        };
        let is_false = |(id, counts): &(&u32, &[usize; 2])| **id != 0 && 2 * counts[1] > counts[0];
        Scores {
            ground: 200.0 * ground[0] / ground[1].max(1.0),
            whole: both.iter().filter(|&pair| is_whole(pair)).count(),
            things: things.len(),
            false_instances: instances.iter().filter(is_false).count(),
        }
    }

    /// But for a thing in twenty, 3 points of F1, and what falls off the ground by chance.
    fn are_as_good_as(&self, control: &Scores) -> bool {
        self.whole + 1 + self.things / 20 >= control.whole
            && self.ground >= control.ground - 3.0
            && self.false_instances <= control.false_instances + 3 + control.false_instances / 4
    }
}

/// `500` for the first 500, `87..88` for some.
fn numbers(asked: &str) -> Range<u64> {
    let number = |text: &str| text.parse().expect("DIVMERGE_CLOUDS is N or N..N");
    match asked.split_once("..") {
        Some((from, to)) => number(from)..number(to),
        None => 0..number(asked),
    }
}

#[test]
fn clouds_come_out_right_or_are_remarked_on() {
    let numbers = std::env::var("DIVMERGE_CLOUDS").map_or(0..FEW, |asked| numbers(&asked));
    let mut table: BTreeMap<(Frame, &str), [usize; 3]> = BTreeMap::new();
    let mut wrong = Vec::new();
    for number in numbers {
        let trial = Trial::new(number);
        let kind = match (trial.sensor, trial.ring) {
            (Sensor::M1 | Sensor::Hap | Sensor::Mid360, _) => "without beams",
            (_, Ring::Kept | Ring::Reversed) => "beams with ring",
            _ => "beams, no true ring",
        };
        let counts = table.entry((trial.frame, kind)).or_default();
        match trial.run() {
            Outcome::Good => counts[0] += 1,
            Outcome::Said(what) => {
                counts[1] += 1;
                println!("said: {what}");
            }
            Outcome::Wrong(what) => {
                counts[2] += 1;
                wrong.push(what);
            }
        }
    }
    println!("| frame | sensor | as its control | remarked on | silent and wrong |");
    println!("| --- | --- | ---: | ---: | ---: |");
    for ((frame, kind), [good, said, wrong]) in table {
        println!("| {frame:?} | {kind} | {good} | {said} | {wrong} |");
    }
    assert!(wrong.is_empty(), "{} silent and wrong:\n{}", wrong.len(), wrong.join("\n"));
}
