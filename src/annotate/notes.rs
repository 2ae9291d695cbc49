//! What became of each cloud, noted so that it need not be done again: by a run that may be cut off, and by one that
//! annotates a slice of a recording.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::report::FrameReport;
use crate::error::Result;
use crate::io::{SharedBytes, SourceChunk};

/// A cloud, and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Note {
    pub(super) topic: String,
    pub(super) number: u64,
    /// Checksum of the cloud's message.
    pub(super) cloud: u32,
    #[serde(flatten)]
    pub(super) outcome: Noted,
}

/// What became of a cloud.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Noted {
    Annotated {
        /// Checksums of the messages that annotate it.
        instances: u32,
        objects: u32,
        report: FrameReport,
    },
    /// It could not be read, and why.
    Unreadable { problem: String },
}

/// What became of a cloud before.
pub(super) enum Before {
    Annotated(FrameReport, [Given; 2]),
    Unreadable(String),
}

/// A message that was made before.
pub(super) struct Given {
    pub(super) data: SharedBytes,
    /// The chunk that it lies in.
    pub(super) chunk: Option<Arc<SourceChunk>>,
}

/// Where clouds that were annotated before are found.
pub(super) trait Done {
    /// What became of the next cloud, if it was annotated.
    ///
    /// # Errors
    /// [`crate::Error::Conflict`] or [`crate::Error::Slices`] if another cloud was annotated in its place.
    fn take(&mut self, topic: &str, number: u64, cloud: &[u8]) -> Result<Option<Before>>;

    /// Says that no more clouds are to come.
    ///
    /// # Errors
    /// [`crate::Error::Slices`] if there were more that have to be used.
    fn finish(&mut self) -> Result<()>;
}
