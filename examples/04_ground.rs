//! Ground removal against truth: `cargo run --release --example 04_ground -- ../shared/data/semantickitti`
//!
//! Without a folder only the simulated scenes are measured. Ground is road, lane marking, parking, sidewalk,
//! other ground and terrain; points of vegetation and points without a label are left out on both sides,
//! as the field does. Drops of rain and mirrored returns of simulated scenes are no ground.

use std::f64::consts::PI;
use std::path::Path;

use anyhow::Result;
use divmerge::PointCloud;
use divmerge::io::semantic_kitti::{LabelledScan, labelled_scans, read_labels, read_scan};
use divmerge::range_image::{ProjectionParams, RangeImage};
use divmerge::semantics::GroundParams;
use divmerge::semantics::ground::ground;
use divmerge::simulate::{Clutter, Drive, Scene, Sensor};

const GROUND: [u16; 6] = [40, 44, 48, 49, 60, 72];
const LEFT_OUT: [u16; 4] = [0, 52, 70, 99];
/// Left out in real scans only, where it says nothing about the place of a point.
const OUTLIER: u16 = 1;
const SEEDS: std::ops::Range<u64> = 201..203;

fn main() -> Result<()> {
    if let Some(root) = std::env::args().nth(1) {
        real(Path::new(&root))?;
    }
    if std::env::var("FAST").is_err() {
        simulated()
    } else {
        fast()
    }
    Ok(())
}

fn real(root: &Path) -> Result<()> {
    println!("| Sequence | scans | F1 | precision | recall |\n| --- | ---: | ---: | ---: | ---: |");
    let mut all = Vec::new();
    let scans = labelled_scans(root)?;
    for sequence in scans.chunk_by(|a, b| a.sequence == b.sequence) {
        let scores = sequence.iter().map(score_scan).collect::<Result<Vec<_>>>()?;
        print_row(&sequence[0].sequence, &scores);
        all.extend(scores);
    }
    print_row("all", &all);
    println!();
    Ok(())
}

/// F1, precision and recall of one scan in percent.
fn score_scan(labelled: &LabelledScan) -> Result<[f64; 3]> {
    let cloud = read_scan(&labelled.scan)?;
    let words = read_labels(&labelled.labels)?.into_iter();
    let truth = words.map(|word| Some(word as u16).filter(|&class| class != OUTLIER));
    Ok(score(&cloud, &truth.map(|class| class.unwrap_or(0)).collect::<Vec<u16>>()))
}

fn score(cloud: &PointCloud, truth: &[u16]) -> [f64; 3] {
    let image = RangeImage::new(cloud, &ProjectionParams::default());
    let found = ground(cloud, &image, &GroundParams::default()).is_ground;
    let (mut hits, mut extra, mut missed) = (0.0, 0.0, 0.0);
    for (class, found) in truth.iter().zip(found) {
        match (GROUND.contains(class), found) {
            _ if LEFT_OUT.contains(class) => {}
            (true, true) => hits += 1.0,
            (false, true) => extra += 1.0,
            (true, false) => missed += 1.0,
            (false, false) => {}
        }
    }
    let share = |of: f64| if of > 0.0 { hits / of } else { 0.0 };
    [share(hits + 0.5 * (extra + missed)), share(hits + extra), share(hits + missed)]
        .map(|share| share * 100.0)
}

fn mean(scores: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|i| scores.iter().map(|score| score[i]).sum::<f64>() / scores.len() as f64)
}

fn print_row(name: &str, scores: &[[f64; 3]]) {
    let [f1, precision, recall] = mean(scores);
    println!("| {name} | {} | {f1:.2} | {precision:.2} | {recall:.2} |", scores.len());
}

/// What is unusual about a simulated sweep.
struct Situation {
    name: &'static str,
    change: fn(&mut Drive),
    /// Whether the cloud is given in a frame with z down.
    is_z_down: bool,
}

const SITUATIONS: [Situation; 12] = [
    usual("as usual", |_| {}),
    usual("pitch 5", |drive| drive.mount.pitch = 5.0 / 180.0 * PI),
    usual("roll 10", |drive| drive.mount.roll = 10.0 / 180.0 * PI),
    usual("pitch 15", |drive| drive.mount.pitch = 15.0 / 180.0 * PI),
    usual("pitch -10, roll 15", |drive| {
        (drive.mount.pitch, drive.mount.roll) = (-10.0 / 180.0 * PI, 15.0 / 180.0 * PI);
    }),
    Situation { name: "z down", change: |_| {}, is_z_down: true },
    Situation {
        name: "z down, pitch 10",
        change: |drive| drive.mount.pitch = 10.0 / 180.0 * PI,
        is_z_down: true,
    },
    usual("0.4 m high", |drive| drive.mount.height = 0.4),
    usual("3 m high", |drive| drive.mount.height = 3.0),
    usual("120 degrees wide", |drive| drive.mount.field_of_view = 120.0 / 180.0 * PI),
    usual("rain", |drive| drive.clutter = Clutter { drops: 0.05, mirrored: 0.0 }),
    usual("mirrors", |drive| drive.clutter = Clutter { drops: 0.0, mirrored: 0.03 }),
];

const fn usual(name: &'static str, change: fn(&mut Drive)) -> Situation {
    Situation { name, change, is_z_down: false }
}

fn simulated() {
    let sensors = Sensor::ALL.map(|sensor| sensor.to_string()).join(" | ");
    println!("| Scene | situation | {sensors} |\n| --- | --- |{}", " ---: |".repeat(4));
    for scene in Scene::ALL {
        for situation in &SITUATIONS {
            let cells = Sensor::ALL.map(|sensor| {
                let scores: Vec<_> = SEEDS.map(|s| sweep(sensor, scene, s, situation)).collect();
                let [f1, precision, recall] = mean(&scores);
                format!("{f1:.1} ({precision:.1}, {recall:.1})")
            });
            println!("| {scene} | {} | {} |", situation.name, cells.join(" | "));
        }
    }
}

fn sweep(sensor: Sensor, scene: Scene, seed: u64, situation: &Situation) -> [f64; 3] {
    let mut drive = Drive::new(sensor, scene, seed);
    (situation.change)(&mut drive);
    let mut cloud = drive.frame(7 * (seed as usize % 10)).cloud;
    if situation.is_z_down {
        cloud.y.iter_mut().chain(&mut cloud.z).for_each(|along| *along = -*along);
    }
    let truth = cloud.class.take().unwrap_or_default();
    score(&cloud, &truth)
}

fn fast() {
    for scene in Scene::ALL {
        for situation in [0, 3, 8, 11] {
            let cells = Sensor::ALL.map(|sensor| {
                let scores: Vec<_> =
                    (201..202).map(|s| sweep(sensor, scene, s, &SITUATIONS[situation])).collect();
                let [f1, precision, recall] = mean(&scores);
                format!("{f1:.1} ({precision:.1}, {recall:.1})")
            });
            println!("| {scene} | {} | {} |", SITUATIONS[situation].name, cells.join(" | "));
        }
    }
}
