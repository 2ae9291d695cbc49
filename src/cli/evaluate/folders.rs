//! Scores of folders of label files.

use std::path::Path;

use anyhow::{Result, bail};
use serde::Serialize;

use super::arguments::Arguments;
use super::scores::{print, refuse};
use crate::cli::output::OutputFile;
use crate::cli::progress::frame_bar;
use crate::datasets::semantic_kitti::label_pairs::{LabelPair, label_pairs};
use crate::datasets::semantic_kitti::{read_labels, read_scan};
use crate::evaluate::{Evaluation, MetricSet, SCAN_STEP_NS, ScanLabels, Scores};

/// The JSON file.
#[derive(Serialize)]
struct FolderScores<'a> {
    truth: &'a Path,
    predictions: &'a Path,
    taxonomy: &'a str,
    min_points: u64,
    #[serde(flatten)]
    figures: &'a Scores,
}

pub fn run(
    arguments: &Arguments,
    roots: [&Path; 2],
    metrics: &MetricSet,
    json: Option<&OutputFile>,
) -> Result<()> {
    let [truth, predictions] = roots;
    let (pairs, problems) = label_pairs(roots, &arguments.sequences, arguments.entropy)?;
    refuse(problems)?;
    let mut sums = Evaluation::new(*metrics);
    let bar = frame_bar("scoring", pairs.len() as u64);
    for of_sequence in pairs.chunk_by(|a, b| a.sequence == b.sequence) {
        for (time_ns, pair) in (0..).step_by(SCAN_STEP_NS as usize).zip(of_sequence) {
            add(time_ns, pair, &mut sums)?;
            bar.inc(1);
        }
        sums.end_sequence();
    }
    bar.finish_and_clear();
    let figures = sums.scores();
    print(&figures);
    if let Some(json) = json {
        let (taxonomy, min_points) = (metrics.taxonomy.name.as_str(), metrics.min_points);
        let figures = &figures;
        let value = FolderScores { truth, predictions, taxonomy, min_points, figures };
        json.write_json(&value)?;
    }
    Ok(())
}

fn add(time_ns: u64, pair: &LabelPair, sums: &mut Evaluation) -> Result<()> {
    let read = |path: &Path| Ok::<_, crate::Error>(ScanLabels::of_words(read_labels(path)?));
    let (truth, found) = (read(&pair.truth)?, read(&pair.prediction)?);
    let cloud = pair.scan.as_deref().map(read_scan).transpose()?;
    let (points, of_truth) = (found.class.len(), truth.class.len());
    let scan = cloud.as_ref().map_or(of_truth, |cloud| cloud.len());
    if points != of_truth || scan != of_truth {
        bail!("{}: the files have changed since they were checked", pair.truth.display());
    }
    let [own, other] = [&pair.prediction, &pair.truth].map(|path| path.display().to_string());
    Ok(sums.add(time_ns, (&found, &own), (&truth, &other), cloud.as_ref())?)
}
