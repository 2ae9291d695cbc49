//! `divmerge failures`

mod row;
mod text;

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use row::{Commands, Row};

use crate::annotate::AnnotateConfig;
use crate::cli::arguments::method::MethodArguments;
use crate::cli::arguments::truth::CloudArguments;
use crate::cli::exit::Outcome;
use crate::cli::output::Outputs;
use crate::cli::progress::frame_bar;
use crate::diagnose::explain::ClusteredCloud;
use crate::diagnose::failures::{Failure, FailureSummary, LabelledRun, check_classes, failures};
use crate::diagnose::triage::ranking::recorded_positions;
use crate::evaluate::panoptic::MIN_POINTS;
use crate::frames::LabelledFrame;
use crate::pipeline;

/// List the objects that the clustering gets wrong, with the cause of each
///
/// Every true object and every found instance gets a verdict: correct (same class, IoU above one
/// half), wrong class, over-segmented, under-segmented, missed or spurious. For each failure the
/// method runs again with one step after the other replaced by a perfect one, to find the step that
/// lost the object: mask (the semantics), projection (its points are shadowed), divide (a component
/// covers two objects, or pixels are not reached), merge (a vote, named) or post (bird's-eye, size
/// or gap merge, minimum size). For other methods than divide and merge: mask, projection or the
/// method itself.
///
/// The failures with the most points come first.
///
/// IN is a recording whose clouds have fields of truth, such as a simulated one, or label files; or
/// a folder in SemanticKITTI's form (sequences/NN/velodyne and labels).
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    clouds: CloudArguments,

    #[command(flatten)]
    method: MethodArguments,

    /// Unmatched objects of fewer points are not failures
    #[arg(long, default_value_t = MIN_POINTS, value_name = "POINTS")]
    small: u64,

    /// Maximum number of failures to print; the files have all of them
    #[arg(long, default_value_t = 20, value_name = "N")]
    limit: usize,

    /// Write all failures to this file, one on each line
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,

    /// Write counts and all failures with every number to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

/// The JSON file.
#[derive(Serialize)]
struct FailuresJson<'a> {
    input: &'a Path,
    method: &'a str,
    preset: &'a str,
    taxonomy: &'a str,
    min_points: u64,
    #[serde(flatten)]
    summary: &'a FailureSummary,
    failures: &'a [Row],
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let inputs = arguments.clouds.files().chain(arguments.method.files());
    let mut outputs = Outputs::new(inputs, arguments.force);
    let csv = outputs.optional(arguments.csv.as_deref())?;
    let json = outputs.optional(arguments.json.as_deref())?;
    let clouds = &arguments.clouds;
    let method = arguments.method.config_with_warnings(&clouds.input, clouds.topic.as_slice())?;
    let frames = arguments.clouds.open(&method)?;
    let bar = frame_bar("searching", frames.remaining());
    let (mut summary, mut rows) = (FailureSummary::default(), Vec::new());
    let keeps_all = csv.is_some() || json.is_some();
    for frame in frames {
        let frame = frame.map_err(|error| arguments.clouds.with_hint(error))?;
        rows.extend(of_frame(arguments, &method, frame, &mut summary)?);
        rows.sort_by_key(|row: &Row| std::cmp::Reverse(row.failure.judged.points));
        if !keeps_all {
            rows.truncate(arguments.limit);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    let (limit, small) = (arguments.limit, arguments.small);
    text::print(&summary, &rows, &arguments.clouds.input, limit, small);
    if let Some(csv) = csv {
        csv.write(row::csv(&rows).as_bytes())?;
    }
    if let Some(json) = json {
        let value = FailuresJson {
            input: &arguments.clouds.input,
            method: method.pipeline.method_name(),
            preset: method.pipeline.preset,
            taxonomy: &method.taxonomy.name,
            min_points: arguments.small,
            summary: &summary,
            failures: &rows,
        };
        json.write_json(&value)?;
    }
    Ok(Outcome::Done)
}

/// The failures of a frame, which is added to the summary.
fn of_frame(
    arguments: &Arguments,
    method: &AnnotateConfig,
    mut frame: LabelledFrame,
    summary: &mut FailureSummary,
) -> Result<Vec<Row>> {
    method.prepare(&mut frame)?;
    let detections = method.detections(&frame)?;
    let LabelledFrame { source, number, log_time_ns, cloud, truth, .. } = &frame;
    let at = format!("{}: cloud {number} of {source}", arguments.clouds.input.display());
    check_classes(&truth.class, &method.taxonomy, &at)?;
    let (mask, config) = (method.mask(cloud), &method.pipeline);
    let stages = pipeline::run_with(cloud, mask, &detections, config);
    let found = failures(&LabelledRun {
        frame: ClusteredCloud { cloud, mask, config, stages: &stages },
        detections: &detections,
        true_class: &truth.class,
        true_id: &truth.id,
        taxonomy: &method.taxonomy,
        min_points: arguments.small,
    });
    summary.add(&found);
    let commands = Commands {
        input: &arguments.clouds.input,
        topic: arguments.clouds.topic.as_deref(),
        source,
        number: *number,
        method: arguments.method.words(),
    };
    let columns = stages.image.columns();
    let row = |failure: Failure| {
        let at = recorded_positions(cloud, &failure.show);
        let at: Vec<[f32; 3]> = at.iter().map(|at| at.map(|along| along as f32)).collect();
        let pixels = failure.pixels.as_ref();
        Row {
            topic: source.clone(),
            frame: *number,
            log_time_ns: (*log_time_ns != 0).then_some(*log_time_ns),
            cause_in_words: failure.cause.describe(),
            explain: config.other_method.is_none().then(|| commands.explain(&at)),
            figure: pixels.and_then(|pixels| commands.figure(pixels, columns)),
            at,
            failure,
        }
    };
    Ok(found.failures.into_iter().map(row).collect())
}
