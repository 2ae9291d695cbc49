//! What it costs to follow objects over a drive, beside clustering its clouds: the observation of a
//! cloud's instances, its scan and the registration with the map, and the tracker. Simulated
//! drives, with the true classes and without classes, on one thread.
//!
//! Each figure is the median over the frames of a drive, in milliseconds, and behind it as a share
//! of clustering in the same run.
//!
//! `cargo bench --bench over_time` (`-- --quick` for a look, `-- --frames 300` for longer drives).

use std::time::Instant;

use divmerge::Taxonomy;
use divmerge::over_time::ego_motion::{EgoMotion, EgoMotionParams, RegistrationScan, ScanParams};
use divmerge::over_time::{TrackParams, Tracker, TrackerFrame, observe};
use divmerge::pipeline::{self, Config};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, SimulatedFrame};

/// Seconds between frames.
const STEP: f64 = 0.1;

/// Frames until the window and the map are full.
const FILLED_AFTER: usize = 20;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let at = arguments.iter().position(|argument| argument == "--frames");
    let frames = at.and_then(|at| arguments.get(at + 1)?.parse::<usize>().ok());
    let quick = arguments.iter().any(|argument| argument == "--quick");
    let frames = frames.unwrap_or(if quick { 30 } else { 100 }).max(FILLED_AFTER + 1);
    let sensors = if quick { &["vlp-16"][..] } else { &["vlp-16", "hdl-64e", "os1-128"] };
    println!("{frames} frames; medians in ms, and in percent of clustering\n");
    println!(
        "| drive | classes | instances | cluster | observe | scan | registration | tracker | \
         all but cluster |"
    );
    println!("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    for name in sensors {
        for scene in [Scene::Street, Scene::Crowd] {
            let drive = Drive::new(name.parse().expect("a sensor"), scene, 3);
            let clouds: Vec<SimulatedFrame> = (0..frames).map(|at| drive.frame(at)).collect();
            let taxonomy = Taxonomy::semantic_kitti();
            let ground = GroundParams::default();
            for (classes, mask) in
                [("true", MaskSource::Classes(&taxonomy)), ("none", MaskSource::NotGround(&ground))]
            {
                println!("| {name}, {scene} | {classes} | {}", row(&clouds, mask));
            }
        }
    }
}

/// The cells of a drive.
fn row(clouds: &[SimulatedFrame], mask: MaskSource) -> String {
    let config = Config::default();
    let mut ego_motion = EgoMotion::new(EgoMotionParams::default());
    let mut tracker = Tracker::new(TrackParams::default());
    let mut times: [Vec<f64>; 5] = Default::default();
    let mut instances = 0;
    for (number, SimulatedFrame { cloud, .. }) in clouds.iter().enumerate() {
        let (stages, cluster) = timed(|| pipeline::run(cloud, mask, &config));
        let (observed, observe) = timed(|| observe(cloud, &stages));
        let (scan, scanned) =
            timed(|| RegistrationScan::new(cloud, &stages, &ScanParams::default()));
        let (estimate, registered) = timed(|| ego_motion.push(&scan, STEP));
        let time = number as f64 * STEP;
        let pose = &estimate.world_from_sensor;
        let frame = TrackerFrame { time, pose, instances: &observed };
        let (_, tracked) = timed(|| tracker.push(frame));
        instances += observed.len();
        if number >= FILLED_AFTER {
            let of_frame = [cluster, observe, scanned, registered, tracked];
            times.iter_mut().zip(of_frame).for_each(|(times, time)| times.push(time));
        }
    }
    let medians = times.map(median);
    let cell = |ms: f64| format!("{ms:.2} ({:.0} %)", 100.0 * ms / medians[0]);
    let cells: Vec<String> = medians[1..].iter().map(|&ms| cell(ms)).collect();
    let all: f64 = medians[1..].iter().sum();
    let instances = instances as f64 / clouds.len() as f64;
    format!("{instances:.0} | {:.2} | {} | {} |", medians[0], cells.join(" | "), cell(all))
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let started = Instant::now();
    let done = work();
    (done, started.elapsed().as_secs_f64() * 1e3)
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
