//! Objects without classes, as the Markdown tables of docs/results.md:
//! `cargo run --release --example 06_objects -- ../shared/data/semantickitti`
//!
//! 1. Ways of clustering side by side, on what the same ground removal leaves: things of 50 points
//!    or more found whole, S_assoc, OSE and USE (`evaluate::things`, `evaluate::entropy`),
//!    instances.
//! 2. The same of preset `best` by drive or by sensor.
//! 3. What each term of a node's score is worth.
//! 4. Parameters chosen on all drives but one, scored on that one.
//!
//! The folder holds SemanticKITTI sequences and may be left out; a sequence after it does that one
//! alone. Simulated drives need none.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use divmerge::cluster::Method;
use divmerge::cluster::params::TreeMerge;
use divmerge::comparison::methods::Euclidean;
use divmerge::comparison::methods::named;
use divmerge::datasets::semantic_kitti::{LabelledScan, labelled_scans, read_labels, read_scan};
use divmerge::evaluate::entropy::{Entropies, entropies, true_parts};
use divmerge::evaluate::panoptic::MIN_POINTS;
use divmerge::evaluate::things::thing_scores;
use divmerge::pipeline::{self, Config, Stages};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{PointCloud, Taxonomy};

/// Names of the kinds of things and SemanticKITTI's ids.
const THINGS: usize = 3;
const KINDS: [(&str, &[u16]); THINGS] = [
    ("car, truck, bus", &[10, 13, 16, 18, 20, 252, 256, 257, 258, 259]),
    ("person", &[30, 254]),
    ("bicycle, rider", &[11, 15, 31, 32, 253, 255]),
];

/// A cloud with its truth, a row per point.
struct Frame {
    group: String,
    cloud: PointCloud,
    /// Parts for the entropies.
    parts: Vec<u32>,
    /// Word of a thing with an id, or 0.
    things: Vec<u32>,
    /// Whether the point counts among the things: neither of class 0 or 1 nor of a thing without
    /// id.
    counts: Vec<bool>,
}

/// What a way of clustering makes of some frames.
#[derive(Clone, Default)]
struct Score {
    frames: usize,
    /// Things and how many of them were found, by kind.
    things: [usize; THINGS],
    whole: [usize; THINGS],
    association: f64,
    entropies: Entropies,
    instances: usize,
    small: usize,
}

fn main() -> Result<()> {
    let only = std::env::args().nth(2);
    if let Some(root) = std::env::args().nth(1) {
        tables("Drive", &labelled(Path::new(&root), only.as_deref())?);
    }
    if only.is_none() {
        tables("Sensor", &simulated());
    }
    Ok(())
}

fn tables(title: &str, frames: &[Frame]) {
    println!("Ways of clustering, objects by ground removal:\n");
    header("method");
    for (name, config) in ways() {
        row(&name, &score(frames, &config));
    }
    println!("\n`best`:\n");
    header(title);
    let mut groups: Vec<&str> = frames.iter().map(|frame| frame.group.as_str()).collect();
    groups.dedup();
    for group in &groups {
        row(group, &score(of_group(frames, group), &Config::best()));
    }
    println!("\nTerms of the score:\n");
    header("`best`");
    for (name, config) in ablations() {
        row(name, &score(frames, &config));
    }
    if groups.len() > 1 {
        println!("\nParameters chosen on the others:\n");
        header(title);
        left_out(frames, &groups);
    }
}

fn ways() -> Vec<(String, Config)> {
    let taxonomy = Taxonomy::semantic_kitti();
    let presets = [Config::best(), Config::paper(), Config::authors()];
    let mut ways: Vec<(String, Config)> =
        presets.map(|config| (format!("`{}`", config.preset), config)).into();
    for reach in [0.3, 0.5, 1.0] {
        let other_method: Option<Arc<dyn Method>> = Some(Arc::new(Euclidean { reach }));
        let config = Config { other_method, ..Config::best() };
        ways.push((format!("Euclidean, {reach} m"), config));
    }
    for name in ["dbscan", "depth-clustering", "scan-line-run"] {
        let config = Config { other_method: named(name, &taxonomy), ..Config::best() };
        ways.push((name.to_owned(), config));
    }
    ways
}

fn with(change: impl FnOnce(&mut TreeMerge)) -> Config {
    let mut config = Config::best();
    change(config.cluster.tree.as_mut().expect("best cuts a tree"));
    config
}

fn ablations() -> Vec<(&'static str, Config)> {
    vec![
        ("as it is", Config::best()),
        ("wholeness does not count", with(|tree| tree.wholeness = 0.0)),
        ("what is seen of the face does not count", with(|tree| tree.filled = 0.0)),
        (
            "isolation hardly counts: any gap is full",
            with(|tree| {
                (tree.gap, tree.nearest_gap, tree.least_gap) = (1e-6, 1e-6, 1e-6);
            }),
        ),
        ("gaps of 0.009", with(|tree| tree.gap = 0.009)),
        ("gaps of 0.015", with(|tree| tree.gap = 0.015)),
        ("a plain sum of scores", with(|tree| tree.power = 1.0)),
        ("squares of scores", with(|tree| tree.power = 2.0)),
        ("least score 0.3", with(|tree| tree.least_score = 0.3)),
        ("heights count in full", with(|tree| tree.height_weight = 1.0)),
        ("half the window", with(|tree| tree.window /= 2.0)),
        ("twice the window", with(|tree| tree.window *= 2.0)),
        ("background across 0.5 m", with(|tree| tree.background = 0.5)),
        ("no objects: background alone", with(|tree| tree.least_score = 2.0)),
    ]
}

/// Of each group the score of the parameters that find most things whole on all others, then the
/// most associated ones.
fn left_out(frames: &[Frame], groups: &[&str]) {
    let mut candidates = Vec::new();
    for gap in [0.009, 0.012, 0.015] {
        for wholeness in [0.0, 0.2, 0.4] {
            for power in [1.25, 1.5, 2.0] {
                candidates.push(with(|tree| {
                    (tree.gap, tree.wholeness, tree.power) = (gap, wholeness, power);
                }));
            }
        }
    }
    let scores: Vec<Vec<Score>> = candidates
        .iter()
        .map(|config| groups.iter().map(|group| score(of_group(frames, group), config)).collect())
        .collect();
    let mut all = Score::default();
    for (left, group) in groups.iter().enumerate() {
        let of_others = |of_groups: &Vec<Score>| {
            let mut sum = Score::default();
            let others = of_groups.iter().enumerate().filter(|&(other, _)| other != left);
            others.for_each(|(_, score)| sum.add(score));
            (sum.whole.iter().sum::<usize>(), sum.association)
        };
        let best = scores.iter().max_by(|a, b| {
            let (a, b) = (of_others(a), of_others(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        let Some(best) = best else { continue };
        row(group, &best[left]);
        all.add(&best[left]);
    }
    row("all", &all);
}

fn of_group<'a>(
    frames: &'a [Frame],
    group: &'a str,
) -> impl IntoIterator<Item = &'a Frame> + use<'a> {
    frames.iter().filter(move |frame| frame.group == group)
}

fn score<'a>(frames: impl IntoIterator<Item = &'a Frame>, config: &Config) -> Score {
    let mut sum = Score::default();
    for frame in frames {
        sum.add(&frame.score(&frame.run(config).labels.instance));
    }
    sum
}

fn header(first: &str) {
    let kinds = KINDS.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(" | ");
    println!(
        "| {first} | things | found whole, % | {kinds} | S_assoc | OSE | USE | instances | under 5 \
         points |"
    );
    println!("| --- |{}", " ---: |".repeat(THINGS + 7));
}

fn row(name: &str, score: &Score) {
    let share = |whole: usize, all: usize| match all {
        0 => "none".to_owned(),
        all => format!("{:.1}", 100.0 * whole as f64 / all as f64),
    };
    let of_kind = (0..THINGS).map(|kind| share(score.whole[kind], score.things[kind]));
    let things: usize = score.things.iter().sum();
    let mean = |sum: f64| sum / score.frames.max(1) as f64;
    println!(
        "| {name} | {things} | {} | {} | {:.1} | {:.1} | {:.1} | {:.0} | {:.0} |",
        share(score.whole.iter().sum(), things),
        of_kind.collect::<Vec<_>>().join(" | "),
        100.0 * score.association / things.max(1) as f64,
        mean(score.entropies.over),
        mean(score.entropies.under),
        mean(score.instances as f64),
        mean(score.small as f64)
    );
}

fn kind(class: u16) -> Option<usize> {
    KINDS.iter().position(|(_, ids)| ids.contains(&class))
}

impl Score {
    fn add(&mut self, other: &Score) {
        self.frames += other.frames;
        for kind in 0..THINGS {
            self.things[kind] += other.things[kind];
            self.whole[kind] += other.whole[kind];
        }
        self.association += other.association;
        self.entropies.over += other.entropies.over;
        self.entropies.under += other.entropies.under;
        self.instances += other.instances;
        self.small += other.small;
    }
}

impl Frame {
    fn new(group: String, cloud: PointCloud, words: &[u32]) -> Result<Self> {
        let taxonomy = Taxonomy::semantic_kitti();
        let classes: Vec<u16> = words.iter().map(|&word| word as u16).collect();
        let numbers = taxonomy
            .known_class_numbers(&classes)
            .map_err(|class| anyhow::anyhow!("class {class} is not of the taxonomy"))?;
        let is_thing = |word: u32| kind(word as u16).is_some();
        let counts = |&word: &u32| word as u16 > 1 && (!is_thing(word) || word >> 16 != 0);
        let thing = |&word: &u32| if is_thing(word) && word >> 16 != 0 { word } else { 0 };
        Ok(Frame {
            group,
            parts: true_parts(&cloud, words, (&classes, &numbers), &taxonomy),
            things: words.iter().map(thing).collect(),
            counts: words.iter().map(counts).collect(),
            cloud,
        })
    }

    fn run(&self, config: &Config) -> Stages {
        let ground = GroundParams::default();
        pipeline::run(&self.cloud, MaskSource::NotGround(&ground), config)
    }

    fn score(&self, found: &[u32]) -> Score {
        let counting = |values: &[u32]| -> Vec<u32> {
            let pairs = values.iter().zip(&self.counts).filter(|&(_, &counts)| counts);
            pairs.map(|(&value, _)| value).collect()
        };
        let mut score =
            Score { frames: 1, entropies: entropies(&self.parts, found), ..Score::default() };
        let scores = thing_scores(&counting(&self.things), &counting(found), MIN_POINTS as usize);
        for thing in scores {
            let kind = kind(thing.id as u16).expect("a thing");
            score.things[kind] += 1;
            score.whole[kind] += usize::from(thing.is_whole());
            score.association += thing.association;
        }
        let mut sorted: Vec<u32> = found.iter().copied().filter(|&id| id != 0).collect();
        sorted.sort_unstable();
        for instance in sorted.chunk_by(|a, b| a == b) {
            score.instances += 1;
            score.small += usize::from(instance.len() < 5);
        }
        score
    }
}

fn labelled(root: &Path, only: Option<&str>) -> Result<Vec<Frame>> {
    let read = |labelled: LabelledScan| {
        Frame::new(labelled.sequence, read_scan(&labelled.scan)?, &read_labels(&labelled.labels)?)
    };
    let scans = labelled_scans(root)?.into_iter();
    scans.filter(|scan| only.is_none_or(|only| scan.sequence == only)).map(read).collect()
}

fn simulated() -> Vec<Frame> {
    let mut frames = Vec::new();
    for sensor in Sensor::USUAL {
        for scene in Scene::USUAL {
            for seed in 101..103 {
                let frame = Drive::new(sensor, scene, seed).frame(20);
                let classes = frame.cloud.class.clone().unwrap_or_default();
                let words = classes.iter().zip(&frame.true_instance);
                let words: Vec<u32> =
                    words.map(|(&class, &id)| u32::from(class) | u32::from(id) << 16).collect();
                let made = Frame::new(sensor.to_string(), frame.cloud, &words);
                frames.push(made.expect("simulated classes are the taxonomy's"));
            }
        }
    }
    frames
}
