//! Reading a recording from front to back.

mod ahead;
mod attachment;
mod batch;
mod counts;
mod definitions;
mod end;
mod records;
mod sections;
mod summary;
mod times;

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use self::ahead::Ahead;
use self::counts::Counts;
use self::definitions::{Definitions, Listed};
use self::sections::{Section, Sections};
pub use self::times::ReadTimes;
use crate::error::Result;
use crate::filter::ReadFilter;
use crate::input::Fetched;
use crate::overview::Overview;
use crate::part::{Item, Part, SourceChunk};
use crate::plan::Plan;
use crate::record::Record;
use crate::shared_bytes::SharedBytes;
use crate::source::Source;
use crate::workers::Workers;

/// Reads a recording record by record, from any file that the format allows: chunked or not, with
/// or without an index.
///
/// Every checksum that the file has is checked, those of a chunk before any of its records is
/// given. A length is not believed before the bytes have been seen. One chunk is held at a time,
/// or, where threads unpack them, a few for each thread.
pub struct RecordingReader {
    sections: Sections,
    /// The message that was given last.
    message: Option<SharedBytes>,
    /// Bytes that were read of the index beforehand.
    index_bytes: u64,
}

impl RecordingReader {
    /// Opens a recording.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io), or [`Error::Damaged`](crate::Error::Damaged) saying what
    /// the file is if it is no MCAP.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_with(path, true, Workers::none(), Plan::default())
    }

    /// Opens a recording that is read ahead, its chunks unpacked by these threads. What is read is
    /// the same.
    ///
    /// # Errors
    /// Those of [`RecordingReader::open`].
    pub fn open_ahead(path: &Path, workers: &Workers) -> Result<Self> {
        Self::open_with(path, true, workers.clone(), Plan::default())
    }

    /// Opens a recording to read only some of it. Where its index is sound, chunks in which nothing
    /// passes the filter are skipped ([`Record::Skipped`]), all definitions of the summary come
    /// first, and private records in chunks that are skipped are not given. Whatever is outside of
    /// those chunks is read as ever. A channel that the overview lacks, and a schema or channel
    /// that differs from that of the overview, is damage if the overview is from the summary.
    ///
    /// # Errors
    /// Those of [`RecordingReader::open`].
    pub fn open_filtered(
        overview: &Overview,
        filter: &ReadFilter,
        workers: &Workers,
    ) -> Result<Self> {
        let plan = Plan::new(overview, filter);
        let listed = overview.from_summary.then(|| Listed {
            schemas: overview.schemas.clone(),
            channels: overview.channels.clone(),
        });
        let known = (!plan.is_empty()).then(|| Definitions {
            schemas: overview.schemas.clone(),
            channels: overview.channels.clone(),
            listed: listed.clone(),
        });
        let mut reader = Self::open_with(&overview.path, true, workers.clone(), plan)?;
        reader.sections.known = known;
        reader.sections.definitions.listed = listed;
        let numbered: BTreeSet<u16> = filter.numbered.keys().copied().collect();
        if filter.skims_large_chunks {
            reader.sections.source.kept = Some(Arc::new(numbered.clone()));
        }
        reader.sections.numbered = numbered;
        Ok(reader)
    }

    /// As [`RecordingReader::open_ahead`], but the file is not hashed.
    ///
    /// # Errors
    /// Those of [`RecordingReader::open`].
    pub fn open_unhashed(path: &Path, workers: &Workers) -> Result<Self> {
        Self::open_with(path, false, workers.clone(), Plan::default())
    }

    fn open_with(path: &Path, hash: bool, workers: Workers, plan: Plan) -> Result<Self> {
        let source = Source::open(path, hash)?;
        let index_bytes = plan.bytes_read;
        let sections = Sections::new(Ahead::new(source, workers, plan));
        Ok(RecordingReader { sections, message: None, index_bytes })
    }

    /// Leaves all messages out of large chunks ([`ReadFilter::skims_large_chunks`]). To be called
    /// before anything is read.
    pub(crate) fn skim_large_chunks(&mut self) {
        self.sections.source.kept = Some(Arc::default());
    }

    /// Gives messages unpacked that are compressed each by itself, as rosbag2 writes them with
    /// `compression_mode: message`. Chunks with such messages are not given as they lie.
    pub fn unpack_messages(&mut self) {
        self.sections.unpacks_messages = true;
    }

    /// Whether a message was unpacked that was compressed by itself.
    pub fn has_unpacked_messages(&self) -> bool {
        self.sections.has_unpacked
    }

    fn source(&self) -> &Source {
        &self.sections.source.source
    }

    /// Bytes of the file; of a stream 0.
    pub fn file_size(&self) -> u64 {
        self.source().size.unwrap_or(0)
    }

    /// Bytes of the file up to the end of what was given last.
    pub fn offset(&self) -> u64 {
        self.sections.offset
    }

    /// Bytes that were read of the file so far, those of the index included where it was used.
    pub fn bytes_read(&self) -> u64 {
        self.source().bytes_read() + self.index_bytes
    }

    /// What was fetched over the network, if the recording is at an address.
    pub fn fetched(&self) -> Option<Fetched> {
        self.source().fetched()
    }

    /// The number of the remote object ([`Source::object_id`]).
    pub(crate) fn object_id(&self) -> Option<u64> {
        self.source().object_id()
    }

    /// What reading took so far.
    pub fn times(&self) -> ReadTimes {
        ReadTimes { read: self.sections.source.steps, ..self.sections.times }
    }

    /// Whether the file ends with the magic that closes a recording.
    pub fn is_complete(&self) -> bool {
        self.source().is_complete
    }

    pub(crate) fn counts(&self) -> Counts {
        self.sections.counts
    }

    /// Chunks so far by compression.
    pub(crate) fn compression(&self) -> &BTreeMap<String, u64> {
        &self.sections.compression
    }

    /// The next record, or `None` at the end.
    ///
    /// What costs no message (a damaged index at the end, a cut) comes as [`Record::Damaged`] or
    /// [`Record::Truncated`].
    ///
    /// # Errors
    /// [`Error::Damaged`](crate::Error::Damaged) with the place and what is wrong there,
    /// [`Error::Io`](crate::Error::Io). Nothing is given after an error.
    pub fn next_record(&mut self) -> Result<Option<Record<'_>>> {
        self.message = None;
        Ok(match self.find().inspect_err(|_| self.sections.end())? {
            Some(Item::Message { header, data, position }) => {
                let data = Cow::Borrowed(&**self.message.insert(data));
                Some(Record::Message { header, data, position })
            }
            Some(Item::Record(record)) => Some(record),
            None => None,
        })
    }

    /// The next chunk, or the next record outside of chunks, or `None` at the end; as
    /// [`RecordingReader::next_record`] otherwise. Records of a chunk that were given one by one
    /// are not given again.
    ///
    /// # Errors
    /// Those of [`RecordingReader::next_record`], before anything of the damaged chunk is given.
    pub fn next_part(&mut self) -> Result<Option<Part>> {
        self.find_part().inspect_err(|_| self.sections.end())
    }

    /// Reads the rest of the file and returns the SHA-256 of all of it in lowercase hexadecimal;
    /// `None` if some of it was skipped.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    pub fn finish(&mut self) -> Result<Option<String>> {
        self.sections.source.source.finish()
    }

    fn find(&mut self) -> Result<Option<Item>> {
        let sections = &mut self.sections;
        loop {
            if sections.batch.has_next() {
                if let Some(found) = sections.next_of_batch()? {
                    return Ok(Some(found));
                }
            } else if let Some((offset, chunk)) = sections.unopened.take() {
                sections.counts.messages -= chunk.message_count();
                sections.open_chunk(offset, chunk.record())?;
            } else if let Some(record) = sections.pending.pop_front() {
                return Ok(Some(Item::Record(record)));
            } else if sections.section == Section::End {
                return Ok(None);
            } else {
                sections.step()?;
            }
        }
    }

    fn find_part(&mut self) -> Result<Option<Part>> {
        let sections = &mut self.sections;
        loop {
            if sections.batch.has_next() {
                return self.rest_of_batch().map(Some);
            } else if let Some((_, chunk)) = sections.unopened.take() {
                return Ok(Some(Part::Chunk(chunk)));
            } else if let Some(record) = sections.pending.pop_front() {
                return Ok(Some(Part::Items(vec![Item::Record(record)])));
            } else if sections.section == Section::End {
                return Ok(None);
            }
            sections.step()?;
        }
    }

    /// All records of the batch from the next one on.
    fn rest_of_batch(&mut self) -> Result<Part> {
        let sections = &mut self.sections;
        let is_chunk = sections.batch.is_copyable && sections.batch.next == 0;
        let mut items = Vec::new();
        while sections.batch.has_next() {
            items.extend(sections.next_of_batch()?);
        }
        let batch = std::mem::take(&mut sections.batch);
        if !is_chunk || batch.has_unpacked {
            return Ok(Part::Items(items));
        }
        let records = (!batch.records.is_skimmed()).then_some(batch.records.bytes);
        let record = std::mem::take(&mut sections.record);
        let chunk = SourceChunk::new(batch.offset, &record, (items, batch.places), records);
        Ok(chunk.map_or_else(Part::Items, Part::Chunk))
    }
}
