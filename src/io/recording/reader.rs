//! Reading a recording from front to back.

mod ahead;
mod batch;
mod summary;

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use mcap::records::{self, Channel, op};
use serde::Serialize;

use self::ahead::{Ahead, Next, Raw, Records};
use self::batch::{Batch, Found};
use self::summary::Summary;
use super::chunk;
use super::index;
use super::input::Fetched;
use super::overview::Overview;
use super::parse::parse_record;
use super::part::{Item, Part, SharedBytes, SourceChunk};
use super::record::{Record, Schema};
use super::scan::{MAX_RECORD, Source};
use super::wanted::{Plan, Wanted};
use super::words::{crc_mismatch, record_name};
use crate::error::{Error, Result};
use crate::stopwatch::Steps;
use crate::workers::Workers;

/// Reads a recording record by record, from any file that the format allows: chunked or not, with or
/// without an index.
///
/// Every checksum that the file has is checked, those of a chunk before any of its records is given.
/// A length is never believed before the bytes have been seen. One chunk is held at a time, or, where threads
/// unpack them, a few for each thread.
pub struct RecordingReader {
    source: Ahead,
    /// Where the record of the file ends that was taken last.
    offset: u64,
    section: Section,
    /// Opcode of the record of the file that was read last.
    previous: u8,
    batch: Batch,
    /// Body of the record of the file that was read last.
    body: Arc<Vec<u8>>,
    /// Checksum of the section so far.
    crc: crc32fast::Hasher,
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    summary: Summary,
    counts: Counts,
    waiting: VecDeque<Record<'static>>,
    /// Chunks by compression.
    pub(super) compression: BTreeMap<String, u64>,
    times: ReadTimes,
    /// Definitions that are given first, where some of those in the file may be passed over.
    known: Option<Definitions>,
    /// Channels whose messages must not be left in chunks that are not opened.
    numbered: BTreeSet<u16>,
    /// A chunk that was not opened, to be given next, and where it begins.
    closed: Option<(u64, SourceChunk)>,
    /// Whether something was passed over.
    has_passed: bool,
    /// Bytes that were read of the index beforehand.
    index_bytes: u64,
}

/// Schemas and channels.
type Definitions = (BTreeMap<u16, Schema>, BTreeMap<u16, Channel>);

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

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Section {
    Start,
    Data,
    Summary,
    End,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Counts {
    pub(super) messages: u64,
    pub(super) chunks: u64,
    pub(super) attachments: u64,
    pub(super) metadata: u64,
}

impl RecordingReader {
    /// Opens a recording.
    ///
    /// # Errors
    /// [`Error::Io`], or [`Error::Recording`] saying what the file is if it is no MCAP.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_with(path, true, Workers::none(), Plan::default())
    }

    /// Opens a recording that is read ahead, its chunks unpacked by these threads. What is read is the same.
    ///
    /// # Errors
    /// Those of [`RecordingReader::open`].
    pub fn open_ahead(path: &Path, workers: &Workers) -> Result<Self> {
        Self::open_with(path, true, workers.clone(), Plan::default())
    }

    /// Opens a recording of which not everything is wanted. Where its index can be relied on, chunks without anything
    /// that is wanted are not read ([`Record::Passed`]), all definitions of the summary come first, and what such
    /// chunks hold besides messages and definitions is not given. Whatever is outside of those chunks is read as ever.
    ///
    /// # Errors
    /// Those of [`RecordingReader::open`].
    pub fn open_wanted(overview: &Overview, wanted: &Wanted, workers: &Workers) -> Result<Self> {
        let plan = Plan::new(overview, wanted);
        let known =
            (!plan.is_empty()).then(|| (overview.schemas.clone(), overview.channels.clone()));
        let mut reader = Self::open_with(&overview.path, true, workers.clone(), plan)?;
        reader.known = known;
        reader.numbered = wanted.numbered.keys().copied().collect();
        Ok(reader)
    }

    /// As [`RecordingReader::open_ahead`] for a recording whose hash is not wanted.
    ///
    /// # Errors
    /// Those of [`RecordingReader::open`].
    pub fn open_unhashed(path: &Path, workers: &Workers) -> Result<Self> {
        Self::open_with(path, false, workers.clone(), Plan::default())
    }

    fn open_with(path: &Path, hash: bool, workers: Workers, plan: Plan) -> Result<Self> {
        let source = Source::open(path, hash)?;
        let offset = source.offset;
        let mut crc = crc32fast::Hasher::new();
        crc.update(mcap::MAGIC);
        Ok(RecordingReader {
            index_bytes: plan.bytes_read,
            source: Ahead::new(source, workers, plan),
            offset,
            section: Section::Start,
            previous: 0,
            batch: Batch::default(),
            body: Arc::default(),
            crc,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            summary: Summary::default(),
            counts: Counts::default(),
            waiting: VecDeque::new(),
            compression: BTreeMap::new(),
            times: ReadTimes::default(),
            known: None,
            numbered: BTreeSet::new(),
            closed: None,
            has_passed: false,
        })
    }

    /// Bytes of the file; of a stream 0.
    pub fn file_size(&self) -> u64 {
        self.source.source.size.unwrap_or(0)
    }

    /// Bytes of the file up to the end of what was given last.
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// Bytes that were read of the file so far, those of the index included where it was used.
    pub fn bytes_read(&self) -> u64 {
        self.source.source.bytes_read() + self.index_bytes
    }

    /// What was fetched over the network, if the recording is at an address.
    pub fn fetched(&self) -> Option<Fetched> {
        self.source.source.fetched()
    }

    /// What is known of a recording that took a reading through to know, if it is far away.
    pub(super) fn known_overview(&self) -> Option<Arc<OnceLock<Overview>>> {
        self.source.source.known_overview()
    }

    /// What reading took so far.
    pub fn times(&self) -> ReadTimes {
        ReadTimes { read: self.source.steps, ..self.times }
    }

    /// Whether the file ends with the magic that closes a recording.
    pub fn is_complete(&self) -> bool {
        self.source.source.is_complete
    }

    pub(super) fn counts(&self) -> Counts {
        self.counts
    }

    /// The next record, or `None` at the end.
    ///
    /// What costs no message (a damaged index at the end, a cut) comes as [`Record::Damaged`] or
    /// [`Record::Truncated`].
    ///
    /// # Errors
    /// [`Error::Recording`] with the place and what is wrong there, [`Error::Io`]. Nothing is given
    /// after an error.
    pub fn next_record(&mut self) -> Result<Option<Record<'_>>> {
        let found = self.find().inspect_err(|_| self.end())?;
        let Some(found) = found else {
            return Ok(None);
        };
        Ok(Some(match found {
            Found::Owned(record) => record,
            Found::Message(header, place, position) => {
                Record::Message { header, data: Cow::Borrowed(&self.batch.bytes[place]), position }
            }
            Found::Private(opcode, place) => Record::Private {
                opcode,
                data: Cow::Borrowed(&self.batch.bytes[place]),
                in_chunk: self.batch.in_chunk,
            },
        }))
    }

    /// The next chunk, or the next record outside of chunks, or `None` at the end; as
    /// [`RecordingReader::next_record`] otherwise. What of a chunk was given as records is not given again.
    ///
    /// # Errors
    /// Those of [`RecordingReader::next_record`], before anything of the chunk that they are met in.
    pub fn next_part(&mut self) -> Result<Option<Part>> {
        self.find_part().inspect_err(|_| self.end())
    }

    /// Reads what is left of the file and returns the SHA-256 of all of it in lowercase hexadecimal; nothing if some of
    /// it was passed over.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(&mut self) -> Result<Option<String>> {
        self.source.finish()
    }

    fn end(&mut self) {
        self.section = Section::End;
        self.batch.bytes = Arc::default();
        self.waiting.clear();
    }

    fn find(&mut self) -> Result<Option<Found>> {
        loop {
            if self.batch.next < self.batch.bytes.len() {
                if let Some(found) = self.next_of_batch()? {
                    return Ok(Some(found));
                }
            } else if let Some((offset, chunk)) = self.closed.take() {
                self.counts.messages -= chunk.message_count();
                self.open_closed(offset, chunk.body())?;
            } else if let Some(record) = self.waiting.pop_front() {
                return Ok(Some(Found::Owned(record)));
            } else if self.section == Section::End {
                return Ok(None);
            } else {
                self.step()?;
            }
        }
    }

    fn find_part(&mut self) -> Result<Option<Part>> {
        loop {
            if self.batch.next < self.batch.bytes.len() {
                return self.rest_of_batch().map(Some);
            } else if let Some((_, chunk)) = self.closed.take() {
                return Ok(Some(Part::Chunk(chunk)));
            } else if let Some(record) = self.waiting.pop_front() {
                return Ok(Some(Part::Items(vec![Item::Record(record)])));
            } else if self.section == Section::End {
                return Ok(None);
            }
            self.step()?;
        }
    }

    /// All records of the batch from the next one on.
    fn rest_of_batch(&mut self) -> Result<Part> {
        let is_chunk = self.batch.is_copyable && self.batch.next == 0;
        let mut items = Vec::new();
        while self.batch.next < self.batch.bytes.len() {
            let found = self.next_of_batch()?;
            items.extend(found.map(|found| self.item(found)));
        }
        Ok(match is_chunk {
            true => SourceChunk::new(&self.body, items).map_or_else(Part::Items, Part::Chunk),
            false => Part::Items(items),
        })
    }

    fn item(&self, found: Found) -> Item {
        match found {
            Found::Owned(record) => Item::Record(record),
            Found::Message(header, place, position) => {
                Item::Message { header, data: SharedBytes::new(&self.batch.bytes, place), position }
            }
            Found::Private(opcode, place) => Item::Record(Record::Private {
                opcode,
                data: Cow::Owned(self.batch.bytes[place].to_vec()),
                in_chunk: self.batch.in_chunk,
            }),
        }
    }

    /// Reads one record of the file. Damage of the summary ends it and costs no message.
    fn step(&mut self) -> Result<()> {
        match (self.read_record(), self.section) {
            (Err(Error::Recording { offset, problem, .. }), Section::Summary) => {
                self.give_up_summary(offset, problem);
                Ok(())
            }
            (result, _) => result,
        }
    }

    fn read_record(&mut self) -> Result<()> {
        match self.source.next()? {
            Next::RunOut { offset, left } => {
                self.run_out(offset, left, "a record is cut in its length")
            }
            Next::Cut { offset, opcode, length, left, body } => {
                self.cut(offset, opcode, length, left, body)
            }
            Next::Closed { offset, end, head, body, indexes, chunk } => {
                for bytes in [&head, &*body, &*indexes] {
                    self.crc.update(bytes);
                }
                (self.offset, self.previous) = (end, op::CHUNK);
                let compression = chunk::compression(&body).unwrap_or_default().to_owned();
                *self.compression.entry(compression).or_default() += 1;
                self.counts.chunks += 1;
                match chunk.wait().filter(|chunk| self.may_stay_closed(chunk)) {
                    Some(chunk) => {
                        self.counts.messages += chunk.message_count();
                        self.closed = Some((offset, chunk));
                        Ok(())
                    }
                    None => self.open_closed(offset, &body),
                }
            }
            Next::Passed { end, counts } => {
                (self.offset, self.has_passed, self.previous) = (end, true, op::CHUNK);
                self.waiting.push_back(Record::Passed { counts });
                Ok(())
            }
            Next::Record(raw) => {
                self.offset = raw.end;
                self.take_raw(raw)
            }
        }
    }

    /// Whether a chunk's message indexes tell of known channels alone, and of none that is looked into.
    fn may_stay_closed(&self, chunk: &SourceChunk) -> bool {
        chunk.counts().all(|(channel, _)| {
            self.channels.contains_key(&channel) && !self.numbered.contains(&channel)
        })
    }

    /// Opens a chunk after all.
    fn open_closed(&mut self, offset: u64, body: &Arc<Vec<u8>>) -> Result<()> {
        let mut records = Vec::new();
        chunk::unpack(body, &mut records)
            .map_err(|problem| self.source.damage(offset, problem + &self.topics_of(offset)))?;
        self.body = Arc::clone(body);
        self.open_batch(offset, true, records);
        self.batch.is_copyable = true;
        Ok(())
    }

    fn take_raw(&mut self, raw: Raw) -> Result<()> {
        let Raw { offset, opcode, head, body, unpacked, .. } = raw;
        self.body = body;
        let records = unpacked.map(|unpacked| {
            let started = Instant::now();
            let (records, ms) = unpacked.wait();
            self.times.wait.take_since(started, 0);
            let bytes = records.as_ref().map_or(0, |records| records.len() as u64);
            self.times.unpack.take(ms, bytes);
            records
        });
        self.take_record(offset, opcode, &head, records)?;
        self.previous = opcode;
        Ok(())
    }

    fn take_record(
        &mut self,
        offset: u64,
        opcode: u8,
        head: &[u8],
        records: Option<Records>,
    ) -> Result<()> {
        let section_crc = self.crc.clone();
        self.crc.update(head);
        match opcode {
            op::FOOTER => self.crc.update(self.body.get(..16).unwrap_or_default()),
            _ => self.crc.update(&self.body),
        }
        match (self.section, opcode) {
            (Section::Data, op::CHUNK) => {
                let records = records.unwrap_or_else(|| Ok(Vec::new()));
                self.take_chunk(offset, records)
            }
            (Section::Start, op::HEADER) => self.take_header(offset),
            (Section::Start, _) => Err(self.source.damage(
                offset,
                format!("the file starts with {}, not with its header", record_name(opcode)),
            )),
            (Section::Data, op::MESSAGE_INDEX) => self.take_message_index(offset),
            (Section::Data, op::DATA_END) => self.take_data_end(offset, section_crc),
            (
                Section::Data,
                op::SCHEMA | op::CHANNEL | op::MESSAGE | op::ATTACHMENT | op::METADATA | 0x10..,
            )
            | (Section::Summary, 0x10..) => {
                self.take_bare(offset, head);
                Ok(())
            }
            (Section::Summary, op::SCHEMA | op::CHANNEL | op::STATISTICS) => {
                self.take_summary(offset, opcode)
            }
            (
                Section::Summary,
                op::CHUNK_INDEX | op::ATTACHMENT_INDEX | op::METADATA_INDEX | op::SUMMARY_OFFSET,
            ) => self.parse(offset, opcode).map(drop),
            (Section::Summary, op::FOOTER) => self.take_footer(offset),
            (Section::End, _) => Ok(()),
            (section, _) => Err(self.source.damage(
                offset,
                format!(
                    "{} (opcode {opcode:#04x}) where none can be, in the {}",
                    record_name(opcode),
                    match section {
                        Section::Summary => "summary",
                        _ => "data",
                    }
                ),
            )),
        }
    }

    fn take_header(&mut self, offset: u64) -> Result<()> {
        if let records::Record::Header(header) = self.parse(offset, op::HEADER)? {
            self.waiting
                .push_back(Record::Header { profile: header.profile, library: header.library });
        }
        self.section = Section::Data;
        if let Some((schemas, channels)) = self.known.take() {
            self.waiting.extend(schemas.values().cloned().map(Record::Schema));
            self.waiting.extend(channels.values().cloned().map(Record::Channel));
            (self.schemas, self.channels) = (schemas, channels);
        }
        Ok(())
    }

    fn take_chunk(&mut self, offset: u64, records: Records) -> Result<()> {
        self.counts.chunks += 1;
        match records {
            Ok(records) => self.open_batch(offset, true, records),
            Err(problem) => {
                return Err(self.source.damage(offset, problem + &self.topics_of(offset)));
            }
        }
        self.batch.is_copyable = true;
        if let Some(compression) = chunk::compression(&self.body) {
            *self.compression.entry(compression.to_owned()).or_default() += 1;
        }
        Ok(())
    }

    /// An index is not needed here, but one without its chunk tells of a chunk that was not seen.
    fn take_message_index(&mut self, offset: u64) -> Result<()> {
        self.parse(offset, op::MESSAGE_INDEX)?;
        if !matches!(self.previous, op::CHUNK | op::MESSAGE_INDEX) {
            let problem = "an index of messages without the chunk that should be before it; a \
                           chunk may be missing";
            let problem = problem.to_owned();
            self.waiting.push_back(Record::Damaged { offset, problem });
        }
        Ok(())
    }

    fn take_bare(&mut self, offset: u64, head: &[u8]) {
        self.open_batch(offset, false, [head, &self.body].concat());
    }

    fn take_data_end(&mut self, offset: u64, crc: crc32fast::Hasher) -> Result<()> {
        if let records::Record::DataEnd(end) = self.parse(offset, op::DATA_END)? {
            let (stored, computed) = (end.data_section_crc, crc.finalize());
            if stored != 0 && stored != computed && !self.has_passed {
                let problem = crc_mismatch("data section", stored, computed);
                return Err(self.source.damage(offset, problem));
            }
        }
        self.crc = crc32fast::Hasher::new();
        self.summary.start = self.offset;
        self.section = Section::Summary;
        Ok(())
    }

    /// No record follows although the footer has not come.
    fn run_out(&mut self, offset: u64, left: u64, cut: &str) -> Result<()> {
        if self.is_complete() {
            return Err(self
                .source
                .damage(offset, "the recording ends without the records that should close it"));
        }
        let problem = match left {
            0 => "the file ends before the records that should close it",
            _ => cut,
        };
        self.truncate(offset, problem.to_owned());
        Ok(())
    }

    /// The file ends within a record: what is there of a chunk is given.
    fn cut(
        &mut self,
        offset: u64,
        opcode: u8,
        length: u64,
        left: u64,
        body: Vec<u8>,
    ) -> Result<()> {
        let mut problem = format!(
            "the file is cut off in {} of {length} bytes, of which {left} are there",
            record_name(opcode)
        );
        if (self.section, opcode) == (Section::Data, op::CHUNK) && left <= MAX_RECORD {
            let mut records = Vec::new();
            chunk::salvage(&body, &mut records);
            self.open_batch(offset, true, records);
            problem += "; its messages up to there are kept, unchecked";
        }
        self.truncate(offset, problem);
        Ok(())
    }

    fn truncate(&mut self, offset: u64, problem: String) {
        if self.section == Section::Summary {
            self.give_summary(offset);
        }
        self.waiting.push_back(Record::Truncated { offset, problem });
        self.section = Section::End;
    }

    fn parse(&self, offset: u64, opcode: u8) -> Result<records::Record<'_>> {
        parse_record(opcode, &self.body).ok_or_else(|| self.unreadable(offset, opcode))
    }

    fn unreadable(&self, offset: u64, opcode: u8) -> Error {
        let problem = format!("{} cannot be parsed", record_name(opcode));
        self.source.damage(offset, problem)
    }

    /// Topics of the messages in a damaged chunk, if the index still tells.
    fn topics_of(&self, chunk_offset: u64) -> String {
        match index::topics_of_chunk(&self.source.source.path, self.file_size(), chunk_offset) {
            Some(topics) if !topics.is_empty() => {
                let topics: Vec<String> = topics.into_iter().collect();
                format!("; the chunk holds messages of {}", topics.join(", "))
            }
            _ => String::new(),
        }
    }
}
