//! What is in a recording, from its summary or by reading it through.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use mcap::records;

use crate::address::is_stream;
use crate::damage::Damage;
use crate::error::{Error, Result};
use crate::index::message_counts;
use crate::overview::Overview;
use crate::part::{Item, Part, SourceChunk};
use crate::reader::RecordingReader;
use crate::record::{Record, Schema};
use crate::summary::visit_summary;
use crate::workers::Workers;

/// Problems that are kept; a file can have any number.
const MAX_PROBLEMS: usize = 16;

/// Overviews of remote objects that had to be read through, the last first, each with the number of
/// its object. Reading an object through once more would take minutes.
static READ_THROUGH: Mutex<VecDeque<(u64, Overview)>> = Mutex::new(VecDeque::new());

/// Overviews that are kept.
const MAX_KEPT: usize = 8;

impl Overview {
    /// What is in a recording, from the summary at its end. The file is read through where there is
    /// no summary or it cannot be trusted: its checksum, its counts of schemas, channels and
    /// messages, and its times must all agree with what it lists, chunks included.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Damaged`] if the file is no MCAP, or had to be read through and is
    /// damaged. A file that is cut off is no error.
    pub fn read(path: &Path) -> Result<Self> {
        if is_stream(path) {
            let kind = "is no file but a stream, which is gone once it is read; `annotate` \
                           alone reads from one";
            let damage = Damage::NotARecording { kind: kind.to_owned() };
            return Err(Error::Damaged { path: path.to_owned(), offset: 0, damage });
        }
        let mut reader = RecordingReader::open_unhashed(path, &Workers::none())?;
        reader.skim_large_chunks();
        let object = reader.object_id();
        if let Some(overview) = object.and_then(kept) {
            return Ok(overview);
        }
        let overview = Overview::of_stream(&mut reader, path)?;
        if let Some(overview) = overview.indexed() {
            return Ok(overview);
        }
        let overview = overview.read_through(reader)?;
        if let Some(object) = object {
            keep(object, &overview);
        }
        Ok(overview)
    }

    /// What is known of a recording before its messages are read: no more than its header.
    ///
    /// # Errors
    /// Those of [`RecordingReader::next_record`].
    pub fn of_stream(reader: &mut RecordingReader, path: &Path) -> Result<Self> {
        let mut overview = Overview {
            path: path.to_owned(),
            file_size: reader.file_size(),
            is_complete: reader.is_complete(),
            ..Overview::default()
        };
        if let Some(record) = reader.next_record()? {
            overview.take(record);
        }
        Ok(overview)
    }

    fn read_through(mut self, mut reader: RecordingReader) -> Result<Self> {
        self.is_complete = true;
        while let Some(part) = reader.next_part()? {
            let items = match part {
                Part::Chunk(chunk) => {
                    self.take_messages(&chunk);
                    chunk.items.into_iter().filter(|item| matches!(item, Item::Record(_))).collect()
                }
                Part::Items(items) => items,
            };
            items.into_iter().for_each(|item| self.take_item(item));
        }
        // Of a compressed file it is known only now how much is in it.
        self.file_size = self.file_size.max(reader.offset());
        let counts = reader.counts();
        self.message_count = counts.messages;
        self.chunk_count = counts.chunks;
        self.attachment_count = counts.attachments;
        self.metadata_count = counts.metadata;
        self.compression = reader.compression().clone();
        Ok(self)
    }

    /// Counts the messages of a chunk.
    fn take_messages(&mut self, chunk: &SourceChunk) {
        for (channel, count) in chunk.counts().filter(|&(_, count)| count > 0) {
            *self.message_counts.entry(channel).or_default() += count;
            let (first, last) = chunk.times();
            self.take_times(first, last);
        }
    }

    fn take_times(&mut self, first: u64, last: u64) {
        self.start_ns = Some(self.start_ns.map_or(first, |start| start.min(first)));
        self.end_ns = Some(self.end_ns.map_or(last, |end| end.max(last)));
    }

    fn take_item(&mut self, item: Item) {
        match item {
            Item::Message { header, .. } => {
                *self.message_counts.entry(header.channel_id).or_default() += 1;
                self.take_times(header.log_time, header.log_time);
            }
            Item::Record(record) => self.take(record),
        }
    }

    fn take(&mut self, record: Record) {
        let is_cut = matches!(record, Record::Truncated { .. });
        match record {
            Record::Header { profile, library } => {
                (self.profile, self.library) = (profile, library);
            }
            Record::Schema(schema) => {
                self.schemas.insert(schema.id, schema);
            }
            Record::Channel(channel) => {
                self.channels.insert(channel.id, channel);
            }
            Record::Damaged { offset, damage } | Record::Truncated { offset, damage } => {
                self.is_complete &= !is_cut;
                if self.problems.len() < MAX_PROBLEMS {
                    self.problems.push(format!("{damage} (byte {offset})"));
                }
            }
            Record::Message { .. }
            | Record::Attachment { .. }
            | Record::Metadata(_)
            | Record::Private { .. }
            | Record::Skipped { .. } => {}
        }
    }

    /// The same overview filled from the index, or `None` if that cannot be trusted.
    fn indexed(&self) -> Option<Self> {
        let mut indexed = self.clone();
        let (mut statistics, mut chunks) = (None, Some(ListedChunks::default()));
        visit_summary(&self.path, self.file_size, |record| match record {
            records::Record::Schema { header, data } => {
                let schema = Schema::new(header, &data);
                indexed.schemas.insert(schema.id, schema);
            }
            records::Record::Channel(channel) => {
                indexed.channels.insert(channel.id, channel);
            }
            records::Record::ChunkIndex(chunk) => {
                if let Some(mut listed) = chunks.take()
                    && listed.take(&chunk).is_some()
                {
                    chunks = Some(listed);
                }
                *indexed.compression.entry(chunk.compression).or_default() += 1;
            }
            records::Record::Statistics(found) => statistics = Some(found),
            _ => {}
        })?;
        let statistics = statistics?;
        chunks?.agree_with(&statistics).then(|| indexed.with_statistics(statistics))?
    }

    /// Takes the counts over if they agree with what the index lists.
    fn with_statistics(mut self, statistics: records::Statistics) -> Option<Self> {
        let mut counts = statistics.channel_message_counts.values();
        let counted = counts.try_fold(0_u64, |sum, &count| sum.checked_add(count))?;
        let agrees = usize::from(statistics.schema_count) == self.schemas.len()
            && statistics.channel_count as usize == self.channels.len()
            && statistics.message_count == counted
            && self.has_schema_of_every_channel()
            && (statistics.channel_message_counts.keys()).all(|id| self.channels.contains_key(id));
        if !agrees {
            return None;
        }
        if counted > 0 {
            self.start_ns = Some(statistics.message_start_time);
            self.end_ns = Some(statistics.message_end_time);
        }
        self.message_count = counted;
        self.message_counts = statistics.channel_message_counts;
        self.chunk_count = statistics.chunk_count.into();
        self.attachment_count = statistics.attachment_count.into();
        self.metadata_count = statistics.metadata_count.into();
        self.from_summary = true;
        Some(self)
    }

    fn has_schema_of_every_channel(&self) -> bool {
        self.channels
            .values()
            .all(|channel| channel.schema_id == 0 || self.schemas.contains_key(&channel.schema_id))
    }
}

/// What the summary lists of all chunks.
#[derive(Default)]
struct ListedChunks {
    /// Messages by channel.
    counts: BTreeMap<u16, u64>,
    /// Earliest and latest log time.
    times: Option<(u64, u64)>,
}

impl ListedChunks {
    /// Takes a chunk; `None` if it cannot be as the summary says.
    fn take(&mut self, chunk: &records::ChunkIndex) -> Option<()> {
        let end = chunk.chunk_start_offset.checked_add(chunk.chunk_length)?;
        let end = end.checked_add(chunk.message_index_length)?;
        let counts = message_counts(&chunk.message_index_offsets, end)?;
        let mut has_messages = false;
        for (channel, count) in counts {
            *self.counts.entry(channel).or_default() += count;
            has_messages |= count > 0;
        }
        if has_messages {
            let (start, end) = (chunk.message_start_time, chunk.message_end_time);
            let (first, last) = self.times.unwrap_or((start, end));
            self.times = Some((start.min(first), end.max(last)));
        }
        Some(())
    }

    /// Whether the statistics count no fewer messages of any channel, and their times hold those of
    /// the chunks: nothing more if they count no more messages. Chunks may lack message indexes,
    /// and messages may lie outside of chunks.
    fn agree_with(&self, statistics: &records::Statistics) -> bool {
        let count = |channel| statistics.channel_message_counts.get(channel).copied();
        let are_counted =
            self.counts.iter().all(|(channel, &n)| count(channel).unwrap_or_default() >= n);
        let (start, end) = (statistics.message_start_time, statistics.message_end_time);
        let are_all = self.counts.values().sum::<u64>() == statistics.message_count;
        let agree = |(first, last)| match are_all {
            true => (start, end) == (first, last),
            false => start <= first && end >= last,
        };
        are_counted && self.times.is_none_or(agree)
    }
}

fn read_through() -> MutexGuard<'static, VecDeque<(u64, Overview)>> {
    READ_THROUGH.lock().unwrap_or_else(PoisonError::into_inner)
}

fn kept(object: u64) -> Option<Overview> {
    read_through().iter().find(|(id, _)| *id == object).map(|(_, overview)| overview.clone())
}

fn keep(object: u64, overview: &Overview) {
    let mut kept = read_through();
    kept.truncate(MAX_KEPT - 1);
    kept.push_front((object, overview.clone()));
}
