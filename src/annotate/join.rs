//! Annotated slices put together: the recording is gone through once more, and what was made of
//! each cloud is taken from the slices. So the output is that of a run over the whole recording,
//! byte for byte, by construction; chunks of annotations that come out the same are not compressed
//! again.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::checkpoint::CompletedClouds;
use super::event::RunEvent;
use super::job::{Job, JobInput};
use super::options::AnnotateOptions;
use super::paths::refuse_same_file;
use super::report::AnnotationReport;
use super::run::{read_all, usual_workers};
use super::slice_checkpoints::SliceCheckpoints;
use super::slice_files::{SliceFile, check};
use crate::error::{Error, Result, SliceProblem};
use divmerge_recording::stopwatch::ms_since;
use divmerge_recording::{Overview, RecordingReader};

/// How slices are joined.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct JoinOptions {
    /// The recording. Default: where it was when the slices were planned.
    pub input: Option<PathBuf>,
    /// Whether an existing output may be replaced.
    pub force: bool,
    /// As [`AnnotateOptions::threads`].
    pub threads: usize,
}

/// Joins the annotated slices of one recording, in their order ([`super::by_recording`]). The
/// output is that of [`super::annotate`] over the whole recording with the same options, byte for
/// byte.
///
/// # Errors
/// [`Error::Slices`] if slices are missing, damaged, or were not made of this recording; those of
/// [`super::annotate`].
pub fn join(
    slices: &[SliceFile],
    output: &Path,
    options: &JoinOptions,
    on_event: &mut dyn FnMut(RunEvent) -> ControlFlow<()>,
) -> Result<AnnotationReport> {
    check(slices)?;
    let Some(first) = slices.first() else {
        return Err(Error::Slices { of: output.to_owned(), problem: SliceProblem::Nothing });
    };
    let input = options.input.as_ref().unwrap_or(&first.slice.input);
    refuse_same_file(input, output)?;
    for slice in slices {
        refuse_same_file(&slice.path, output)?;
    }
    let started = Instant::now();
    let workers = usual_workers(options.threads);
    let overview = Overview::read(input)?;
    first.slice.check(&overview)?;
    let run = AnnotateOptions {
        force: options.force,
        threads: options.threads,
        ..first.parameters.options()
    };
    let of_file = JobInput::of_file(overview, first.parameters.clone())?;
    let mut job = Job::new(of_file, output, &run, &workers, on_event)?;
    job.take_from(CompletedClouds::new(SliceCheckpoints::new(slices, &workers)));
    let reader = RecordingReader::open_filtered(&job.overview, &job.filter, &workers)?;
    let mut report = read_all(job, reader)?;
    report.profile.wall_ms = ms_since(started);
    Ok(report)
}
