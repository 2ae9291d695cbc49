//! The index at the end of a recording, read without the rest.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::{self, op};

use super::chunk::split_head;
use super::input::Input;
use super::overview::Overview;
use super::parse::parse_record;
use super::scan::HEAD_LEN;

/// The footer's record: head, two offsets and a checksum.
const FOOTER_LEN: u64 = (HEAD_LEN + 8 + 8 + 4) as u64;

/// What the summary says of the chunks, for readers that pass some over.
pub(super) struct Index {
    /// In the order of the file.
    pub(super) chunks: Vec<IndexedChunk>,
    /// Bytes of the file that were read for this.
    pub(super) bytes_read: u64,
}

/// A chunk as the summary describes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct IndexedChunk {
    /// Where its record begins in the file.
    pub(super) start: u64,
    /// Where the message indexes behind it end.
    pub(super) end: u64,
    /// Earliest and latest log time.
    pub(super) times: (u64, u64),
    /// Channels that it has message indexes of.
    pub(super) channels: usize,
    /// Name of its compression, empty for none.
    pub(super) compression: String,
    /// Channels that are kept, and their messages.
    pub(super) counts: Vec<(u16, u64)>,
}

impl Index {
    /// Reads the index, keeping counts of the messages of some channels. `None` if it cannot be relied on: there is no
    /// summary or no checksum over it, it does not list as many chunks as it counts, they overlap in the file, or the
    /// message indexes behind one cannot lie where it says.
    pub(super) fn read(path: &Path, size: u64, keep: &dyn Fn(u16) -> bool) -> Option<Self> {
        let (mut chunks, mut counted) = (Vec::new(), None);
        let seen = visit_summary(path, size, |record| match record {
            records::Record::ChunkIndex(chunk) => chunks.push(IndexedChunk::new(chunk, keep)),
            records::Record::Statistics(statistics) => counted = Some(statistics.chunk_count),
            _ => {}
        })?;
        let mut chunks: Vec<IndexedChunk> = chunks.into_iter().collect::<Option<_>>()?;
        chunks.sort_by_key(|chunk| chunk.start);
        let is_ordered = chunks.windows(2).all(|two| two[0].end <= two[1].start);
        let is_inside = chunks.last().is_none_or(|last| last.end <= seen.start);
        let is_sound = seen.has_crc
            && counted.map(u64::from) == Some(chunks.len() as u64)
            && is_ordered
            && is_inside;
        let bytes_read = size.saturating_sub(seen.start);
        is_sound.then_some(Index { chunks, bytes_read })
    }
}

impl IndexedChunk {
    fn new(chunk: records::ChunkIndex, keep: &dyn Fn(u16) -> bool) -> Option<Self> {
        let start = chunk.chunk_start_offset;
        let end = start.checked_add(chunk.chunk_length)?.checked_add(chunk.message_index_length)?;
        let times = (chunk.message_start_time, chunk.message_end_time);
        let channels = chunk.message_index_offsets.len();
        let counts = message_counts(&chunk.message_index_offsets, end)?;
        (times.0 <= times.1 && start < end).then_some(IndexedChunk {
            start,
            end,
            times,
            channels,
            compression: chunk.compression,
            counts: counts.into_iter().filter(|&(channel, _)| keep(channel)).collect(),
        })
    }

    pub(super) fn has_message_indexes(&self) -> bool {
        self.channels > 0
    }
}

/// A chunk by the recording's own index.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChunkPlace {
    /// Where it begins in the file.
    pub start: u64,
    /// Earliest and latest log time in nanoseconds since 1970; 0 and 0 without messages.
    pub times: (u64, u64),
    /// Messages of the channels that were asked for.
    pub messages: u64,
    /// Whether it has messages of any channel.
    pub has_messages: bool,
}

impl ChunkPlace {
    /// The chunks of a recording in the order of the file, and how many messages they have of some channels. `None` if
    /// there is no index, or none that can be relied on.
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

/// Messages of each channel, from the lengths of the message indexes that begin at these offsets, one behind the other,
/// the last of which ends at `end`. `None` if those are no lengths of such records.
fn message_counts(offsets: &BTreeMap<u16, u64>, end: u64) -> Option<Vec<(u16, u64)>> {
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

/// Topics of the messages in the chunk at an offset, if the index knows the chunk.
pub(super) fn topics_of_chunk(path: &Path, size: u64, offset: u64) -> Option<BTreeSet<String>> {
    let mut topics = BTreeMap::new();
    let mut channels = None;
    visit_summary(path, size, |record| match record {
        records::Record::Channel(channel) => {
            topics.insert(channel.id, channel.topic);
        }
        records::Record::ChunkIndex(chunk) if chunk.chunk_start_offset == offset => {
            channels = Some(chunk.message_index_offsets.into_keys());
        }
        _ => {}
    })?;
    Some(channels?.filter_map(|id| topics.remove(&id)).collect())
}

/// A summary that was gone through.
pub(super) struct Seen {
    /// Where it begins in the file.
    start: u64,
    /// Whether it has a checksum, which was right.
    has_crc: bool,
}

/// Goes through the records of the summary one by one. `None` if there is no summary or anything
/// about it is wrong, its checksum included.
pub(super) fn visit_summary(
    path: &Path,
    size: u64,
    mut visit: impl FnMut(records::Record),
) -> Option<Seen> {
    let mut file = Input::open(path).ok()?;
    let end = size.checked_sub(FOOTER_LEN + mcap::MAGIC.len() as u64)?;
    let mut footer = [0; FOOTER_LEN as usize + 8];
    file.seek(SeekFrom::Start(end)).ok()?;
    file.read_exact(&mut footer).ok()?;
    let (footer, magic) = footer.split_at(FOOTER_LEN as usize);
    let (head, body) = footer.split_at(HEAD_LEN);
    if magic != mcap::MAGIC || split_head(head)? != (op::FOOTER, body.len() as u64) {
        return None;
    }
    let Some(records::Record::Footer(places)) = parse_record(op::FOOTER, body) else {
        return None;
    };
    let mut left = match places.summary_start {
        0 => return None,
        start => end.checked_sub(start)?,
    };
    file.keep_end(places.summary_start).ok()?;
    file.seek(SeekFrom::Start(places.summary_start)).ok()?;
    let mut file = BufReader::new(file);
    let mut crc = crc32fast::Hasher::new();
    let mut record = Vec::new();
    while left > 0 {
        left = left.checked_sub(HEAD_LEN as u64)?;
        record.clear();
        (&mut file).take(HEAD_LEN as u64).read_to_end(&mut record).ok()?;
        let (opcode, length) = split_head(&record)?;
        left = left.checked_sub(length)?;
        (&mut file).take(length).read_to_end(&mut record).ok()?;
        crc.update(&record);
        let body = record.get(HEAD_LEN..).filter(|body| body.len() as u64 == length)?;
        if let op::SCHEMA | op::CHANNEL | op::STATISTICS | op::CHUNK_INDEX = opcode {
            visit(parse_record(opcode, body)?);
        }
    }
    crc.update(&footer[..HEAD_LEN + 16]);
    let is_sound = places.summary_crc == 0 || places.summary_crc == crc.finalize();
    let has_crc = places.summary_crc != 0;
    is_sound.then_some(Seen { start: places.summary_start, has_crc })
}
