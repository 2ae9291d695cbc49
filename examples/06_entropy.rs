//! Instances without classes, as the Markdown tables of docs/results.md:
//! `cargo run --release --example 06_entropy -- ../shared/data/semantickitti`
//!
//! 1. Over- and under-segmentation entropy (`evaluate::entropy`), mean +- standard deviation over
//!    the frames; how many things were found whole (IoU above a half, 50 points); and how many
//!    instances there are. Of objects that ground removal leaves and of those that truth gives.
//! 2. How much the entropies depend on how truth is clustered.
//! 3. What instances look like against what they are, a row per true kind.
//!
//! Plain Euclidean clustering of the same points stands beside ours: at truth's own distance it
//! cannot cut a true object but where ground removal took a part of it. The folder holds
//! SemanticKITTI sequences and may be left out; a sequence after it does that one alone. Simulated
//! drives need none.

use std::path::Path;

use anyhow::Result;
use divmerge::cloud::ShapeClass;
use divmerge::cluster::params::GapMerge;
use divmerge::datasets::semantic_kitti::{LabelledScan, labelled_scans, read_labels, read_scan};
use divmerge::evaluate::entropy::{
    Entropies, MIN_POINTS, PointRole, TOLERANCE, entropies, euclidean_clusters, found_whole,
    point_roles, true_objects,
};
use divmerge::evaluate::panoptic;
use divmerge::geometry::statistics::mean_and_deviation;
use divmerge::pipeline::{self, Config, Stages};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{PointCloud, Taxonomy};

/// Road, parking, sidewalk, other ground, lane marking, terrain.
const GROUND: [u16; 6] = [40, 44, 48, 49, 60, 72];

/// Names of true kinds and SemanticKITTI's ids.
const KINDS: [(&str, &[u16]); 9] = [
    ("car, truck, bus", &[10, 13, 16, 18, 20, 252, 256, 257, 258, 259]),
    ("person", &[30, 254]),
    ("bicycle, rider", &[11, 15, 31, 32, 253, 255]),
    ("pole, sign", &[80, 81]),
    ("trunk", &[71]),
    ("building", &[50]),
    ("fence", &[51]),
    ("vegetation", &[70]),
    ("ground", &GROUND),
];

/// A cloud with its truth, a row per point.
struct Frame {
    group: String,
    cloud: PointCloud,
    classes: Vec<u16>,
    roles: Vec<PointRole>,
    /// Instance of a thing, or 0.
    things: Vec<u32>,
}

/// What a way of clustering makes of a frame.
struct Score {
    group: String,
    entropies: Entropies,
    things: (usize, usize),
    instances: usize,
}

/// Where the objects come from.
#[derive(Clone, Copy)]
enum Objects {
    NotGround,
    True,
}

/// A way of clustering.
enum Way {
    Ours(Box<Config>),
    Euclidean(f64),
}

fn main() -> Result<()> {
    let only = std::env::args().nth(2);
    if let Some(root) = std::env::args().nth(1) {
        tables("Drive", &labelled(Path::new(&root), only.as_deref())?);
    }
    if only.is_some() {
        return Ok(());
    }
    tables("Simulated, two seeds each", &simulated());
    Ok(())
}

fn tables(title: &str, frames: &[Frame]) {
    println!("OSE / USE, objects by ground removal:\n");
    entropy_table(title, frames, Objects::NotGround);
    println!("OSE / USE, true objects given:\n");
    entropy_table(title, frames, Objects::True);
    println!("OSE / USE by how truth is clustered, objects by ground removal:\n");
    truth_table(frames);
    println!("Instances of 10 points or more by true kind (rows) and likeness (columns):\n");
    likeness_table(frames);
}

fn ways() -> Vec<(String, Way)> {
    let mut ways: Vec<(String, Way)> = [Config::best(), Config::paper(), Config::authors()]
        .map(|config| (format!("`{}`", config.preset), Way::Ours(config.into())))
        .into();
    let mut angle = Config::best();
    angle.cluster.gaps = None;
    ways.insert(1, ("`best`, angle in place of gaps".into(), Way::Ours(angle.into())));
    let mut apart = Config::best();
    apart.cluster.gaps = apart.cluster.gaps.map(|gaps| GapMerge { leftover: 0, ..gaps });
    ways.insert(2, ("`best`, leftovers stay apart".into(), Way::Ours(apart.into())));
    let euclidean =
        [0.4, TOLERANCE].map(|far| (format!("Euclidean, {far} m"), Way::Euclidean(far)));
    ways.extend(euclidean);
    ways
}

fn entropy_table(title: &str, frames: &[Frame], objects: Objects) {
    let mut groups: Vec<&str> = frames.iter().map(|frame| frame.group.as_str()).collect();
    groups.dedup();
    println!(
        "| {title} | {} | all | USE with ground | things whole, % | instances |",
        groups.join(" | ")
    );
    println!("| --- |{}", " ---: |".repeat(groups.len() + 4));
    let truth: Vec<Vec<u32>> =
        frames.iter().map(|frame| frame.truth(TOLERANCE, MIN_POINTS)).collect();
    for (name, way) in ways() {
        let scored = frames.iter().zip(&truth).map(|(frame, truth)| {
            let found = way.cluster(frame, objects);
            Score {
                group: frame.group.clone(),
                entropies: entropies(truth, &found),
                things: found_whole(&frame.things, &found, panoptic::MIN_POINTS as usize),
                instances: count(&found),
            }
        });
        row(&name, &groups, &scored.collect::<Vec<_>>());
    }
    println!();
}

fn row(name: &str, groups: &[&str], scores: &[Score]) {
    let of_group = |group: &&str| {
        cell(scores.iter().filter(|score| score.group == **group).map(|score| score.entropies))
    };
    let ground: Vec<f64> = scores.iter().map(|score| score.entropies.under_with_ground).collect();
    let sum = |get: fn(&Score) -> usize| scores.iter().map(get).sum::<usize>() as f64;
    println!(
        "| {name} | {} | {} | {} | {:.1} | {:.0} |",
        groups.iter().map(of_group).collect::<Vec<_>>().join(" | "),
        cell(scores.iter().map(|score| score.entropies)),
        spread(&ground),
        100.0 * sum(|score| score.things.0) / sum(|score| score.things.1),
        sum(|score| score.instances) / scores.len() as f64,
    );
}

fn truth_table(frames: &[Frame]) {
    const TRUTHS: [(f64, usize); 6] =
        [(0.3, 10), (0.5, 1), (0.5, 10), (0.5, 30), (0.8, 10), (1.0, 10)];
    let names = TRUTHS.map(|(far, points)| format!("{far} m, {points}"));
    println!("| truth's distance, least points | {} |", names.join(" | "));
    println!("| --- |{}", " ---: |".repeat(TRUTHS.len()));
    let truths = TRUTHS.map(|(far, points)| {
        frames.iter().map(|frame| frame.truth(far, points)).collect::<Vec<_>>()
    });
    for (name, way) in ways() {
        let found: Vec<Vec<u32>> =
            frames.iter().map(|frame| way.cluster(frame, Objects::NotGround)).collect();
        let cells = truths.each_ref().map(|truth| {
            cell(truth.iter().zip(&found).map(|(truth, found)| entropies(truth, found)))
        });
        println!("| {name} | {} |", cells.join(" | "));
    }
    println!();
}

/// Counts of instances by the true kind that most of their points are of.
fn likeness_table(frames: &[Frame]) {
    let mut counts = [[0_usize; ShapeClass::ALL.len()]; KINDS.len()];
    for frame in frames {
        let stages = frame.run(Objects::NotGround, &Config::best());
        for (kind, likeness) in kinds_and_likenesses(frame, &stages) {
            counts[kind][likeness as usize] += 1;
        }
    }
    let names = ShapeClass::ALL.map(ShapeClass::name);
    println!("| true | {} |", names.join(" | "));
    println!("| --- |{}", " ---: |".repeat(names.len()));
    for ((name, _), counts) in KINDS.iter().zip(counts) {
        println!("| {name} | {} |", counts.map(|count| count.to_string()).join(" | "));
    }
    println!();
}

fn kinds_and_likenesses(frame: &Frame, stages: &Stages) -> Vec<(usize, ShapeClass)> {
    let mut points = vec![[0_usize; KINDS.len()]; stages.instances.len() + 1];
    for (&instance, class) in stages.labels.instance.iter().zip(&frame.classes) {
        if let Some(kind) = KINDS.iter().position(|(_, ids)| ids.contains(class)) {
            points[instance as usize][kind] += 1;
        }
    }
    let seen = stages.instances.iter().filter(|instance| instance.points >= MIN_POINTS as u32);
    let judged = seen.filter_map(|instance| {
        let points = points[instance.id as usize];
        let most = (0..KINDS.len()).max_by_key(|&kind| points[kind])?;
        (2 * points[most] > instance.points as usize).then_some((most, instance.shape?.class))
    });
    judged.collect()
}

fn count(found: &[u32]) -> usize {
    let mut numbers: Vec<u32> = found.iter().copied().filter(|&number| number != 0).collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers.len()
}

fn cell(scores: impl Iterator<Item = Entropies>) -> String {
    let (over, under): (Vec<f64>, Vec<f64>) = scores.map(|score| (score.over, score.under)).unzip();
    format!("{} / {}", spread(&over), spread(&under))
}

fn spread(figures: &[f64]) -> String {
    let (mean, deviation) = mean_and_deviation(figures);
    format!("{mean:.1} +- {deviation:.1}")
}

impl Way {
    /// The instance of each point.
    fn cluster(&self, frame: &Frame, objects: Objects) -> Vec<u32> {
        match self {
            Way::Ours(config) => frame.run(objects, config).labels.instance,
            Way::Euclidean(tolerance) => {
                let is_object = frame.run(objects, &Config::paper()).mask.is_object;
                let group: Vec<_> = is_object.iter().map(|&is| is.then_some(0)).collect();
                euclidean_clusters(&frame.cloud, &group, *tolerance)
            }
        }
    }
}

impl Frame {
    fn new(group: String, cloud: PointCloud, classes: Vec<u16>, ids: &[u32]) -> Self {
        let taxonomy = Taxonomy::semantic_kitti();
        let class_of = taxonomy.lookup();
        let class = |raw: u16| &taxonomy.classes()[usize::from(class_of[usize::from(raw)])];
        let numbers: Vec<u16> = classes.iter().map(|&raw| class_of[usize::from(raw)]).collect();
        let thing = |(&raw, &id): (&u16, &u32)| match class(raw).is_thing && id != 0 {
            true => id << 16 | u32::from(raw),
            false => 0,
        };
        Frame {
            roles: point_roles(&cloud, &classes, &numbers, &taxonomy),
            things: classes.iter().zip(ids).map(thing).collect(),
            group,
            cloud,
            classes,
        }
    }

    /// The true object of each point.
    fn truth(&self, tolerance: f64, min_points: usize) -> Vec<u32> {
        true_objects(&self.cloud, &self.roles, tolerance, min_points)
    }

    fn run(&self, objects: Objects, config: &Config) -> Stages {
        let ground = GroundParams::default();
        match objects {
            Objects::NotGround => {
                pipeline::run(&self.cloud, MaskSource::NotGround(&ground), config)
            }
            Objects::True => pipeline::run(&self.objects_alone(), MaskSource::All, config),
        }
    }

    /// The cloud without the returns that are no true objects: they come back with nothing.
    fn objects_alone(&self) -> PointCloud {
        let mut cloud = self.cloud.clone();
        for (point, role) in self.roles.iter().enumerate() {
            if !matches!(role, PointRole::Object(_)) {
                cloud.set_position(point, [f32::NAN; 3]);
            }
        }
        cloud
    }
}

fn labelled(root: &Path, only: Option<&str>) -> Result<Vec<Frame>> {
    let read = |labelled: LabelledScan| {
        let words = read_labels(&labelled.labels)?;
        let classes = words.iter().map(|&word| word as u16).collect();
        let ids: Vec<u32> = words.iter().map(|&word| word >> 16).collect();
        Ok(Frame::new(labelled.sequence, read_scan(&labelled.scan)?, classes, &ids))
    };
    let scans = labelled_scans(root)?.into_iter();
    scans.filter(|scan| only.is_none_or(|only| scan.sequence == only)).map(read).collect()
}

fn simulated() -> Vec<Frame> {
    let mut frames = Vec::new();
    for scene in Scene::ALL {
        for sensor in Sensor::USUAL {
            for seed in 101..103 {
                let frame = Drive::new(sensor, scene, seed).frame(20);
                let classes = frame.cloud.class.clone().unwrap_or_default();
                let ids: Vec<u32> = frame.true_instance.iter().map(|&id| u32::from(id)).collect();
                let group = format!("{scene} {sensor}");
                frames.push(Frame::new(group, frame.cloud, classes, &ids));
            }
        }
    }
    frames
}
