//! `divmerge evaluate`

mod folders;
mod recording;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use divmerge::Taxonomy;
use divmerge::evaluate::panoptic::MIN_POINTS;
use divmerge::evaluate::{MetricSet, PanopticQuality, Scores};
use divmerge::statistics::mean_and_deviation;
use serde::Serialize;

use crate::Outcome;
use crate::terminal::grouped;
use crate::truth::SourceArguments;

/// Score instances against the truth, as semantic-kitti-api does
///
/// Either an annotated recording (IN), whose clouds carry their truth in fields, as those of simulated drives do,
/// or have label files beside them (--labels): every annotated topic is scored, each on its own.
///
/// Or two folders (--truth, --predictions) that hold `sequences/NN/`: the truth under `labels/`, the predictions
/// of any method under `predictions/` (or `labels/`), a `.label` file a scan: class in the low 16 bits of a word,
/// instance in the high.
///
/// Figures are those of evaluate_panoptic.py: a segment's id is its whole word, points whose true class is
/// ignored leave first, absent classes count 0 in the means.
///
/// Every scan of the truth needs a prediction of as many points, every prediction a truth, and every class has to
/// be known; else nothing is scored and what is at fault is named.
#[derive(Args)]
pub struct Arguments {
    /// An annotated recording (MCAP)
    #[arg(
        value_name = "IN",
        required_unless_present = "truth",
        conflicts_with_all = ["truth", "predictions", "sequences"]
    )]
    input: Option<PathBuf>,

    /// Of a recording only this cloud topic; may be given more than once [default: every annotated one]
    #[arg(long, value_name = "T", requires = "input")]
    topic: Vec<String>,

    #[command(flatten)]
    of_recording: SourceArguments,

    /// Field of the found class in a recording
    #[arg(long, default_value = "semantic", value_name = "NAME")]
    class_field: String,

    /// Field of the found instance in a recording
    #[arg(long, default_value = "instance", value_name = "NAME")]
    instance_field: String,

    /// Folder of the truth: sequences/NN/labels/*.label
    #[arg(long, value_name = "ROOT", requires = "predictions", conflicts_with = "labels")]
    truth: Option<PathBuf>,

    /// Folder of the predictions: sequences/NN/predictions/*.label
    #[arg(long, value_name = "ROOT", requires = "truth")]
    predictions: Option<PathBuf>,

    /// Only these sequences, such as 00,04 (default: those that have truth)
    #[arg(long, value_delimiter = ',', value_name = "NN,...")]
    sequences: Vec<String>,

    /// Unmatched segments of fewer points are neither spurious nor missed
    #[arg(long, default_value_t = MIN_POINTS, value_name = "POINTS")]
    min_points: u64,

    /// Classes from a YAML file in semantic-kitti-api's form (default: SemanticKITTI's)
    #[arg(long, value_name = "FILE")]
    taxonomy: Option<PathBuf>,

    /// Also over- and under-segmentation entropy (OSE, USE), for which classes do not matter; of folders the
    /// truth needs its scans beside it: sequences/NN/velodyne/*.bin
    #[arg(long)]
    entropy: bool,

    /// Also LSTQ and its association and classification parts (Aygün et al. 2021), for predictions whose
    /// instance ids are meant to last from frame to frame of a sequence or topic
    #[arg(long)]
    over_time: bool,

    /// Write the figures here, in full precision
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Named problems are cut off after this many.
const NAMED: usize = 10;

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    arguments.json.as_deref().map_or(Ok(()), crate::refuse_address)?;
    let taxonomy = match &arguments.taxonomy {
        Some(path) => divmerge::taxonomy_file::read_taxonomy(path)?,
        None => Taxonomy::semantic_kitti(),
    };
    let metrics = MetricSet {
        taxonomy: &taxonomy,
        min_points: arguments.min_points,
        entropy: arguments.entropy,
        over_time: arguments.over_time,
    };
    match (&arguments.input, &arguments.truth, &arguments.predictions) {
        (Some(input), ..) => recording::run(arguments, input, &metrics)?,
        (None, Some(truth), Some(predictions)) => {
            folders::run(arguments, [truth, predictions], &metrics)?;
        }
        _ => unreachable!("one of the two is required"),
    }
    Ok(Outcome::Done)
}

/// Refuses to score anything if there are problems, and names them.
fn refuse(mut problems: Vec<String>) -> Result<()> {
    let count = problems.len();
    if count == 0 {
        return Ok(());
    }
    let more = count.saturating_sub(NAMED);
    problems.truncate(NAMED);
    if more > 0 {
        problems.push(format!("and {more} more"));
    }
    let plural = if count == 1 { "problem" } else { "problems" };
    bail!("nothing scored, {count} {plural}:\n  {}", problems.join("\n  "))
}

/// Writes figures as JSON, over what is there.
pub fn write_json(path: &Path, written: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(written)? + "\n";
    std::fs::write(path, text).with_context(|| path.display().to_string())
}

fn print(figures: &Scores) {
    println!("{} scans, {} points", grouped(figures.scans), grouped(figures.points));
    let report = &figures.report;
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
    if let Some(entropies) = &figures.entropy {
        let line = |name: &str, figures: Vec<f64>| {
            let (mean, deviation) = mean_and_deviation(&figures);
            println!("{name:<14} {mean:>5.1} +- {deviation:.1} nats a scan");
        };
        line("OSE", entropies.iter().map(|of| of.over).collect());
        line("USE", entropies.iter().map(|of| of.under).collect());
        line("USE and ground", entropies.iter().map(|of| of.under_with_ground).collect());
    }
    if let Some(lstq) = &figures.over_time {
        let [all, assoc, cls] = [lstq.lstq, lstq.s_assoc, lstq.s_cls].map(|figure| figure * 100.0);
        println!("LSTQ           {all:>5.1}   S_assoc {assoc:.1}   S_cls {cls:.1}");
        for class in &lstq.classes {
            let (assoc, tubes) = (class.s_assoc * 100.0, class.tubes);
            println!("  {:<12} {assoc:>5.1}   {} objects over time", class.name, grouped(tubes));
        }
    }
}
