//! How well objects keep one id over a drive, as the Markdown table of docs/results.md:
//!
//! ```sh
//! cargo run --release --example 14_tracks -- ../shared/data/semantickitti
//! # Some simulated sensors only.
//! cargo run --release --example 14_tracks -- vlp-16 hdl-32e
//! # The table of scene `traffic`, of all four sensors or of some.
//! cargo run --release --example 14_tracks -- traffic
//! # What tracks mend without classes.
//! cargo run --release --example 14_tracks -- mended
//! ```
//!
//! S_assoc is that of LSTQ (Aygün et al. 2021). With true classes every object of more than one
//! point counts, without classes every one of more than 50, and "perfect" is what the same
//! instances get if each has the id of the object that most of its points are of. Switches and
//! objects are those of classes. "Estimated" has the motion of the sensor estimated from the
//! clouds, the other columns have the true one; of SemanticKITTI's drives all have the estimated
//! one.

mod mended;

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use divmerge::datasets::semantic_kitti::{labelled_scans, read_labels, read_scan};
use divmerge::evaluate::{OverTime, SCAN_STEP_NS, Tracking};
use divmerge::over_time::ego_motion::{EgoMotion, EgoMotionParams, RegistrationScan, ScanParams};
use divmerge::over_time::{
    InstanceTrack, ObservedInstance, TrackParams, Tracker, TrackerFrame, observe,
};
use divmerge::pipeline::{Config, Stages, run};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{PointCloud, Taxonomy};
use nalgebra::Isometry3;

use mended::{Things, mended};

const SCENES: [Scene; 3] = [Scene::Street, Scene::Parking, Scene::Crowd];
const FRAMES: usize = 300;
const SEED: u64 = 21;
/// Seconds between frames.
const STEP: f64 = SCAN_STEP_NS as f64 * 1e-9;

fn main() -> Result<()> {
    let (mut sensors, mut folders) = (Vec::new(), Vec::new());
    for argument in std::env::args().skip(1) {
        match argument.parse() {
            Ok(sensor) => sensors.push(sensor),
            Err(_) => folders.push(argument),
        }
    }
    if sensors.is_empty() {
        sensors.extend(Sensor::USUAL);
    }
    match folders.as_slice() {
        [table] if table == "traffic" => return traffic(&sensors),
        [table] if table == "mended" => return mended(&sensors),
        _ => {}
    }
    println!(
        "| drive | frames | S_assoc | perfect | estimated | switches an object | no classes | \
         perfect |\n| --- | --: | --: | --: | --: | --: | --: | --: |"
    );
    for folder in &folders {
        real(Path::new(folder))?;
    }
    for sensor in sensors {
        for scene in SCENES {
            let drive = Drive::new(sensor, scene, SEED);
            let mut scores = DriveScores::new();
            for number in 0..FRAMES {
                let frame = drive.frame(number);
                let class = frame.cloud.class.clone().unwrap_or_default();
                let id = frame.true_instance.iter().map(|&id| u32::from(id)).collect();
                scores.push(&frame.cloud, Some(frame.pose), (class, id))?;
            }
            scores.end();
            scores.print(&format!("{sensor}, {scene}"));
        }
    }
    Ok(())
}

/// The drives of SemanticKITTI with several scans.
fn real(root: &Path) -> Result<()> {
    let mut drives: BTreeMap<String, Vec<_>> = BTreeMap::new();
    for scan in labelled_scans(root)? {
        drives.entry(scan.sequence.clone()).or_default().push(scan);
    }
    let mut all = DriveScores::new();
    for (name, scans) in drives.iter().filter(|(_, scans)| scans.len() > 1) {
        let mut scores = DriveScores::new();
        for scan in scans {
            let cloud = read_scan(&scan.scan)?;
            let words = read_labels(&scan.labels)?;
            let truth: (Vec<u16>, Vec<u32>) =
                words.iter().map(|&word| (word as u16, word >> 16)).unzip();
            scores.push(&cloud, None, truth.clone())?;
            all.push(&cloud, None, truth)?;
        }
        scores.end();
        all.end();
        scores.print(&format!("SemanticKITTI {name}"));
    }
    all.print("SemanticKITTI, all");
    Ok(())
}

/// The table of scene `traffic`: true classes, objects of more than one point.
fn traffic(sensors: &[Sensor]) -> Result<()> {
    println!(
        "| sensor | objects | S_assoc | perfect | estimated | switches an object | fragmentations \
         an object | HOTA | perfect | occlusions | found again | kept |\n| --- | --: | --: | --: | \
         --: | --: | --: | --: | --: | --: | --: | --: |"
    );
    for &sensor in sensors {
        let taxonomy = Taxonomy::semantic_kitti();
        let [mut true_motion, mut estimated] = [(); 2].map(|()| Followed::new(&taxonomy, 1));
        let drive = Drive::new(sensor, Scene::Traffic, SEED);
        for number in 0..FRAMES {
            let frame = drive.frame(number);
            let id = frame.true_instance.iter().map(|&id| u32::from(id)).collect();
            let truth = Truth::new(frame.cloud.class.as_deref().unwrap_or(&[]), id, &taxonomy);
            let stages = run(&frame.cloud, MaskSource::Classes(&taxonomy), &Config::best());
            true_motion.push(&frame.cloud, &stages, Some(frame.pose), &truth);
            estimated.push(&frame.cloud, &stages, None, &truth);
        }
        true_motion.end();
        estimated.end();
        println!("{}", traffic_row(sensor, &true_motion, &estimated));
    }
    Ok(())
}

fn traffic_row(sensor: Sensor, followed: &Followed, estimated: &Followed) -> String {
    let scores = followed.tracking.scores();
    let perfect = followed.perfect_tracking.scores();
    let (changes, occlusions) = (scores.id_changes, scores.occlusions);
    let each = |count: u64| count as f64 / changes.objects.max(1) as f64;
    format!(
        "| {sensor} | {} | {:.1} | {:.1} | {:.1} | {:.2} | {:.2} | {:.1} | {:.1} | {} | {} | {} |",
        changes.objects,
        100.0 * followed.found.s_assoc(),
        100.0 * followed.perfect.s_assoc(),
        100.0 * estimated.found.s_assoc(),
        each(changes.switches),
        each(changes.fragmentations),
        100.0 * scores.hota.hota,
        100.0 * perfect.hota.hota,
        occlusions.cases,
        occlusions.found,
        occlusions.kept,
    )
}

/// What a drive with and without classes comes to.
struct DriveScores {
    taxonomy: Taxonomy,
    frames: usize,
    with_classes: Followed,
    estimated: Followed,
    without: Followed,
}

impl DriveScores {
    fn new() -> Self {
        let taxonomy = Taxonomy::semantic_kitti();
        DriveScores {
            frames: 0,
            with_classes: Followed::new(&taxonomy, 1),
            estimated: Followed::new(&taxonomy, 1),
            without: Followed::new(&taxonomy, 50),
            taxonomy,
        }
    }

    fn push(
        &mut self,
        cloud: &PointCloud,
        pose: Option<Isometry3<f64>>,
        (class, id): (Vec<u16>, Vec<u32>),
    ) -> Result<()> {
        self.frames += 1;
        let truth = Truth::new(&class, id, &self.taxonomy);
        let classed = cloud.clone().with(|columns| columns.class = Some(class))?;
        let bare = cloud.clone().with(|columns| columns.class = None)?;
        let config = Config::best();
        let stages = run(&classed, MaskSource::Classes(&self.taxonomy), &config);
        self.estimated.push(&classed, &stages, None, &truth);
        self.with_classes.push(&classed, &stages, pose, &truth);
        let stages = run(&bare, MaskSource::NotGround(&GroundParams::default()), &config);
        self.without.push(&bare, &stages, pose, &truth);
        Ok(())
    }

    fn end(&mut self) {
        for followed in [&mut self.with_classes, &mut self.estimated, &mut self.without] {
            followed.end();
        }
    }

    fn print(&self, name: &str) {
        let percent = |followed: &OverTime| 100.0 * followed.s_assoc();
        let [with, estimated, without] = [&self.with_classes, &self.estimated, &self.without];
        let changes = with.tracking.scores().id_changes;
        println!(
            "| {name} | {} | {:.1} | {:.1} | {:.1} | {:.2} of {} | {:.1} | {:.1} |",
            self.frames,
            percent(&with.found),
            percent(&with.perfect),
            percent(&estimated.found),
            changes.switches as f64 / changes.objects.max(1) as f64,
            changes.objects,
            percent(&without.found),
            percent(&without.perfect),
        );
    }
}

/// Truth of a frame: class number and instance of each point.
struct Truth {
    class: Vec<u16>,
    id: Vec<u32>,
    objects: Vec<Option<(u16, u32)>>,
}

impl Truth {
    fn new(raw: &[u16], id: Vec<u32>, taxonomy: &Taxonomy) -> Self {
        let class = taxonomy.class_numbers(raw);
        let is_thing = |class: u16| {
            taxonomy.classes().get(usize::from(class)).is_some_and(|class| class.is_thing)
        };
        let object =
            |(&class, &id): (&u16, &u32)| (id != 0 && is_thing(class)).then_some((class, id));
        let objects = class.iter().zip(&id).map(object).collect();
        Truth { class, id, objects }
    }
}

/// A frame that waits for its tracks.
struct Waiting {
    instance: Vec<u32>,
    observed: Vec<ObservedInstance>,
    cloud: PointCloud,
    class: Vec<u16>,
    id: Vec<u32>,
    objects: Vec<Option<(u16, u32)>>,
}

/// The objects of a drive, followed.
struct Followed {
    tracker: Tracker,
    ego_motion: EgoMotion,
    waiting: std::collections::VecDeque<Waiting>,
    frame: usize,
    found: OverTime,
    perfect: OverTime,
    tracking: Tracking,
    perfect_tracking: Tracking,
    things: Things,
    scored: u64,
}

impl Followed {
    fn new(taxonomy: &Taxonomy, min_points: u64) -> Self {
        Followed {
            tracker: Tracker::new(TrackParams::default()),
            ego_motion: EgoMotion::new(EgoMotionParams::default()),
            waiting: Default::default(),
            frame: 0,
            found: OverTime::of(taxonomy, min_points),
            perfect: OverTime::of(taxonomy, min_points),
            tracking: Tracking::new(min_points),
            perfect_tracking: Tracking::new(min_points),
            things: Things::default(),
            scored: 0,
        }
    }

    fn push(
        &mut self,
        cloud: &PointCloud,
        stages: &Stages,
        pose: Option<Isometry3<f64>>,
        truth: &Truth,
    ) {
        let pose = pose.unwrap_or_else(|| {
            let scan = RegistrationScan::new(cloud, stages, &ScanParams::default());
            self.ego_motion.push(&scan, STEP).world_from_sensor
        });
        let observed = observe(cloud, stages);
        let time = self.frame as f64 * STEP;
        let frame = TrackerFrame { time, pose: &pose, instances: &observed };
        let decided = self.tracker.push(frame);
        self.frame += 1;
        self.waiting.push_back(Waiting {
            instance: stages.labels.instance.clone(),
            observed,
            cloud: cloud.clone(),
            class: truth.class.clone(),
            id: truth.id.clone(),
            objects: truth.objects.clone(),
        });
        decided.iter().for_each(|frame| self.score(&frame.tracks));
    }

    fn score(&mut self, tracks: &[InstanceTrack]) {
        let Some(waiting) = self.waiting.pop_front() else { return };
        let Waiting { instance, observed, cloud, class, id, objects } = waiting;
        let found = point_tracks(&instance, &observed, &cloud, tracks);
        self.things.score(&class, &objects, [&instance, &found]);
        // Instances stand for classes: they say nothing of association.
        self.found.add(&class, &found, &class, &id);
        let perfect = perfect(&instance, &objects, self.scored);
        self.perfect.add(&class, &perfect, &class, &id);
        let time_ns = self.scored * SCAN_STEP_NS;
        self.tracking.add(time_ns, &found, &objects);
        self.perfect_tracking.add(time_ns, &perfect, &objects);
        self.scored += 1;
    }

    fn end(&mut self) {
        let decided = self.tracker.finish();
        decided.iter().for_each(|frame| self.score(&frame.tracks));
        self.found.end_sequence();
        self.perfect.end_sequence();
        self.tracking.end_sequence();
        self.perfect_tracking.end_sequence();
        self.ego_motion = EgoMotion::new(EgoMotionParams::default());
    }
}

/// The track of each point.
fn point_tracks(
    instance: &[u32],
    observed: &[ObservedInstance],
    cloud: &PointCloud,
    tracks: &[InstanceTrack],
) -> Vec<u32> {
    let by_id: BTreeMap<u32, (&ObservedInstance, &InstanceTrack)> =
        observed.iter().zip(tracks).map(|pair| (pair.0.id, pair)).collect();
    let track = |(point, id): (usize, &u32)| {
        let instance = by_id.get(id);
        instance.map_or(0, |(observed, track)| track.of_point(observed, || cloud.position(point)))
    };
    instance.iter().enumerate().map(track).collect()
}

/// The number of an object, or 0.
fn word(object: &Option<(u16, u32)>) -> u32 {
    object.map_or(0, |(class, id)| id << 8 | u32::from(class))
}

/// Ids as a perfect tracker gives them: that of the object that most points of an instance are of;
/// else one that comes once.
fn perfect(instance: &[u32], objects: &[Option<(u16, u32)>], frame: u64) -> Vec<u32> {
    const ONCE: u32 = 1 << 31;
    let mut votes: BTreeMap<u32, BTreeMap<u32, usize>> = BTreeMap::new();
    for (&instance, object) in instance.iter().zip(objects).filter(|(id, _)| **id != 0) {
        let object = word(object);
        *votes.entry(instance).or_default().entry(object).or_default() += 1;
    }
    let most = |(&instance, votes): (&u32, &BTreeMap<u32, usize>)| {
        let (&object, _) = votes.iter().max_by_key(|(_, count)| **count).expect("points");
        let once = ONCE | (frame as u32) << 14 | instance;
        (instance, if object == 0 { once } else { object })
    };
    let ids: BTreeMap<u32, u32> = votes.iter().map(most).collect();
    instance.iter().map(|id| ids.get(id).copied().unwrap_or(0)).collect()
}
