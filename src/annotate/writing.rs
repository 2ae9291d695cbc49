//! What is to be written of a cloud, and what was.

use super::config::AnnotateConfig;
use super::times::FrameTimes;
use super::tracking::TrackOptions;
use super::types::MessageTypes;

/// One annotated cloud.
#[derive(Debug, Clone, Default)]
pub struct Annotated {
    /// The message of `T/instances`.
    pub cloud: Vec<u8>,
    /// The message of `T/objects`; empty where the format has none.
    pub objects: Vec<u8>,
    /// Coordinate frame of the cloud.
    pub frame_id: String,
    /// Stamp of the cloud's header, nanoseconds since 1970.
    pub stamp_ns: i64,
    /// Where objects came from, as in `field:label`.
    pub semantics: String,
    /// Milliseconds.
    pub times: FrameTimes,
}

/// What is written of a cloud.
#[derive(Debug, Clone, Copy)]
pub(super) struct Writing<'a> {
    /// What was done to the cloud.
    pub(super) config: &'a AnnotateConfig,
    /// Types of the messages.
    pub(super) types: &'a MessageTypes,
    /// How its objects are followed over time, if they are.
    pub(super) tracks: Option<&'a TrackOptions>,
    /// Whether what following them needs is kept in checkpoints.
    pub(super) keeps: bool,
}
