//! What happens while a recording is annotated.

use nalgebra::Isometry3;

use crate::frames::{CloudKey, Truth};
use divmerge_core::cloud::PointCloud;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::over_time::TrackedObject;
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
    /// The tracks of a cloud have been decided, where objects are followed. It was clustered
    /// before; others may have been since.
    Tracked(&'a TrackedFrame),
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
    /// The taxonomy of its classes, if there are classes: the one that was recognised, or given.
    pub taxonomy: Option<&'a Taxonomy>,
    /// What is true of it, if that is known and was asked for.
    pub truth: Option<&'a Truth>,
    /// What is odd about it, in words.
    pub remarks: &'a [String],
}

/// The objects of a cloud as their tracks know them.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedFrame {
    /// Topic of the cloud.
    pub topic: String,
    /// Number of the cloud on its topic, from 0.
    pub number: u64,
    /// Stamp of the cloud's header, nanoseconds.
    pub stamp_ns: i64,
    /// When the cloud was logged, nanoseconds.
    pub log_time_ns: u64,
    /// Coordinate frame of the cloud.
    pub frame_id: String,
    /// Its objects; background is none.
    pub objects: Vec<TrackedObject>,
    /// From the cloud as it was clustered to a frame that stands still, metres.
    pub world_from_cloud: Isometry3<f64>,
    /// Whether that frame has nothing to do with the one before.
    pub began_anew: bool,
}
