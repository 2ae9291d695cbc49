//! Instances without classes, as the Markdown tables of docs/results.md:
//! `cargo run --release --example 06_entropy -- ../shared/data/semantickitti`
//!
//! Over- and under-segmentation entropy (`evaluate::entropy`), mean and standard deviation over the frames,
//! of objects that ground removal leaves and of those that truth gives. Plain Euclidean clustering of the
//! same points stands beside it: with the truth's own distance it cannot cut a true object, and joins what is near. The
//! folder holds SemanticKITTI sequences and may be left out; simulated drives need none.

use std::path::Path;

use anyhow::Result;
use divmerge::evaluate::entropy::{
    Entropies, Kind, TOLERANCE, entropies, euclidean_clusters, mean_and_deviation, true_objects,
};
use divmerge::io::semantic_kitti::{LabelledScan, labelled_scans, read_labels, read_scan};
use divmerge::pipeline::{self, Config};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{PointCloud, Taxonomy};

/// Road, parking, sidewalk, other ground, lane marking, terrain.
const GROUND: [u16; 6] = [40, 44, 48, 49, 60, 72];

/// A cloud with its classes and its true objects.
struct Frame {
    group: String,
    cloud: PointCloud,
    kinds: Vec<Kind>,
    truth: Vec<u32>,
}

/// Where the objects come from.
#[derive(Clone, Copy)]
enum Objects {
    NotGround,
    True,
}

fn main() -> Result<()> {
    if let Some(root) = std::env::args().nth(1) {
        tables("Drive", &labelled(Path::new(&root))?);
    }
    tables("Simulated, two frames each", &simulated());
    Ok(())
}

fn tables(title: &str, frames: &[Frame]) {
    for (objects, name) in
        [(Objects::NotGround, "ground removal"), (Objects::True, "true objects given")]
    {
        println!("{title}, {name}: OSE / USE, mean +- standard deviation\n");
        table(title, frames, objects);
    }
}

fn table(title: &str, frames: &[Frame], objects: Objects) {
    let mut groups: Vec<&str> = frames.iter().map(|frame| frame.group.as_str()).collect();
    groups.dedup();
    println!("| {title} | {} | all | USE with ground |", groups.join(" | "));
    println!("| --- |{}", " ---: |".repeat(groups.len() + 2));
    let configs =
        [("`best`", Config::best()), ("`paper`", Config::paper()), ("`authors`", Config::authors())];
    for (name, config) in configs {
        row(name, &groups, frames, |frame| clustered(frame, objects, &config));
    }
    for tolerance in [0.3, TOLERANCE] {
        let name = format!("Euclidean, {tolerance} m");
        row(&name, &groups, frames, |frame| euclidean(frame, objects, tolerance));
    }
    println!();
}

fn row(name: &str, groups: &[&str], frames: &[Frame], cluster: impl Fn(&Frame) -> Vec<u32>) {
    let scored: Vec<(&str, Entropies)> = frames
        .iter()
        .map(|frame| (frame.group.as_str(), entropies(&frame.truth, &cluster(frame))))
        .collect();
    let cells = groups.iter().map(|group| {
        cell(scored.iter().filter(|(of, _)| of == group).map(|scored| scored.1))
    });
    let ground: Vec<f64> = scored.iter().map(|scored| scored.1.under_with_ground).collect();
    println!(
        "| {name} | {} | {} | {} |",
        cells.collect::<Vec<_>>().join(" | "),
        cell(scored.iter().map(|scored| scored.1)),
        spread(&ground)
    );
}

fn cell(scores: impl Iterator<Item = Entropies> + Clone) -> String {
    let over: Vec<f64> = scores.clone().map(|score| score.over).collect();
    let under: Vec<f64> = scores.map(|score| score.under).collect();
    format!("{} / {}", spread(&over), spread(&under))
}

fn spread(figures: &[f64]) -> String {
    let (mean, deviation) = mean_and_deviation(figures);
    format!("{mean:.1} +- {deviation:.1}")
}

/// The instance of each point.
fn clustered(frame: &Frame, objects: Objects, config: &Config) -> Vec<u32> {
    let ground = GroundParams::default();
    match objects {
        Objects::NotGround => {
            pipeline::run(&frame.cloud, MaskSource::NotGround(&ground), config).labels.instance
        }
        Objects::True => pipeline::run(&objects_alone(frame), MaskSource::All, config).labels.instance,
    }
}

/// The cloud without the returns that are no true objects: they come back with nothing.
fn objects_alone(frame: &Frame) -> PointCloud {
    let mut cloud = frame.cloud.clone();
    for (point, kind) in frame.kinds.iter().enumerate() {
        if !matches!(kind, Kind::Object(_)) {
            (cloud.x[point], cloud.y[point], cloud.z[point]) = (f32::NAN, f32::NAN, f32::NAN);
        }
    }
    cloud
}

fn euclidean(frame: &Frame, objects: Objects, tolerance: f64) -> Vec<u32> {
    let ground = GroundParams::default();
    let is_object = match objects {
        Objects::NotGround => {
            let stages =
                pipeline::run(&frame.cloud, MaskSource::NotGround(&ground), &Config::paper());
            stages.mask.is_object
        }
        Objects::True => frame.kinds.iter().map(|kind| matches!(kind, Kind::Object(_))).collect(),
    };
    let group: Vec<Option<u32>> = is_object.iter().map(|&object| object.then_some(0)).collect();
    euclidean_clusters(&frame.cloud, &group, tolerance)
}

fn frame(group: String, cloud: PointCloud, classes: &[u16]) -> Frame {
    let taxonomy = Taxonomy::semantic_kitti();
    let class_of = taxonomy.lookup();
    let kind = |(point, &raw): (usize, &u16)| {
        let class = &taxonomy.classes()[usize::from(class_of[usize::from(raw)])];
        match (GROUND.contains(&raw), class.is_ignored || !cloud.is_return(point)) {
            (_, true) => Kind::LeftOut,
            (true, _) => Kind::Ground,
            (false, _) => Kind::Object(u32::from(raw)),
        }
    };
    let kinds: Vec<Kind> = classes.iter().enumerate().map(kind).collect();
    let truth = true_objects(&cloud, &kinds, TOLERANCE);
    Frame { group, cloud, kinds, truth }
}

fn labelled(root: &Path) -> Result<Vec<Frame>> {
    let read = |labelled: LabelledScan| {
        let words = read_labels(&labelled.labels)?;
        let classes: Vec<u16> = words.iter().map(|&word| word as u16).collect();
        Ok(frame(labelled.sequence, read_scan(&labelled.scan)?, &classes))
    };
    labelled_scans(root)?.into_iter().map(read).collect()
}

fn simulated() -> Vec<Frame> {
    let mut frames = Vec::new();
    for scene in Scene::ALL {
        for sensor in Sensor::ALL {
            for seed in 101..103 {
                let cloud = Drive::new(sensor, scene, seed).frame(20).cloud;
                let classes = cloud.class.clone().unwrap_or_default();
                frames.push(frame(format!("{scene} {sensor}"), cloud, &classes));
            }
        }
    }
    frames
}
