//! Label files against label files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use divmerge::evaluate::{Evaluation, MetricSet, ScanLabels, Scores};
use divmerge::io::semantic_kitti::{label_files, read_labels, read_scan};
use serde::Serialize;

use super::{Arguments, print, refuse, write_json};
use crate::terminal::frame_bar;

/// A scan of the truth and its prediction.
struct Pair {
    sequence: String,
    truth: PathBuf,
    prediction: PathBuf,
    /// Where positions are asked for.
    scan: Option<PathBuf>,
}

/// What goes into the JSON file.
#[derive(Serialize)]
struct Written<'a> {
    truth: &'a Path,
    predictions: &'a Path,
    taxonomy: &'a str,
    min_points: u64,
    #[serde(flatten)]
    figures: &'a Scores,
}

pub fn run(arguments: &Arguments, roots: [&Path; 2], metrics: &MetricSet) -> Result<()> {
    let [truth, predictions] = roots;
    let pairs = pairs(arguments, roots)?;
    let mut sums = Evaluation::new(*metrics);
    let bar = frame_bar("scoring", pairs.len() as u64);
    for of_sequence in pairs.chunk_by(|a, b| a.sequence == b.sequence) {
        for pair in of_sequence {
            add(pair, &mut sums)?;
            bar.inc(1);
        }
        sums.end_sequence();
    }
    bar.finish_and_clear();
    let figures = sums.scores();
    print(&figures);
    if let Some(path) = &arguments.json {
        let (taxonomy, min_points) = (metrics.taxonomy.name.as_str(), metrics.min_points);
        let figures = &figures;
        write_json(path, &Written { truth, predictions, taxonomy, min_points, figures })?;
    }
    Ok(())
}

fn add(pair: &Pair, sums: &mut Evaluation) -> Result<()> {
    let read = |path: &Path| Ok::<_, divmerge::Error>(ScanLabels::of_words(read_labels(path)?));
    let (truth, found) = (read(&pair.truth)?, read(&pair.prediction)?);
    let cloud = pair.scan.as_deref().map(read_scan).transpose()?;
    let (points, of_truth) = (found.class.len(), truth.class.len());
    let scan = cloud.as_ref().map_or(of_truth, |cloud| cloud.len());
    if points != of_truth || scan != of_truth {
        bail!("{}: the files changed while they were read", pair.truth.display());
    }
    let [own, other] = [&pair.prediction, &pair.truth].map(|path| path.display().to_string());
    Ok(sums.add((&found, &own), (&truth, &other), cloud.as_ref())?)
}

/// Every scan of the chosen sequences with its prediction, or an error that names what does not fit.
fn pairs(arguments: &Arguments, [root, of_predictions]: [&Path; 2]) -> Result<Vec<Pair>> {
    let truth = by_scan(root, "labels", &arguments.sequences)?;
    let mut predictions = by_scan(of_predictions, "predictions", &arguments.sequences)?;
    if predictions.is_empty() {
        predictions = by_scan(of_predictions, "labels", &arguments.sequences)?;
    }
    if truth.is_empty() {
        bail!("no sequences/NN/labels/*.label under {}", root.display());
    }
    let mut problems = Vec::new();
    for sequence in &arguments.sequences {
        if !truth.keys().any(|(name, _)| name == sequence) {
            problems.push(format!("no truth for sequence {sequence}"));
        }
    }
    for (scan, path) in &predictions {
        if !truth.contains_key(scan) {
            problems.push(format!("{}: a prediction without truth", path.display()));
        }
    }
    let mut pairs = Vec::with_capacity(truth.len());
    for ((sequence, name), truth) in truth {
        let Some(prediction) = predictions.remove(&(sequence.clone(), name)) else {
            problems.push(format!("{}: no prediction for it", truth.display()));
            continue;
        };
        let (expected, found) = (bytes(&truth)?, bytes(&prediction)?);
        if expected % 4 != 0 {
            problems.push(format!("{}: {expected} bytes are no multiple of 4", truth.display()));
        }
        if expected != found {
            let path = prediction.display();
            problems.push(format!("{path}: {found} bytes where the truth has {expected}"));
        }
        let scan = arguments.entropy.then(|| scan_of(&truth));
        problems.extend(scan.as_deref().and_then(|scan| scan_problem(scan, expected / 4)));
        pairs.push(Pair { sequence, truth, prediction, scan });
    }
    refuse(problems)?;
    Ok(pairs)
}

/// `velodyne/NNNNNN.bin` beside `labels/NNNNNN.label`.
fn scan_of(truth: &Path) -> PathBuf {
    let folder = truth.parent().and_then(Path::parent).unwrap_or(Path::new(""));
    let name = truth.with_extension("bin");
    folder.join("velodyne").join(name.file_name().unwrap_or_default())
}

fn scan_problem(scan: &Path, points: u64) -> Option<String> {
    match std::fs::metadata(scan) {
        Err(error) => Some(format!("{}: {error}", scan.display())),
        Ok(file) if file.len() != points * 16 => Some(format!(
            "{}: {} bytes where {points} points have {}",
            scan.display(),
            file.len(),
            points * 16
        )),
        Ok(_) => None,
    }
}

fn bytes(path: &Path) -> Result<u64> {
    let file = std::fs::metadata(path).with_context(|| path.display().to_string())?;
    Ok(file.len())
}

/// Label files by sequence and file name.
fn by_scan(
    root: &Path,
    kind: &str,
    sequences: &[String],
) -> Result<BTreeMap<(String, String), PathBuf>> {
    let files = label_files(root, kind)?.into_iter();
    let chosen = files.filter(|(name, _)| sequences.is_empty() || sequences.contains(name));
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(chosen.map(|(sequence, path)| ((sequence, name(&path)), path)).collect())
}
