//! The failures of a labelled cloud, with what a table of many clouds says of each.

use std::path::Path;

use serde::Serialize;

use super::case::LabelledRun;
use super::find::{Failure, PixelBounds, failures};
use super::summary::FailureSummary;
use crate::annotate::AnnotateConfig;
use crate::diagnose::explain::ClusteredCloud;
use crate::diagnose::triage::ranking::recorded_positions;
use crate::error::Result;
use crate::frames::LabelledFrame;
use divmerge_core::pipeline;

/// A failure and the cloud it is in.
#[derive(Debug, Clone, Serialize)]
pub struct FailureInFrame {
    /// Topic or sequence of the cloud.
    pub topic: String,
    /// Number of the cloud.
    pub frame: u64,
    /// Log time in nanoseconds; `None` in a folder.
    pub log_time_ns: Option<u64>,
    /// The failure.
    #[serde(flatten)]
    pub failure: Failure,
    /// The cause in words.
    pub cause_in_words: String,
    /// Positions of the points to look at, metres in the recording's frame.
    pub at: Vec<[f32; 3]>,
    /// Columns of the range image.
    #[serde(skip)]
    pub columns: usize,
}

impl FailureInFrame {
    /// The part of the image to look at: the object and as much again on both sides, 20 columns
    /// at least. `None` for an object without pixels or on both sides of the first column.
    pub fn window(&self) -> Option<std::ops::Range<usize>> {
        let PixelBounds { columns, .. } = self.failure.pixels.as_ref()?;
        let around = columns.len().max(20);
        let window = columns.start.saturating_sub(around)..(columns.end + around).min(self.columns);
        (2 * columns.len() < self.columns).then_some(window)
    }
}

/// The failures of many clouds, as a file in JSON has them; `F` is a failure with whatever else a
/// program says of it.
#[derive(Debug, Serialize)]
pub struct FailureReport<'a, F> {
    /// The recording or folder.
    pub input: &'a Path,
    /// The clustering method.
    pub method: &'a str,
    /// The preset.
    pub preset: &'a str,
    /// Name of the taxonomy of the truth.
    pub taxonomy: &'a str,
    /// Unmatched objects of fewer points are no failures.
    pub min_points: u64,
    /// Counts over all clouds.
    #[serde(flatten)]
    pub summary: &'a FailureSummary,
    /// The failures, those of the most points first.
    pub failures: &'a [F],
}

impl<'a, F> FailureReport<'a, F> {
    /// The report of a run of the method over a recording or folder.
    pub fn new(
        input: &'a Path,
        method: &'a AnnotateConfig,
        min_points: u64,
        (summary, failures): (&'a FailureSummary, &'a [F]),
    ) -> Self {
        FailureReport {
            input,
            method: method.pipeline.method_name(),
            preset: method.pipeline.preset,
            taxonomy: &method.taxonomy.name,
            min_points,
            summary,
            failures,
        }
    }
}

/// Clusters a cloud of `input` and finds its failures; its verdicts are added to the summary.
/// Unmatched objects of fewer than `min_points` points are no failures.
///
/// # Errors
/// Those of [`AnnotateConfig::prepare`], [`AnnotateConfig::detections`] and
/// [`LabelledFrame::true_class_numbers`].
pub fn failures_in_frame(
    input: &Path,
    mut frame: LabelledFrame,
    method: &AnnotateConfig,
    min_points: u64,
    summary: &mut FailureSummary,
) -> Result<Vec<FailureInFrame>> {
    method.prepare(&mut frame)?;
    let detections = method.detections(&frame)?;
    let LabelledFrame { source, number, log_time_ns, cloud, truth, .. } = &frame;
    frame.true_class_numbers(&method.taxonomy).map_err(|error| error.in_file(input))?;
    let (mask, config) = (method.mask(cloud), &method.pipeline);
    let stages = pipeline::run_with(cloud, mask, &detections, config);
    let found = failures(&LabelledRun {
        frame: ClusteredCloud { cloud, mask, config, stages: &stages },
        detections: &detections,
        true_class: &truth.class,
        true_id: &truth.id,
        taxonomy: &method.taxonomy,
        min_points,
    });
    summary.add(&found);
    let in_frame = |failure: Failure| {
        let at = recorded_positions(cloud, &failure.show).into_iter();
        FailureInFrame {
            topic: source.clone(),
            frame: *number,
            log_time_ns: (*log_time_ns != 0).then_some(*log_time_ns),
            cause_in_words: failure.cause.describe(),
            at: at.map(|at| at.map(|along| along as f32)).collect(),
            columns: stages.image.columns(),
            failure,
        }
    };
    Ok(found.failures.into_iter().map(in_frame).collect())
}
