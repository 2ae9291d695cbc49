//! Ground removal against truth: `cargo run --release --example 04_ground -- ../shared/data/semantickitti`
//!
//! Ground is road, lane marking, parking, sidewalk, other ground and terrain; points of vegetation and
//! points without a label are left out on both sides, as the field does.

use std::path::Path;

use anyhow::{Context, Result};
use divmerge::io::semantic_kitti::{LabelledScan, labelled_scans, read_labels, read_scan};
use divmerge::range_image::{ProjectionParams, RangeImage};
use divmerge::semantics::GroundParams;
use divmerge::semantics::ground::ground;

const GROUND: [u32; 6] = [40, 44, 48, 49, 60, 72];
const LEFT_OUT: [u32; 5] = [0, 1, 52, 70, 99];

fn main() -> Result<()> {
    let root = std::env::args().nth(1).context("give the folder that holds `sequences`")?;
    println!("| Sequence | scans | F1 | precision | recall |\n| --- | ---: | ---: | ---: | ---: |");
    let mut all = Vec::new();
    let scans = labelled_scans(Path::new(&root))?;
    for sequence in scans.chunk_by(|a, b| a.sequence == b.sequence) {
        let scores = sequence.iter().map(score).collect::<Result<Vec<_>>>()?;
        print_row(&sequence[0].sequence, &scores);
        all.extend(scores);
    }
    print_row("all", &all);
    Ok(())
}

/// F1, precision and recall of one scan in percent.
fn score(labelled: &LabelledScan) -> Result<[f64; 3]> {
    let cloud = read_scan(&labelled.scan)?;
    let image = RangeImage::new(&cloud, &ProjectionParams::default());
    let found = ground(&cloud, &image, &GroundParams::default());
    let (mut hits, mut extra, mut missed) = (0.0, 0.0, 0.0);
    for (word, found) in read_labels(&labelled.labels)?.into_iter().zip(found) {
        let class = word & 0xffff;
        match (GROUND.contains(&class), found) {
            _ if LEFT_OUT.contains(&class) => {}
            (true, true) => hits += 1.0,
            (false, true) => extra += 1.0,
            (true, false) => missed += 1.0,
            (false, false) => {}
        }
    }
    let (precision, recall) = (hits / (hits + extra), hits / (hits + missed));
    let f1 = 2.0 * precision * recall / (precision + recall);
    Ok([f1, precision, recall].map(|share| share * 100.0))
}

fn print_row(name: &str, scores: &[[f64; 3]]) {
    let mean = |i: usize| scores.iter().map(|score| score[i]).sum::<f64>() / scores.len() as f64;
    println!("| {name} | {} | {:.2} | {:.2} | {:.2} |", scores.len(), mean(0), mean(1), mean(2));
}
