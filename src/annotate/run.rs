//! From recording to recording.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use super::event::RunEvent;
use super::job::{Job, JobInput};
use super::options::{AnnotateOptions, USUAL_THREADS};
use super::paths::refuse_same_file;
use super::report::AnnotationReport;
use super::run_parameters::RunParameters;
use crate::error::{Conflict, Error, Result, SliceProblem};
use divmerge_recording::stopwatch::ms_since;
use divmerge_recording::workers::Workers;
use divmerge_recording::{Overview, RecordingReader, is_stream};

/// Annotates a recording, or a slice of one. The input may be a stream
/// ([`divmerge_recording::is_stream`]), whose topics are taken as they come, and the output the
/// standard one ([`divmerge_recording::STANDARD_STREAM`]), which gets the recording as it is made.
///
/// Everything in the input is copied unchanged; to each cloud message come one on `T/instances` and
/// one on `T/objects` (other [`Form`](super::form::Form)s of the output are described there). A
/// chunk that can stay as it is stays as it is, byte for byte, and what is added to its clouds
/// follows in chunks of its own; that is every chunk of the output's compression whose messages are
/// all kept. Otherwise each cloud message is followed by those added to it. The output is the same
/// however many threads there are. Of a recording whose index can be relied on, chunks outside of
/// the time window are not read. A cloud that cannot be read is passed through, warned of and
/// counted. The output appears under its name when it is complete, or not at all. Memory does not
/// grow with the length of the recording, except by the boxes of a topic.
///
/// # Errors
/// [`Error::Conflict`] if a run is to be resumed that was of other parameters or another input;
/// [`Error::Recording`] if the input is damaged (a cut-off input is none: it is annotated as far as
/// it goes), [`Error::NoCloud`], [`Error::Conflict`] if the input already has an output's topic, is
/// the output, or is of another flavor than the options say, [`Error::Io`]; [`Error::Boxes`] if
/// boxes do not fit a cloud; [`Error::Interrupted`] or, where something is left, [`Error::Left`] if
/// `on_event` breaks off at a frame or at its progress.
pub fn annotate(
    input: &Path,
    output: &Path,
    options: &AnnotateOptions,
    on_event: &mut dyn FnMut(RunEvent) -> ControlFlow<()>,
) -> Result<AnnotationReport> {
    refuse_same_file(input, output)?;
    if options.slice.is_some() && is_stream(input) {
        return Err(Error::Slices { of: input.to_owned(), problem: SliceProblem::OfStream });
    }
    options.config.refuse_with_turns(input)?;
    refuse_cut_turns(input, options)?;
    let started = Instant::now();
    let workers = usual_workers(options.threads);
    let (job, reader) = match is_stream(input) {
        true => {
            let mut reader = RecordingReader::open_ahead(input, &workers)?;
            let overview = Overview::of_stream(&mut reader, input)?;
            let stream = JobInput::of_stream(overview, options);
            (Job::new(stream, output, options, &workers, on_event)?, reader)
        }
        false => {
            let overview = Overview::read(input)?;
            if let Some(slice) = &options.slice {
                slice.check(&overview)?;
            }
            let parameters = RunParameters::new(&overview, options);
            let file = JobInput::of_file(overview, parameters)?;
            if options.slice.is_none() {
                file.refuse_unsatisfiable(options)?;
            }
            let job = Job::new(file, output, options, &workers, on_event)?;
            let reader = RecordingReader::open_filtered(&job.overview, &job.filter, &workers)?;
            (job, reader)
        }
    };
    let mut report = read_all(job, reader)?;
    report.profile.wall_ms = ms_since(started);
    Ok(report)
}

/// Refuses to begin a turn anywhere but where the one before ends.
fn refuse_cut_turns(input: &Path, options: &AnnotateOptions) -> Result<()> {
    let with = match options {
        _ if options.config.assemble.is_none() => return Ok(()),
        AnnotateOptions { resume: true, .. } => "a run that is resumed",
        AnnotateOptions { slice: Some(_), .. } => "a slice",
        _ => return Ok(()),
    };
    Err(Error::Conflict { path: input.to_owned(), problem: Conflict::Turns { with } })
}

/// Starts so many threads; 0: the default.
pub(super) fn usual_workers(threads: usize) -> Workers {
    Workers::start(match threads {
        0 => Workers::per_core().min(USUAL_THREADS),
        threads => threads,
    })
}

/// Goes through what is to be read, and completes the output.
pub(super) fn read_all(mut job: Job, mut reader: RecordingReader) -> Result<AnnotationReport> {
    reader.unpack_messages();
    while !job.is_behind_slice(reader.offset()) {
        let part = reader.next_part();
        let bytes = reader.offset();
        match part {
            Ok(Some(part)) => {
                if let Err(error) = job.part(part, bytes) {
                    return Err(job.give_up(error));
                }
            }
            Ok(None) => break,
            Err(error) => {
                let settled = job.settle_all();
                return Err(job.give_up(settled.err().unwrap_or_else(|| error.into())));
            }
        }
    }
    let read = reader.times();
    let mut report = job.finish(reader)?;
    report.profile.read = read;
    Ok(report)
}
