//! Drift of the ego-motion that is estimated from clouds alone: simulated drives of 300 frames, and
//! drives of SemanticKITTI if there is a folder of them.
//!
//! ```sh
//! cargo run --release --example 13_ego_motion -- ../shared/data/semantickitti
//! # Some sensors only.
//! cargo run --release --example 13_ego_motion -- vlp-16 hdl-32e
//! ```
//!
//! Cells: error of the translation in percent and of the rotation in degrees per metre, both over
//! stretches of 100 m (or the whole way if that is shorter) as in KITTI's odometry benchmark, and
//! milliseconds a frame for scan and registration. First steps: how many of the pairs of
//! neighbouring real scans, forth and back, are found within 0.15 m where nothing came before.
//! Objects are left out as a run without classes finds them. What turns is the sensor, by a degree
//! a frame; of a sensor that stands the cell has the distance and the angle between its first and
//! its last pose.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use divmerge::PointCloud;
use divmerge::datasets::semantic_kitti::drive_files::{OdometryCalibration, poses, times};
use divmerge::datasets::semantic_kitti::{labelled_scans, read_scan};
use divmerge::over_time::ego_motion::{
    EgoMotion, EgoMotionParams, RegistrationScan, ScanParams, drift,
};
use divmerge::pipeline::{Config, run};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, Sensor, SimulatedFrame};
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

const SCENES: [Scene; 4] = [Scene::Street, Scene::Parking, Scene::Crowd, Scene::Hills];
const FRAMES: usize = 300;
const SEED: u64 = 11;
/// Metres of a stretch.
const LENGTH: f64 = 100.0;
/// Metres within which a first step is right: what the lean of the camera leaves, and a hand more.
const NEAR: f64 = 0.15;
/// Radians that the sensor turns by in a frame, where it does.
const TURN: f64 = 1.0 / 180.0 * std::f64::consts::PI;

fn main() -> Result<()> {
    let (mut sensors, mut folders) = (Vec::new(), Vec::new());
    for argument in std::env::args().skip(1) {
        match argument.parse() {
            Ok(sensor) => sensors.push(sensor),
            Err(_) => folders.push(argument),
        }
    }
    for folder in &folders {
        real(Path::new(folder))?;
    }
    simulated(if sensors.is_empty() { &Sensor::USUAL } else { &sensors });
    Ok(())
}

/// Estimates and truth of a drive.
struct Trajectory {
    estimator: EgoMotion,
    estimated: Vec<Isometry3<f64>>,
    truth: Vec<Isometry3<f64>>,
    lost: usize,
    seconds: f64,
}

impl Trajectory {
    fn new() -> Self {
        Trajectory {
            estimator: EgoMotion::new(EgoMotionParams::default()),
            estimated: Vec::new(),
            truth: Vec::new(),
            lost: 0,
            seconds: 0.0,
        }
    }

    fn push(&mut self, scan: impl FnOnce() -> RegistrationScan, dt: f64, truth: Isometry3<f64>) {
        let start = Instant::now();
        let found = self.estimator.push(&scan(), dt);
        self.seconds += start.elapsed().as_secs_f64();
        self.lost += usize::from(!found.is_tracked());
        self.estimated.push(found.world_from_sensor);
        self.truth.push(truth);
    }

    fn cell(&self) -> String {
        let milliseconds = 1e3 * self.seconds / self.truth.len() as f64;
        let lost = match self.lost {
            0 => String::new(),
            lost => format!(", {lost} lost"),
        };
        let error = match drift(&self.estimated, &self.truth, LENGTH) {
            Some(drift) => {
                let [percent, degrees] = [drift.translation_percent(), drift.degrees_per_metre()];
                format!("{percent:.3} %, {degrees:.4}")
            }
            None => {
                let whole = |poses: &[Isometry3<f64>]| poses[0].inv_mul(&poses[poses.len() - 1]);
                let error = whole(&self.truth).inv_mul(&whole(&self.estimated));
                let (shift, turn) = (error.translation.vector.norm(), error.rotation.angle());
                format!("{:.1} mm, {:.3} deg", 1e3 * shift, turn.to_degrees())
            }
        };
        format!("{error}; {milliseconds:.1}{lost}")
    }
}

/// Which points of a cloud belong to objects, as a run without classes finds them.
fn objects(cloud: &PointCloud) -> Vec<bool> {
    let ground = GroundParams::default();
    let stages = run(cloud, MaskSource::NotGround(&ground), &Config::best());
    let is_object = |&id: &u32| id != 0 && stages.instances[id as usize - 1].is_object();
    stages.labels.instance.iter().map(is_object).collect()
}

fn scan(cloud: &PointCloud, objects: &[bool]) -> RegistrationScan {
    RegistrationScan::from_points(cloud, &ScanParams::default(), |point| objects[point])
}

fn simulated(sensors: &[Sensor]) {
    let scenes = SCENES.map(|scene| scene.to_string()).join(" | ");
    println!("| Sensor | {scenes} | street, turning | crowd, standing |");
    println!("| --- |{}", " ---: |".repeat(SCENES.len() + 2));
    for &sensor in sensors {
        let mut cells = Vec::new();
        let mut turning = Trajectory::new();
        for scene in SCENES {
            let mut straight = Trajectory::new();
            for (number, frame) in frames(&Drive::new(sensor, scene, SEED)).enumerate() {
                let objects = objects(&frame.cloud);
                straight.push(|| scan(&frame.cloud, &objects), 0.1, frame.pose);
                if scene == Scene::Street {
                    let turn = TURN * number as f64;
                    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
                    let mut cloud = frame.cloud;
                    cloud.turn(turn.inverse());
                    turning.push(|| scan(&cloud, &objects), 0.1, frame.pose * turn);
                }
            }
            cells.push(straight.cell());
        }
        cells.push(turning.cell());
        let mut standing = Trajectory::new();
        for frame in frames(&Drive::new(sensor, Scene::Crowd, SEED).standing()).take(FRAMES / 3) {
            let objects = objects(&frame.cloud);
            standing.push(|| scan(&frame.cloud, &objects), 0.1, frame.pose);
        }
        cells.push(standing.cell());
        println!("| {sensor} | {} |", cells.join(" | "));
    }
}

/// The frames of a drive without their classes.
fn frames(drive: &Drive) -> impl Iterator<Item = SimulatedFrame> {
    (0..FRAMES).map(|number| {
        let frame = drive.frame(number);
        let cloud = frame.cloud.with(|columns| columns.class = None);
        SimulatedFrame { cloud: cloud.expect("a column less"), ..frame }
    })
}

/// The way along poses.
fn metres(poses: &[Isometry3<f64>]) -> f64 {
    poses.windows(2).map(|pair| pair[0].inv_mul(&pair[1]).translation.vector.norm()).sum()
}

/// `Tr` by KITTI's drawing of the vehicle, where `calib.txt` has none: the camera looks along the
/// scanner's x, 8 cm below and 27 cm ahead of it. By how much it leans, less than a degree, is then
/// part of the error.
fn nominal_mount() -> Isometry3<f64> {
    let axes = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
    let rotation = UnitQuaternion::from_matrix(&axes);
    Isometry3::from_parts(Translation3::new(0.0, -0.08, -0.27), rotation)
}

/// Of all pairs of neighbouring scans, forth and back, how many are found within [`NEAR`] where
/// nothing came before.
fn first_steps(scans: &[RegistrationScan], truth: &[Isometry3<f64>]) -> String {
    let pairs = (1..scans.len()).flat_map(|later| [(later - 1, later), (later, later - 1)]);
    let is_near = |&(from, to): &(usize, usize)| {
        let mut estimator = EgoMotion::new(EgoMotionParams::default());
        estimator.push(&scans[from], 0.0);
        let found = estimator.push(&scans[to], 0.1);
        let error = truth[from].inv_mul(&truth[to]).inv_mul(&found.previous_from_current);
        found.is_tracked() && error.translation.vector.norm() < NEAR
    };
    format!("{} of {}", pairs.clone().filter(is_near).count(), pairs.count())
}

fn real(root: &Path) -> Result<()> {
    println!("| Drive | scans | metres | metres, found | error | first steps |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: |");
    let scans = labelled_scans(root)?;
    for drive in scans.chunk_by(|a, b| a.sequence == b.sequence) {
        let folder = root.join("sequences").join(&drive[0].sequence);
        let text = |name: &str| {
            std::fs::read_to_string(folder.join(name)).with_context(|| format!("{name} is missing"))
        };
        let calibration =
            OdometryCalibration::parse(&text("calib.txt")?).map_err(anyhow::Error::msg)?;
        let camera_from_scanner = calibration.camera_from_scanner.unwrap_or_else(nominal_mount);
        let poses = poses(&text("poses.txt")?).map_err(anyhow::Error::msg)?;
        let times = times(&text("times.txt")?).map_err(anyhow::Error::msg)?;
        let mut trajectory = Trajectory::new();
        let mut kept = Vec::new();
        for (number, labelled) in drive.iter().enumerate() {
            let cloud = read_scan(&labelled.scan)?;
            let objects = objects(&cloud);
            let truth = camera_from_scanner.inv_mul(&(poses[number] * camera_from_scanner));
            let before = times[number.saturating_sub(1)];
            let dt = (times[number] - before) as f64 * 1e-9;
            kept.push(scan(&cloud, &objects));
            trajectory.push(|| scan(&cloud, &objects), dt, truth);
        }
        let first = first_steps(&kept, &trajectory.truth);
        let [way, found] = [&trajectory.truth, &trajectory.estimated].map(|poses| metres(poses));
        let (name, cell) = (&drive[0].sequence, trajectory.cell());
        println!("| {name} | {} | {way:.3} | {found:.3} | {cell} | {first} |", drive.len());
    }
    println!();
    Ok(())
}
