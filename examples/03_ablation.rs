//! What each part of preset `best` is worth, as the Markdown tables of docs/results.md:
//! `cargo run --release --example 03_ablation -- ../shared/data/semantickitti`
//!
//! Mean panoptic quality over the thing classes that truth has with 50 points or more, classes
//! given. The folder holds SemanticKITTI sequences and may be left out; simulated drives need none.

use std::path::Path;

use anyhow::Result;
use divmerge::cluster::ClusterParams;
use divmerge::cluster::params::{BirdsEye, FragmentMerge, Region};
use divmerge::datasets::semantic_kitti::{LabelledScan, labelled_scans, read_labels, read_scan};
use divmerge::evaluate::panoptic::{MIN_POINTS, Panoptic};
use divmerge::pipeline::{self, Config};
use divmerge::semantics::MaskSource;
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{PointCloud, Taxonomy};

/// A cloud with its classes, and the id of the true segment of each point.
struct Frame {
    group: String,
    cloud: PointCloud,
    truth: Vec<u32>,
}

fn main() -> Result<()> {
    if let Some(root) = std::env::args().nth(1) {
        table("Drive", &labelled(Path::new(&root))?);
    }
    table("Simulated, four seeds each", &simulated());
    Ok(())
}

fn variants() -> Vec<(&'static str, Config)> {
    let with = |change: fn(&mut ClusterParams)| {
        let mut config = Config::best();
        change(&mut config.cluster);
        config
    };
    vec![
        ("`best`", Config::best()),
        ("any class is a neighbour", with(|p| p.same_class_neighbours = false)),
        ("angle in place of nearness", with(|p| p.condition.nearness = None)),
        ("4-connected", with(|p| (p.gap_columns, p.gap_rows) = (1, 1))),
        ("leftovers unreached", with(|p| p.leftovers = ClusterParams::paper().leftovers)),
        ("any positive vote merges", with(|p| p.merge_ratio = 0.0)),
        ("no vote merges", with(|p| p.merge_ratio = 1.0)),
        ("voxel 0.2 m", with(|p| p.voxel = 0.2)),
        ("voxel 2 m", with(|p| p.voxel = 2.0)),
        ("classes as they are, noisy or not", {
            let mut config = Config::best();
            config.smoothing = None;
            config
        }),
        ("small pieces do not wait", with(|p| by_size(p).delay = 0.0)),
        ("small pieces wait 1 m", with(|p| by_size(p).delay = 1.0)),
        ("gaps bridged up to W", with(|p| by_size(p).bridged = 1.0)),
        ("gaps bridged up to 1.25 W", with(|p| by_size(p).bridged = 1.25)),
        ("touching whatever the width", with(|p| by_size(p).widest = f64::INFINITY)),
        ("fragments stay apart", with(|p| p.fragments = None)),
        ("overlap of hulls instead of size", with(hulls)),
        ("shadowed points: 5 x 5, by range", with(|p| p.back_projection = paper_window())),
        ("at least 30 pixels", with(|p| p.min_pixels = 30)),
        ("`paper`", Config::paper()),
        ("`authors`", Config::authors()),
        ("`authors`, voxel 0.5 m", {
            let mut config = Config::authors();
            config.cluster.voxel = 0.5;
            config
        }),
    ]
}

fn by_size(params: &mut ClusterParams) -> &mut FragmentMerge {
    params.fragments.as_mut().expect("best assembles fragments")
}

fn hulls(params: &mut ClusterParams) {
    params.fragments = None;
    params.birds_eye =
        ClusterParams::paper().birds_eye.map(|paper| BirdsEye { region: Region::Hull, ..paper });
}

fn paper_window() -> divmerge::cluster::params::BackProjection {
    ClusterParams::paper().back_projection
}

/// One row per variant, one column per group of frames.
fn table(title: &str, frames: &[Frame]) {
    let mut groups: Vec<&str> = frames.iter().map(|frame| frame.group.as_str()).collect();
    groups.dedup();
    println!(
        "| {title} | {} | all | car | person | bicycle, rider | truck, bus |",
        groups.join(" | ")
    );
    println!("| --- |{}", " ---: |".repeat(groups.len() + 5));
    for (name, config) in variants() {
        let mut all = scores();
        let mut cells = Vec::new();
        for group in &groups {
            let mut own = scores();
            for frame in frames.iter().filter(|frame| frame.group == *group) {
                add(frame, &config, &mut [&mut own, &mut all]);
            }
            cells.push(things(&own, &[]));
        }
        cells.push(things(&all, &[]));
        let classes: [&[&str]; 4] = [
            &["car"],
            &["person"],
            &["bicycle", "motorcycle", "bicyclist", "motorcyclist"],
            &["truck", "other-vehicle"],
        ];
        cells.extend(classes.iter().map(|names| things(&all, names)));
        println!("| {name} | {} |", cells.join(" | "));
    }
    println!();
}

fn scores() -> Panoptic {
    Panoptic::of(&Taxonomy::semantic_kitti(), MIN_POINTS)
}

fn add(frame: &Frame, config: &Config, scores: &mut [&mut Panoptic]) {
    let taxonomy = Taxonomy::semantic_kitti();
    let class_of = taxonomy.lookup();
    let classes = |raw: &[u16]| raw.iter().map(|&id| class_of[id as usize]).collect::<Vec<_>>();
    let stages = pipeline::run(&frame.cloud, MaskSource::Classes(&taxonomy), config);
    let truth = classes(frame.cloud.class.as_deref().unwrap_or_default());
    let found = classes(&stages.labels.semantic);
    for scores in scores {
        scores.add(&found, &stages.labels.instance, &truth, &frame.truth);
    }
}

/// Mean PQ in percent over the things that occur, or over those of some names.
fn things(scores: &Panoptic, names: &[&str]) -> String {
    let taxonomy = Taxonomy::semantic_kitti();
    let chosen = |class: usize| {
        scores.is_thing_present(&taxonomy, class)
            && (names.is_empty() || names.contains(&taxonomy.classes()[class].name.as_str()))
    };
    match (0..taxonomy.classes().len()).any(chosen) {
        true => format!("{:.2}", scores.mean(chosen).pq * 100.0),
        false => "-".into(),
    }
}

fn labelled(root: &Path) -> Result<Vec<Frame>> {
    let frame = |labelled: LabelledScan| {
        let truth = read_labels(&labelled.labels)?;
        let classes = truth.iter().map(|&word| word as u16).collect();
        let cloud = read_scan(&labelled.scan)?.with_class(classes)?;
        Ok(Frame { group: labelled.sequence, cloud, truth })
    };
    labelled_scans(root)?.into_iter().map(frame).collect()
}

fn simulated() -> Vec<Frame> {
    let mut frames = Vec::new();
    for scene in [Scene::Street, Scene::Parking, Scene::Crowd] {
        for sensor in [Sensor::Hdl64e, Sensor::Vlp16, Sensor::Os1_128] {
            for seed in 101..105 {
                let frame = Drive::new(sensor, scene, seed).frame(20);
                let truth = frame.true_instance.iter().map(|&id| u32::from(id)).collect();
                frames.push(Frame {
                    group: format!("{scene} {sensor}"),
                    cloud: frame.cloud,
                    truth,
                });
            }
        }
    }
    frames
}
