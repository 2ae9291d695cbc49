//! What reading takes.

use serde::Serialize;

use crate::stopwatch::Steps;

/// What reading took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct ReadTimes {
    /// Reading and hashing records of the file.
    pub read: Steps,
    /// Unpacking chunks and checking them; bytes behind it.
    pub unpack: Steps,
    /// Waiting for chunks to be unpacked.
    pub wait: Steps,
}
