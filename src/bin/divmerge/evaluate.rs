//! `divmerge evaluate`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use divmerge::Taxonomy;
use divmerge::evaluate::panoptic::MIN_POINTS;
use divmerge::evaluate::{Panoptic, PanopticQuality, Report};
use divmerge::io::semantic_kitti::{label_files, read_labels};
use serde::Serialize;

use crate::Outcome;
use crate::terminal::{frame_bar, grouped};

/// Score label files against the truth, as semantic-kitti-api does
///
/// Both folders hold `sequences/NN/`; the truth is under `labels/`, the predictions of any method under
/// `predictions/` (or `labels/`), a `.label` file a scan: class in the low 16 bits of a word, instance in the
/// high. Figures are those of evaluate_panoptic.py: a segment's id is its whole word, points whose true class is
/// ignored leave first, absent classes count 0 in the means.
///
/// Every scan of the truth needs a prediction of as many points, and every prediction a truth; else nothing
/// is scored and each file at fault is named.
#[derive(Args)]
pub struct Arguments {
    /// Folder of the truth: sequences/NN/labels/*.label
    #[arg(long, value_name = "ROOT")]
    truth: PathBuf,

    /// Folder of the predictions: sequences/NN/predictions/*.label
    #[arg(long, value_name = "ROOT")]
    predictions: PathBuf,

    /// Only these sequences, such as 00,04 (default: those that have truth)
    #[arg(long, value_delimiter = ',', value_name = "NN,...")]
    sequences: Vec<String>,

    /// Unmatched segments of fewer points are neither spurious nor missed
    #[arg(long, default_value_t = MIN_POINTS, value_name = "POINTS")]
    min_points: u64,

    /// Classes from a YAML file in semantic-kitti-api's form (default: SemanticKITTI's)
    #[arg(long, value_name = "FILE")]
    taxonomy: Option<PathBuf>,

    /// Write the figures here, in full precision
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Named problems are cut off after this many.
const NAMED: usize = 10;

/// A scan of the truth and its prediction.
struct Pair {
    truth: PathBuf,
    prediction: PathBuf,
}

/// What goes into the JSON file.
#[derive(Serialize)]
struct Written<'a> {
    truth: &'a Path,
    predictions: &'a Path,
    taxonomy: &'a str,
    min_points: u64,
    scans: usize,
    points: u64,
    #[serde(flatten)]
    report: &'a Report,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let taxonomy = match &arguments.taxonomy {
        Some(path) => Taxonomy::from_yaml_file(path)?,
        None => Taxonomy::semantic_kitti(),
    };
    let pairs = pairs(arguments)?;
    let mut scores = Panoptic::of(&taxonomy, arguments.min_points);
    let class_of = class_of(&taxonomy);
    let mut points = 0;
    let bar = frame_bar("scoring", pairs.len() as u64);
    for pair in &pairs {
        points += add(pair, &class_of, &taxonomy.name, &mut scores)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    let report = Report::new(&scores, &taxonomy);
    println!("{} scans, {} points", grouped(pairs.len() as u64), grouped(points));
    print(&report);
    if let Some(path) = &arguments.json {
        let written = Written {
            truth: &arguments.truth,
            predictions: &arguments.predictions,
            taxonomy: &taxonomy.name,
            min_points: arguments.min_points,
            scans: pairs.len(),
            points,
            report: &report,
        };
        let text = serde_json::to_string_pretty(&written)? + "\n";
        std::fs::write(path, text).with_context(|| path.display().to_string())?;
    }
    Ok(Outcome::Done)
}

/// Every scan of the chosen sequences with its prediction, or an error that names what does not fit.
fn pairs(arguments: &Arguments) -> Result<Vec<Pair>> {
    let truth = by_scan(&arguments.truth, "labels", &arguments.sequences)?;
    let mut predictions = by_scan(&arguments.predictions, "predictions", &arguments.sequences)?;
    if predictions.is_empty() {
        predictions = by_scan(&arguments.predictions, "labels", &arguments.sequences)?;
    }
    let mut problems = Vec::new();
    for sequence in &arguments.sequences {
        if !truth.keys().any(|(name, _)| name == sequence) {
            problems.push(format!("no truth for sequence {sequence}"));
        }
    }
    if truth.is_empty() {
        bail!("no sequences/NN/labels/*.label under {}", arguments.truth.display());
    }
    for (scan, path) in &predictions {
        if !truth.contains_key(scan) {
            problems.push(format!("{}: a prediction without truth", path.display()));
        }
    }
    let mut pairs = Vec::with_capacity(truth.len());
    for (scan, truth) in truth {
        let Some(prediction) = predictions.remove(&scan) else {
            problems.push(format!("{}: no prediction for it", truth.display()));
            continue;
        };
        let bytes = |path: &Path| {
            std::fs::metadata(path)
                .map(|file| file.len())
                .with_context(|| path.display().to_string())
        };
        let (expected, found) = (bytes(&truth)?, bytes(&prediction)?);
        if expected != found {
            problems.push(format!(
                "{}: {found} bytes where the truth has {expected}",
                prediction.display()
            ));
        }
        pairs.push(Pair { truth, prediction });
    }
    if problems.is_empty() {
        return Ok(pairs);
    }
    let count = problems.len();
    let more = count.saturating_sub(NAMED);
    problems.truncate(NAMED);
    if more > 0 {
        problems.push(format!("and {more} more"));
    }
    bail!("nothing scored, {count} problems:\n  {}", problems.join("\n  "))
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

/// Adds a scan to the scores; returns its points.
fn add(
    pair: &Pair,
    class_of: &[Option<u16>],
    taxonomy: &str,
    scores: &mut Panoptic,
) -> Result<u64> {
    let (truth, prediction) = (read_labels(&pair.truth)?, read_labels(&pair.prediction)?);
    if truth.len() != prediction.len() {
        bail!("{}: {} labels", pair.prediction.display(), prediction.len());
    }
    let true_class = classes(&truth, class_of, taxonomy, &pair.truth)?;
    let found_class = classes(&prediction, class_of, taxonomy, &pair.prediction)?;
    scores.add(&found_class, &prediction, &true_class, &truth);
    Ok(truth.len() as u64)
}

/// Class number for every possible raw id, `None` for those that the taxonomy does not know.
fn class_of(taxonomy: &Taxonomy) -> Vec<Option<u16>> {
    let mut class_of = vec![None; 1 << 16];
    for (id, class) in taxonomy.known_ids() {
        class_of[usize::from(id)] = Some(class);
    }
    class_of
}

/// Class numbers of label words; a class that the taxonomy of that name does not know is an error.
fn classes(
    words: &[u32],
    class_of: &[Option<u16>],
    taxonomy: &str,
    path: &Path,
) -> Result<Vec<u16>> {
    let class = |&word: &u32| class_of[(word & 0xffff) as usize].ok_or(word & 0xffff);
    words.iter().map(class).collect::<std::result::Result<Vec<u16>, u32>>().map_err(|unknown| {
        let count = words.iter().filter(|&&word| word & 0xffff == unknown).count();
        anyhow::anyhow!(
            "{}: class {unknown} ({} points) is not in taxonomy {}",
            path.display(),
            grouped(count as u64),
            taxonomy
        )
    })
}

fn print(report: &Report) {
    println!("class            PQ     SQ     RQ    IoU     found  spurious  missed   (%)");
    for class in &report.classes {
        let quality = &class.quality;
        let [pq, sq, rq, iou] =
            [quality.pq, quality.sq, quality.rq, quality.iou].map(|figure| figure * 100.0);
        println!(
            "{:<14} {pq:>5.1}  {sq:>5.1}  {rq:>5.1}  {iou:>5.1}  {:>8}  {:>8}  {:>6}{}",
            class.name,
            quality.true_positives,
            quality.false_positives,
            quality.false_negatives,
            if class.true_points == 0 { "   not in the truth" } else { "" }
        );
    }
    let line = |name: &str, mean: &PanopticQuality| {
        let [pq, sq, rq, iou] = [mean.pq, mean.sq, mean.rq, mean.miou].map(|figure| figure * 100.0);
        println!("{name:<14} {pq:>5.1}  {sq:>5.1}  {rq:>5.1}  {iou:>5.1}");
    };
    line("things", &report.things);
    line("stuff", &report.stuff);
    line("all", &report.all);
    println!("PQ-dagger      {:>5.1}", report.pq_dagger * 100.0);
}
