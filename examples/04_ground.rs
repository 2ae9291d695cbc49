//! Ground removal against truth: `cargo run --release --example 04_ground --
//! ../shared/data/semantickitti`
//!
//! Without a folder only the simulated scenes are measured. Ground is road, lane marking, parking,
//! sidewalk, other ground and terrain; points of vegetation and points without a label are left out
//! on both sides, as the field does. Drops of rain and mirrored returns of simulated scenes are no
//! ground.
//!
//! Cells of simulated sweeps: F1 (precision, recall), mean over the seeds. Cells of the reliability
//! tables: mean confidence: share of ground found (share of all points), in percent.

use std::f64::consts::PI;
use std::path::Path;

use anyhow::Result;
use divmerge::PointCloud;
use divmerge::datasets::semantic_kitti::{LabelledScan, labelled_scans, read_labels, read_scan};
use divmerge::range_image::{ProjectionParams, RangeImage};
use divmerge::semantics::GroundParams;
use divmerge::semantics::ground::ground;
use divmerge::simulate::{Clutter, Drive, Scene, Sensor};

const GROUND: [u16; 6] = [40, 44, 48, 49, 60, 72];
const LEFT_OUT: [u16; 4] = [0, 52, 70, 99];
/// Left out in real scans only, where it says nothing about the place of a point.
const OUTLIER: u16 = 1;
const SEEDS: std::ops::Range<u64> = 201..204;
/// Drives that the curves of the confidence were fitted to.
const FITTED: [&str; 3] = ["00", "03", "05"];

fn main() -> Result<()> {
    if let Some(root) = std::env::args().nth(1) {
        real(Path::new(&root))?;
    }
    simulated();
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
    let [fitted, held_out] = [true, false].map(|is_fitted| {
        let drives = all.iter().zip(&scans);
        let drives =
            drives.filter(|(_, scan)| FITTED.contains(&scan.sequence.as_str()) == is_fitted);
        Reliability::of(drives.map(|(score, _)| score))
    });
    print_reliability(&[("drives fitted to", fitted), ("other drives", held_out)]);
    Ok(())
}

/// Points of ground and others by confidence, in tenths.
#[derive(Debug, Clone, Copy, Default)]
struct Reliability([Bin; 10]);

#[derive(Debug, Clone, Copy, Default)]
struct Bin {
    points: f64,
    ground: f64,
    confidence: f64,
}

impl Reliability {
    fn add(&mut self, confidence: f32, is_ground: bool) {
        let bin = &mut self.0[((confidence * 10.0) as usize).min(9)];
        bin.points += 1.0;
        bin.ground += f64::from(u8::from(is_ground));
        bin.confidence += f64::from(confidence);
    }

    fn of<'a>(scores: impl Iterator<Item = &'a Score>) -> Reliability {
        scores.fold(Reliability::default(), |mut sum, score| {
            for (sum, bin) in sum.0.iter_mut().zip(score.reliability.0) {
                sum.points += bin.points;
                sum.ground += bin.ground;
                sum.confidence += bin.confidence;
            }
            sum
        })
    }

    fn points(&self) -> f64 {
        self.0.iter().map(|bin| bin.points).sum()
    }

    /// Expected calibration error: mean distance of confidence and share of ground over the points.
    fn error(&self) -> f64 {
        self.0.iter().map(|bin| (bin.ground - bin.confidence).abs()).sum::<f64>() / self.points()
    }
}

fn print_reliability(columns: &[(&str, Reliability)]) {
    let names: Vec<&str> = columns.iter().map(|column| column.0).collect();
    println!("| Confidence | {} |\n| --- |{}", names.join(" | "), " ---: |".repeat(columns.len()));
    for bin in 0..10 {
        let cells = columns.iter().map(|(_, of)| {
            let Bin { points, ground, confidence } = of.0[bin];
            let [said, found] = [confidence, ground].map(|sum| 100.0 * sum / points);
            format!("{said:.0}: {found:.1} ({:.2})", 100.0 * points / of.points())
        });
        let cells: Vec<String> = cells.collect();
        println!("| {}0 to {}0 % | {} |", bin, bin + 1, cells.join(" | "));
    }
    let errors = columns.iter().map(|(_, of)| format!("{:.2}", 100.0 * of.error()));
    println!("| expected calibration error | {} |\n", errors.collect::<Vec<_>>().join(" | "));
}

/// F1, precision and recall in percent, and the reliability of the confidence, of one cloud.
struct Score {
    percent: [f64; 3],
    reliability: Reliability,
}

fn score_scan(labelled: &LabelledScan) -> Result<Score> {
    let cloud = read_scan(&labelled.scan)?;
    let words = read_labels(&labelled.labels)?.into_iter();
    let truth = words.map(|word| Some(word as u16).filter(|&class| class != OUTLIER));
    Ok(score(&cloud, &truth.map(|class| class.unwrap_or(0)).collect::<Vec<u16>>()))
}

fn score(cloud: &PointCloud, truth: &[u16]) -> Score {
    let image = RangeImage::new(cloud, &ProjectionParams::default());
    let found = ground(cloud, &image, &GroundParams::default());
    let mut reliability = Reliability::default();
    let (mut hits, mut extra, mut missed) = (0.0, 0.0, 0.0);
    for (point, class) in truth.iter().enumerate().filter(|(_, class)| !LEFT_OUT.contains(class)) {
        let is_ground = GROUND.contains(class);
        reliability.add(found.confidence[point], is_ground);
        match (is_ground, found.is_ground[point]) {
            (true, true) => hits += 1.0,
            (false, true) => extra += 1.0,
            (true, false) => missed += 1.0,
            (false, false) => {}
        }
    }
    let share = |of: f64| if of > 0.0 { hits / of } else { 0.0 };
    let shares = [share(hits + 0.5 * (extra + missed)), share(hits + extra), share(hits + missed)];
    Score { percent: shares.map(|share| share * 100.0), reliability }
}

fn mean(scores: &[Score]) -> [f64; 3] {
    let sum = |i: usize| scores.iter().map(|score| score.percent[i]).sum::<f64>();
    [0, 1, 2].map(|i| sum(i) / scores.len() as f64)
}

fn print_row(name: &str, scores: &[Score]) {
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
    let sensors = Sensor::USUAL.map(|sensor| sensor.to_string()).join(" | ");
    let mut by_sensor = Sensor::USUAL.map(|_| Vec::new());
    let mut summary = Vec::new();
    println!("| Scene | situation | {sensors} |\n| --- | --- |{}", " ---: |".repeat(4));
    for scene in Scene::USUAL {
        let mut figures: Vec<[f64; 4]> = Vec::new();
        for situation in &SITUATIONS {
            let mut cells = Vec::new();
            let mut all_f1 = [0.0; 4];
            let sensors = Sensor::USUAL.into_iter().zip(&mut by_sensor);
            for ((sensor, all), own_f1) in sensors.zip(&mut all_f1) {
                let scores: Vec<_> = SEEDS.map(|s| sweep(sensor, scene, s, situation)).collect();
                let [f1, precision, recall] = mean(&scores);
                cells.push(format!("{f1:.1} ({precision:.1}, {recall:.1})"));
                *own_f1 = f1;
                all.extend(scores);
            }
            figures.push(all_f1);
            println!("| {scene} | {} | {} |", situation.name, cells.join(" | "));
        }
        summary.push(format!("| {scene} | {} |", usual_and_lowest(&figures).join(" | ")));
    }
    println!();
    println!("| Usual; lowest | {sensors} |\n| --- |{}", " ---: |".repeat(4));
    summary.iter().for_each(|row| println!("{row}"));
    println!();
    let names = Sensor::USUAL.map(|sensor| sensor.to_string());
    let reliabilities = by_sensor.map(|scores| Reliability::of(scores.iter()));
    let columns = names.iter().map(String::as_str).zip(reliabilities);
    print_reliability(&columns.collect::<Vec<_>>());
}

/// For each sensor the F1 of the first situation, and the lowest with its situation.
fn usual_and_lowest(figures: &[[f64; 4]]) -> [String; 4] {
    std::array::from_fn(|sensor| {
        let of_sensor = || figures.iter().map(|row| row[sensor]).zip(&SITUATIONS);
        let lowest = of_sensor().min_by(|a, b| a.0.total_cmp(&b.0));
        let lowest = lowest.map_or(String::new(), |(f1, s)| format!("{f1:.1} ({})", s.name));
        format!("{:.1}; {lowest}", figures[0][sensor])
    })
}

fn sweep(sensor: Sensor, scene: Scene, seed: u64, situation: &Situation) -> Score {
    let mut drive = Drive::new(sensor, scene, seed);
    (situation.change)(&mut drive);
    let mut columns = drive.frame(7 * (seed as usize % 10)).cloud.into_columns();
    if situation.is_z_down {
        columns.y.iter_mut().chain(&mut columns.z).for_each(|along| *along = -*along);
    }
    let truth = columns.class.take().unwrap_or_default();
    score(&columns.checked().expect("as many of each"), &truth)
}
