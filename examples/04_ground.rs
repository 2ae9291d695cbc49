//! Ground removal against truth: `cargo run --release --example 04_ground -- ../shared/data/semantickitti`
//!
//! Ground is road, lane marking, parking, sidewalk, other ground and terrain; points of vegetation and
//! points without a label are left out on both sides, as the field does.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use divmerge::io::semantic_kitti::{read_labels, read_scan};
use divmerge::range_image::{ProjectionParams, RangeImage};
use divmerge::semantics::GroundParams;
use divmerge::semantics::ground::ground;

const GROUND: [u32; 6] = [40, 44, 48, 49, 60, 72];
const LEFT_OUT: [u32; 5] = [0, 1, 52, 70, 99];

fn main() -> Result<()> {
    let root = std::env::args().nth(1).context("give the folder that holds `sequences`")?;
    println!("| Sequence | scans | F1 | precision | recall |\n| --- | ---: | ---: | ---: | ---: |");
    let mut all = Vec::new();
    for sequence in entries(&Path::new(&root).join("sequences"))? {
        let mut scores = Vec::new();
        for scan in entries(&sequence.join("velodyne"))? {
            let name = scan.with_extension("label");
            let label = sequence.join("labels").join(name.file_name().context("scan name")?);
            scores.push(score(&scan, &label)?);
        }
        print_row(&sequence.file_name().unwrap_or_default().to_string_lossy(), &scores);
        all.extend(scores);
    }
    print_row("all", &all);
    Ok(())
}

/// F1, precision and recall of one scan in percent.
fn score(scan: &Path, label: &Path) -> Result<[f64; 3]> {
    let cloud = read_scan(scan)?;
    let image = RangeImage::new(&cloud, &ProjectionParams::default());
    let found = ground(&cloud, &image, &GroundParams::default());
    let (mut hits, mut extra, mut missed) = (0.0, 0.0, 0.0);
    for (word, found) in read_labels(label)?.into_iter().zip(found) {
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

fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let list =
        std::fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))?;
    let mut paths = list.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}
