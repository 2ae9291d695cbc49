//! Reading a recording from front to back.

mod ahead;
mod batch;
mod summary;

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use mcap::records::{self, Channel, op};
use serde::Serialize;

use self::ahead::{Ahead, Next, Raw, Records};
use self::batch::{Batch, Found};
use self::summary::Summary;
use super::chunk;
use super::index;
use super::parse::parse_record;
use super::part::{Item, Part, SharedBytes, SourceChunk};
use super::record::{Record, Schema};
use super::scan::{MAX_RECORD, Source};
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
    pub(super) compression: BTreeSet<String>,
    times: ReadTimes,
}

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
        Self::open_with(path, true, Workers::none())
    }

    /// Opens a recording that is read ahead, its chunks unpacked by these threads. What is read is the same.
    ///
    /// # Errors
    /// Those of [`RecordingReader::open`].
    pub fn open_ahead(path: &Path, workers: &Workers) -> Result<Self> {
        Self::open_with(path, true, workers.clone())
    }

    /// Opens a recording whose hash is not wanted.
    pub(super) fn open_unhashed(path: &Path) -> Result<Self> {
        Self::open_with(path, false, Workers::none())
    }

    fn open_with(path: &Path, hash: bool, workers: Workers) -> Result<Self> {
        let source = Source::open(path, hash)?;
        let offset = source.offset;
        let mut crc = crc32fast::Hasher::new();
        crc.update(mcap::MAGIC);
        Ok(RecordingReader {
            source: Ahead::new(source, workers),
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
            compression: BTreeSet::new(),
            times: ReadTimes::default(),
        })
    }

    /// Bytes of the file.
    pub fn file_size(&self) -> u64 {
        self.source.source.size
    }

    /// Bytes of the file up to the end of what was given last.
    pub fn offset(&self) -> u64 {
        self.offset
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

    /// Reads what is left of the file and returns the SHA-256 of all of it in lowercase hexadecimal.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(self) -> Result<String> {
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
            Next::Record(raw) => {
                self.offset = raw.end;
                self.take_raw(raw)
            }
        }
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
        let compression = chunk::compression(&self.body);
        self.compression.extend(compression.map(str::to_owned));
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
            if stored != 0 && stored != computed {
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
