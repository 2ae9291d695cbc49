//! What is done to a recording.

use super::config::AnnotateConfig;
use super::form::Form;
use super::slices::Slice;
use super::tracking::TrackOptions;
use super::types::MessageTypes;
use crate::frames::TruthSource;
use divmerge_recording::Compression;

/// What is done to a recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AnnotateOptions {
    /// What is done to each cloud.
    pub config: AnnotateConfig,
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
    /// Compression of the output. Default: that of most of the input's chunks, so that those stay
    /// as they are.
    pub compression: Option<Compression>,
    /// Whether and how objects are followed over time.
    pub tracks: TrackOptions,
    /// The part of the input that is annotated; the output is what `join` takes. Default: all of
    /// it.
    pub slice: Option<Slice>,
    /// Whether chunks that by the input's index hold nothing that is annotated are taken over
    /// without being opened. A chunk of these that is damaged is then as damaged in the output,
    /// where its checksum still tells. Default: no.
    pub unchecked: bool,
    /// Whether an existing output may be replaced.
    pub force: bool,
    /// Whether what a run for the same output had done that was cut off is used. The output's bytes
    /// are the same. An interrupted run leaves what it had done only if this, or
    /// [`AnnotateOptions::resumable`], is set. Default: no.
    pub resume: bool,
    /// Whether an interrupted run leaves what it had done, `.NAME.partial` and `.NAME.journal`, to
    /// be resumed. What is left by a run that was killed can be resumed if this was set. Default:
    /// no.
    pub resumable: bool,
    /// Where the truth of clouds is that whoever looks on is told
    /// ([`ClusteredFrame::truth`](super::ClusteredFrame::truth)), and whether somebody said so:
    /// then a cloud without it is an error. Default: nobody wants it. The output does not depend on
    /// it.
    pub shown_truth: Option<(TruthSource, bool)>,
    /// Threads that unpack, cluster and compress, besides the one that reads and writes; with 1
    /// that one does everything, one thing after the other. 0, the default: as many as there are
    /// cores, up to [`USUAL_THREADS`].
    pub threads: usize,
}

/// Most threads that are started by default. Eight nearly keep the reading and writing thread busy,
/// and stay below 400 MB with a large sensor (docs/performance.md).
pub const USUAL_THREADS: usize = 8;
