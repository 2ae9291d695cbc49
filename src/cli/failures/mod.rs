//! `divmerge failures`

mod row;
mod text;

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use row::{Commands, Row};

use crate::cli::arguments::method::MethodArguments;
use crate::cli::arguments::truth::CloudArguments;
use crate::cli::exit::Outcome;
use crate::cli::output::Outputs;
use crate::cli::progress::frame_bar;
use crate::diagnose::failures::{FailureReport, FailureSummary, failures_in_frame};
use crate::evaluate::panoptic::MIN_POINTS;

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
    let commands = Commands {
        input: &clouds.input,
        topic: clouds.topic.as_deref(),
        method: arguments.method.words(),
        has_explanation: method.pipeline.other_method.is_none(),
    };
    let keeps_all = csv.is_some() || json.is_some();
    for frame in frames {
        let frame = frame.map_err(|error| arguments.clouds.with_hint(error))?;
        let found =
            failures_in_frame(&clouds.input, frame, &method, arguments.small, &mut summary)?;
        rows.extend(found.into_iter().map(|failure| commands.row(failure)));
        rows.sort_by_key(|row: &Row| std::cmp::Reverse(row.found.failure.judged.points));
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
        let all = (&summary, &rows[..]);
        json.write_json(&FailureReport::new(&clouds.input, &method, small, all))?;
    }
    Ok(Outcome::Done)
}
