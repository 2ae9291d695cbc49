//! Which messages of a recording a reader is to give.

use std::collections::BTreeMap;
use std::ops::{Bound, Range};

use crate::compression::Compression;
use crate::index::IndexedChunk;

/// Numbers of messages on their topic, from 0 in the order of the file.
pub type MessageRange = (Bound<u64>, Bound<u64>);

/// What to read of a recording. By the index of the file a reader skips chunks without a message
/// that passes ([`RecordingReader::open_filtered`](crate::RecordingReader::open_filtered)). The
/// other chunks are read whole, so messages that do not pass can come with those that do.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadFilter {
    /// Earliest log time in nanoseconds. Default: none.
    pub from_ns: Option<u64>,
    /// Log time in nanoseconds before which a message passes. Default: none.
    pub to_ns: Option<u64>,
    /// Channels whose messages are numbered, each with its topic. Messages are numbered by topic,
    /// and counted in chunks that are skipped. Default: none.
    pub numbered: BTreeMap<u16, String>,
    /// Numbers that pass on each of those topics. Default: all.
    pub numbers: MessageRange,
    /// Bytes of the file in which a chunk must begin to be read. Default: all.
    pub bytes: Range<u64>,
    /// Whether messages of the other channels pass. Default: yes.
    pub others: bool,
    /// [`RecordingReader::next_part`](crate::RecordingReader::next_part) may give a chunk of this
    /// compression as it lies in the file, neither opened nor checked, if it has no numbered
    /// message. Default: none.
    pub unopened: Option<Compression>,
    /// Whether messages of the other channels are left out of compressed chunks of more than 32 MiB
    /// of records, so that those need not be in memory beside the chunk itself. Such a chunk can be
    /// copied as it is, or opened ([`SourceChunk::into_items`](crate::SourceChunk::into_items)).
    /// Default: no.
    pub skims_large_chunks: bool,
}

/// Every byte of a file.
const ALL_BYTES: Range<u64> = 0..u64::MAX;

impl Default for ReadFilter {
    /// Everything passes, and every chunk is opened.
    fn default() -> Self {
        ReadFilter {
            from_ns: None,
            to_ns: None,
            numbered: BTreeMap::new(),
            numbers: (Bound::Unbounded, Bound::Unbounded),
            bytes: ALL_BYTES,
            others: true,
            unopened: None,
            skims_large_chunks: false,
        }
    }
}

impl ReadFilter {
    /// Whether a log time lies in the window.
    pub fn is_in_window(&self, log_time: u64) -> bool {
        self.from_ns.is_none_or(|from| log_time >= from)
            && self.to_ns.is_none_or(|to| log_time < to)
    }

    /// Whether a chunk begins where it must, and could hold log times of the window.
    pub(crate) fn overlaps(&self, chunk: &IndexedChunk) -> bool {
        let (first, last) = chunk.times;
        self.bytes.contains(&chunk.start)
            && self.from_ns.is_none_or(|from| last >= from)
            && self.to_ns.is_none_or(|to| first < to)
    }

    /// Whether every chunk must be read and opened.
    pub(crate) fn passes_everything(&self) -> bool {
        self.others
            && self.from_ns.is_none()
            && self.to_ns.is_none()
            && self.bytes == ALL_BYTES
            && self.unopened.is_none()
    }

    /// Whether a chunk need not be opened.
    pub(crate) fn may_stay_unopened(&self, chunk: &IndexedChunk) -> bool {
        self.others
            && self.unopened.is_some_and(|compression| compression.name() == &*chunk.compression)
            && chunk.has_message_indexes()
            && chunk.counts.is_empty()
            && self.is_in_window(chunk.times.0)
            && self.is_in_window(chunk.times.1)
    }

    /// Whether one of the `count` numbers from `first` on passes.
    pub(crate) fn has_number(&self, first: u64, count: u64) -> bool {
        let end = first.saturating_add(count);
        let starts_below = match self.numbers.0 {
            Bound::Included(from) => end > from,
            Bound::Excluded(from) => end > from.saturating_add(1),
            Bound::Unbounded => true,
        };
        count > 0 && starts_below && !is_past(&self.numbers, first)
    }
}

/// Whether `number` and all that follow lie behind the end of a range.
pub fn is_past(range: &MessageRange, number: u64) -> bool {
    match range.1 {
        Bound::Excluded(end) => number >= end,
        Bound::Included(last) => number > last,
        Bound::Unbounded => false,
    }
}
