//! The main job: a recording in, the same recording with instances out.

mod asked;
mod job;
mod join;
mod message;
pub mod moments;
mod notes;
mod objects;
mod profile;
mod report;
pub mod resume;
mod slice_files;
pub mod slices;
mod topics;
mod types;

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::cloud::PointCloud;
use crate::error::{Error, Result};
use crate::io::{Compression, Overview, Position, RecordingReader, STANDARD_STREAM, is_stream};
use crate::pipeline::Stages;
use crate::stopwatch::ms_since;
use crate::workers::Workers;

use asked::Asked;
use job::Job;
pub use join::{JoinOptions, join};
pub use message::{Annotated, Clustered, Decoded, Method, Semantics, annotate_message, cluster};
pub use objects::{ObjectSource, Objects};
pub use profile::{Profile, SlowFrame};
pub use report::{FrameTimes, METADATA_NAME, Report, TopicReport, remarks};
pub use slice_files::{SliceFile, by_recording};
pub use slices::Slice;
pub(crate) use topics::added_metadata;
pub use topics::{
    CloudTopic, INSTANCES, OBJECTS, annotated_topics, choose, choose_beside, is_annotation,
};
pub use types::{Flavor, MessageTypes};

/// What the output holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Form {
    /// Everything that the input holds, and `T/instances` and `T/objects` beside each cloud topic T.
    #[default]
    Beside,
    /// Everything that the input holds, but each cloud of T with the fields of `T/instances` behind its own; `T/objects`
    /// beside T. A cloud that cannot be read stays as it is.
    InPlace,
    /// `T/instances` and `T/objects` alone.
    Only,
}

impl Form {
    /// In words, as in the output's metadata.
    pub fn describe(self) -> &'static str {
        match self {
            Form::Beside => "beside the input",
            Form::InPlace => "in place of the clouds",
            Form::Only => "annotations only",
        }
    }
}

/// What is done to a recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// What is done to each cloud.
    pub method: Method,
    /// Types of the added messages.
    pub types: MessageTypes,
    /// Cloud topics to annotate; none means all.
    pub topics: Vec<String>,
    /// Earliest log time in nanoseconds; earlier messages are left out of the output.
    pub from_ns: Option<u64>,
    /// Log time in nanoseconds from which on messages are left out of the output.
    pub to_ns: Option<u64>,
    /// What the output holds. Default: everything.
    pub form: Form,
    /// Compression of the output. Default: that of most of the input's chunks, so that those stay as they are.
    pub compression: Option<Compression>,
    /// The part of the input that is annotated; the output is what [`join`] takes. Default: all of it.
    pub slice: Option<Slice>,
    /// Whether chunks that by the input's index hold nothing that is annotated are taken over without being opened. A
    /// chunk of these that is damaged is then as damaged in the output, where its checksum still tells. Default: no.
    pub unchecked: bool,
    /// Whether an existing output may be replaced.
    pub force: bool,
    /// Whether what a run for the same output had done that was cut off is used. The output's bytes are the same. An
    /// interrupted run leaves what it had done only if this, or [`Options::resumable`], is set. Default: no.
    pub resume: bool,
    /// Whether an interrupted run leaves what it had done, `.NAME.partial` and `.NAME.journal`, to be resumed. What is
    /// left by a run that was killed can be resumed if this was set. Default: no.
    pub resumable: bool,
    /// Threads that unpack, cluster and compress, besides the one that reads and writes; with 1 that one does
    /// everything, one thing after the other. 0, the default: as many as there are cores, up to [`USUAL_THREADS`].
    pub threads: usize,
}

/// One clustered cloud of a recording, for whoever looks on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<'a> {
    /// Topic of the cloud.
    pub topic: &'a str,
    /// Number of the cloud on its topic, from 0; unreadable clouds count.
    pub number: u64,
    /// When the cloud was logged, nanoseconds since 1970.
    pub log_time_ns: u64,
    /// Stamp of the cloud's header, nanoseconds since 1970.
    pub stamp_ns: i64,
    /// Coordinate frame of the cloud.
    pub frame_id: &'a str,
    /// The cloud.
    pub cloud: &'a PointCloud,
    /// What became of it.
    pub stages: &'a Stages,
    /// What is odd about it, in words.
    pub remarks: &'a [String],
}

/// What happened on the way, as it happens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event<'a> {
    /// So many bytes of the input have been read.
    Progress {
        /// Bytes read.
        bytes: u64,
        /// Bytes of the input; 0 of a stream.
        total: u64,
    },
    /// Something the user should know; complete with topic and place.
    Warning(&'a str),
    /// A cloud has been clustered.
    Frame(Frame<'a>),
}

/// Most threads that are started unasked: eight all but reach what the one that reads and writes can do alone, and stay
/// below 400 MB with a large sensor (docs/performance.md).
pub const USUAL_THREADS: usize = 8;

/// Annotates a recording, or a slice of one. The input may be a stream ([`crate::io::is_stream`]), whose topics are taken as they come, and
/// the output the standard one ([`crate::io::STANDARD_STREAM`]), which gets the recording as it is made.
///
/// Everything in the input is copied unchanged; to each cloud message come one on `T/instances` and one on
/// `T/objects` (other [`Form`]s of the output are described there). A chunk that can stay as it is stays as it is, byte for byte, and what is added to its clouds
/// follows in chunks of its own; that is every chunk of the asked-for compression whose messages are all kept.
/// Otherwise each cloud message is followed by those added to it. The output is the same however many threads
/// there are. Of a recording whose index can be relied on, chunks outside of the times asked for are not read. A cloud that cannot be read is passed through, warned of and counted. The
/// output appears under its name when it is complete, or not at all. Memory does not grow with the
/// length of the recording, but for the boxes of a topic where those are asked for.
///
/// # Errors
/// [`Error::Conflict`] if a run is to be resumed that was of other parameters or another input;
/// [`Error::Recording`] if the input is damaged (a cut-off input is none: it is annotated as far as it
/// goes), [`Error::NoCloud`], [`Error::Conflict`] if the input already has an output's topic, is the
/// output, or is of another flavor than is asked for, [`Error::Io`]; [`Error::Boxes`] if boxes do not
/// fit a cloud; [`Error::Interrupted`] or, where something is left, [`Error::Left`] if `on_event` breaks off at a progress
/// event.
pub fn annotate(
    input: &Path,
    output: &Path,
    options: &Options,
    on_event: &mut dyn FnMut(Event) -> ControlFlow<()>,
) -> Result<Report> {
    refuse_same_file(input, output)?;
    if options.slice.is_some() && is_stream(input) {
        let problem = "a slice is read from a file, not from a stream".to_owned();
        return Err(Error::Slices { of: input.to_owned(), problem });
    }
    let started = Instant::now();
    let workers = usual_workers(options.threads);
    let (job, reader) = match is_stream(input) {
        true => {
            let mut reader = RecordingReader::open_ahead(input, &workers)?;
            let overview = Overview::of_stream(&mut reader, input)?;
            (Job::of_stream(overview, output, options, &workers, on_event)?, reader)
        }
        false => {
            let overview = Overview::read(input)?;
            if let Some(slice) = &options.slice {
                slice.check(&overview)?;
            }
            let asked = Asked::of(&overview, options);
            let job = Job::new(overview, asked, output, options, &workers, on_event)?;
            let reader = RecordingReader::open_filtered(&job.overview, &job.wanted, &workers)?;
            (job, reader)
        }
    };
    let mut report = read_all(job, reader)?;
    report.profile.wall_ms = ms_since(started);
    Ok(report)
}

/// So many threads; 0: as many as are started unasked.
fn usual_workers(threads: usize) -> Workers {
    Workers::start(match threads {
        0 => Workers::per_core().min(USUAL_THREADS),
        threads => threads,
    })
}

/// Goes through what is to be read, and completes the output.
fn read_all(mut job: Job, mut reader: RecordingReader) -> Result<Report> {
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
                job.settle_all()?;
                return Err(error.into());
            }
        }
    }
    let read = reader.times();
    let mut report = job.finish(reader)?;
    report.profile.read = read;
    Ok(report)
}

pub(crate) fn refuse_same_file(input: &Path, output: &Path) -> Result<()> {
    if output == STANDARD_STREAM {
        return Ok(());
    }
    match (input.canonicalize(), output.canonicalize()) {
        (Ok(from), Ok(to)) if from == to => Err(Error::Conflict {
            path: input.to_owned(),
            problem: "the output is the input itself, which is never touched".into(),
        }),
        _ => Ok(()),
    }
}

pub(crate) fn place(position: Position) -> String {
    format!(
        "message {} of the chunk at byte {}",
        position.index_in_chunk + 1,
        position.chunk_offset
    )
}
