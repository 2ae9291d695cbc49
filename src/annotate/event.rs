//! What happens while a recording is annotated.

use crate::frames::CloudKey;
use divmerge_core::cloud::PointCloud;
use divmerge_core::pipeline::Stages;
use divmerge_recording::MessageHeader;

/// What happened on the way, as it happens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RunEvent<'a> {
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
    Frame(ClusteredFrame<'a>),
}

/// One clustered cloud of a recording, for whoever looks on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClusteredFrame<'a> {
    /// What identifies the cloud.
    pub key: CloudKey<'a>,
    /// Channel and times of its message, of several that were put together those of the last.
    pub header: MessageHeader,
    /// The cloud.
    pub cloud: &'a PointCloud,
    /// What became of it.
    pub stages: &'a Stages,
    /// What is odd about it, in words.
    pub remarks: &'a [String],
}
