//! The chunks of a recording as the index in its summary lists them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use mcap::records;

use crate::chunk_check::ChunkCheck;
use crate::fields::HEAD_LEN;
use crate::overview::Overview;
use crate::summary::visit_summary;

/// The chunks that the summary lists.
pub(crate) struct Index {
    /// In the order of the file.
    pub(crate) chunks: Vec<IndexedChunk>,
    /// Bytes of the summary. What chunks were asked to confirm is not among them: a remote object
    /// is not asked, and the same recording has the same figures wherever it lies.
    pub(crate) bytes_read: u64,
}

/// A chunk as the summary describes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct IndexedChunk {
    /// Where its record begins in the file.
    pub(crate) start: u64,
    /// Where the message indexes behind it end.
    pub(crate) end: u64,
    /// Earliest and latest log time.
    pub(crate) times: (u64, u64),
    /// Channels that it has message indexes of.
    pub(crate) channels: usize,
    /// Name of its compression, empty for none.
    pub(crate) compression: Arc<str>,
    /// Channels that are kept, and their messages.
    pub(crate) counts: Box<[(u16, u64)]>,
}

impl Index {
    /// Reads the index with the message counts of some channels. `None` if it is unsound: there is
    /// no summary or no checksum over it, it does not list as many chunks as it counts, chunks
    /// overlap in the file, message indexes cannot lie where it says, or a chunk says otherwise
    /// itself (its header or its message indexes; those of a remote object are not asked).
    pub(crate) fn read(path: &Path, size: u64, keep: &dyn Fn(u16) -> bool) -> Option<Self> {
        let (mut chunks, mut counted) = (Some(Vec::new()), None);
        let mut names = BTreeSet::new();
        let mut check = ChunkCheck::open(path)?;
        let seen = visit_summary(path, size, |record| match record {
            records::Record::ChunkIndex(chunk) => {
                let name = shared(&mut names, &chunk.compression);
                if let Some(found) = &mut chunks {
                    match IndexedChunk::checked(&chunk, name, keep, &mut check) {
                        Some(chunk) => found.push(chunk),
                        None => chunks = None,
                    }
                }
            }
            records::Record::Statistics(statistics) => counted = Some(statistics.chunk_count),
            _ => {}
        })?;
        let mut chunks: Vec<IndexedChunk> = chunks?;
        chunks.sort_by_key(|chunk| chunk.start);
        let is_ordered = chunks.windows(2).all(|two| two[0].end <= two[1].start);
        let is_inside = chunks.last().is_none_or(|last| last.end <= seen.start);
        let is_sound = seen.has_crc
            && counted.map(u64::from) == Some(chunks.len() as u64)
            && is_ordered
            && is_inside;
        is_sound.then_some(Index { chunks, bytes_read: size.saturating_sub(seen.start) })
    }
}

/// A name as it is held already, so that it takes memory once.
fn shared(names: &mut BTreeSet<Arc<str>>, name: &str) -> Arc<str> {
    if let Some(known) = names.get(name) {
        return Arc::clone(known);
    }
    let name: Arc<str> = name.into();
    names.insert(Arc::clone(&name));
    name
}

impl IndexedChunk {
    /// `None` if the chunk cannot be as the index says, or is not.
    fn checked(
        chunk: &records::ChunkIndex,
        compression: Arc<str>,
        keep: &dyn Fn(u16) -> bool,
        check: &mut ChunkCheck,
    ) -> Option<Self> {
        let start = chunk.chunk_start_offset;
        let end = start.checked_add(chunk.chunk_length)?.checked_add(chunk.message_index_length)?;
        let times = (chunk.message_start_time, chunk.message_end_time);
        let channels = chunk.message_index_offsets.len();
        let counts = message_counts(&chunk.message_index_offsets, end)?;
        let is_sound = times.0 <= times.1 && start < end && check.agrees(chunk, &counts);
        is_sound.then_some(IndexedChunk {
            start,
            end,
            times,
            channels,
            compression,
            counts: counts.into_iter().filter(|&(channel, _)| keep(channel)).collect(),
        })
    }

    pub(crate) fn has_message_indexes(&self) -> bool {
        self.channels > 0
    }
}

/// A chunk as the index of the recording lists it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChunkPlace {
    /// Where it begins in the file.
    pub start: u64,
    /// Earliest and latest log time in nanoseconds since 1970; 0 and 0 without messages.
    pub times: (u64, u64),
    /// Messages of the counted channels.
    pub messages: u64,
    /// Whether it has messages of any channel.
    pub has_messages: bool,
}

impl ChunkPlace {
    /// The chunks of a recording in the order of the file, with the number of messages of some
    /// channels. `None` if there is no index, or it is unsound.
    pub fn all(overview: &Overview, is_counted: &dyn Fn(u16) -> bool) -> Option<Vec<Self>> {
        let index = Index::read(&overview.path, overview.file_size, is_counted)
            .filter(|_| overview.from_summary)?;
        let place = |chunk: IndexedChunk| ChunkPlace {
            start: chunk.start,
            times: chunk.times,
            messages: chunk.counts.iter().map(|(_, count)| count).sum(),
            has_messages: chunk.has_message_indexes(),
        };
        Some(index.chunks.into_iter().map(place).collect())
    }
}

/// Messages of each channel, from the lengths of its message indexes. These begin at the offsets,
/// one behind the other, and the last ends at `end`. `None` if a message index cannot have that
/// length.
pub(crate) fn message_counts(offsets: &BTreeMap<u16, u64>, end: u64) -> Option<Vec<(u16, u64)>> {
    /// Log time and offset of a message.
    const ENTRY_LEN: u64 = 8 + 8;
    /// Head, channel and length of the entries.
    const BEFORE_ENTRIES: u64 = HEAD_LEN as u64 + 2 + 4;
    let mut places: Vec<(u64, u16)> = offsets.iter().map(|(&id, &offset)| (offset, id)).collect();
    places.sort_unstable();
    let ends = places.iter().skip(1).map(|&(offset, _)| offset).chain([end]);
    let count = |(&(offset, channel), end): (&(u64, u16), u64)| {
        let entries = end.checked_sub(offset)?.checked_sub(BEFORE_ENTRIES)?;
        entries.is_multiple_of(ENTRY_LEN).then_some((channel, entries / ENTRY_LEN))
    };
    places.iter().zip(ends).map(count).collect()
}

/// A window of log times, nanoseconds, that holds the message of some channels nearest to a log
/// time: its start, and its end, which is outside. Both are `None` if the index does not tell.
pub fn window_around(
    overview: &Overview,
    channels: &[u16],
    log_time: u64,
) -> (Option<u64>, Option<u64>) {
    let is_of = |channel: u16| channels.contains(&channel);
    let index = Index::read(&overview.path, overview.file_size, &is_of);
    let Some(index) = index.filter(|_| overview.from_summary) else {
        return (None, None);
    };
    // A chunk with such a message has one at most this far away. Chunks without message indexes,
    // and messages outside of chunks, are read whatever the window is.
    let with_one = index.chunks.iter().filter(|chunk| !chunk.counts.is_empty());
    let reach = with_one.map(|chunk| {
        let (first, last) = chunk.times;
        first.abs_diff(log_time).max(last.abs_diff(log_time))
    });
    match reach.min() {
        None => (None, None),
        Some(reach) => (
            log_time.checked_sub(reach),
            log_time.checked_add(reach).and_then(|t| t.checked_add(1)),
        ),
    }
}
