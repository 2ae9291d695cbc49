//! Reading a recording from front to back.

mod batch;
mod summary;

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::Path;

use mcap::records::{self, Channel, op};

use self::batch::{Batch, Found};
use self::summary::Summary;
use super::chunk;
use super::index;
use super::record::{Record, Schema};
use super::scan::{HEAD_LEN, MAX_RECORD, Source};
use super::words::{crc_mismatch, record_name};
use crate::error::{Error, Result};

/// Reads a recording record by record, from any file that the format allows: chunked or not, with or
/// without an index.
///
/// Every checksum that the file has is checked, those of a chunk before any of its records is given.
/// A length is never believed before the bytes have been seen. One chunk is held at a time.
pub struct RecordingReader {
    source: Source,
    section: Section,
    /// Opcode of the record of the file that was read last.
    previous: u8,
    batch: Batch,
    /// Body of the record of the file that was read last.
    body: Vec<u8>,
    /// Checksum of the section so far.
    crc: crc32fast::Hasher,
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    summary: Summary,
    counts: Counts,
    waiting: VecDeque<Record<'static>>,
    pub(super) compression: BTreeSet<String>,
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
        Self::open_hashing(path, true)
    }

    pub(super) fn open_hashing(path: &Path, hash: bool) -> Result<Self> {
        let source = Source::open(path, hash)?;
        let mut crc = crc32fast::Hasher::new();
        crc.update(mcap::MAGIC);
        Ok(RecordingReader {
            source,
            section: Section::Start,
            previous: 0,
            batch: Batch::default(),
            body: Vec::new(),
            crc,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            summary: Summary::default(),
            counts: Counts::default(),
            waiting: VecDeque::new(),
            compression: BTreeSet::new(),
        })
    }

    /// Bytes of the file.
    pub fn file_size(&self) -> u64 {
        self.source.size
    }

    /// Bytes read so far.
    pub fn offset(&self) -> u64 {
        self.source.offset
    }

    /// Whether the file ends with the magic that closes a recording.
    pub fn is_complete(&self) -> bool {
        self.source.is_complete
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

    /// Reads what is left of the file and returns the SHA-256 of all of it in lowercase hexadecimal.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(self) -> Result<String> {
        self.source.finish()
    }

    fn end(&mut self) {
        self.section = Section::End;
        self.batch.bytes.clear();
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
        let offset = self.source.offset;
        let tail = if self.source.is_complete { mcap::MAGIC.len() as u64 } else { 0 };
        let left = self.source.remaining().saturating_sub(tail);
        if left < HEAD_LEN as u64 {
            return self.run_out(offset, left, "a record is cut in its length");
        }
        let mut head = Vec::with_capacity(HEAD_LEN);
        self.source.read(HEAD_LEN as u64, &mut head)?;
        let (opcode, length) = chunk::split_head(&head).unwrap_or_default();
        let left = left - HEAD_LEN as u64;
        if length > left && !self.source.is_complete {
            return self.cut(offset, opcode, length, left);
        }
        if length > left || length > MAX_RECORD {
            return Err(self.source.damage(
                offset,
                format!(
                    "{} claims {length} bytes; {left} are left in the file, and {MAX_RECORD} are \
                     the most that can be read here",
                    record_name(opcode)
                ),
            ));
        }
        self.body.clear();
        self.source.read(length, &mut self.body)?;
        self.take_record(offset, opcode, &head)?;
        self.previous = opcode;
        Ok(())
    }

    fn take_record(&mut self, offset: u64, opcode: u8, head: &[u8]) -> Result<()> {
        let section_crc = self.crc.clone();
        self.crc.update(head);
        match opcode {
            op::FOOTER => self.crc.update(self.body.get(..16).unwrap_or_default()),
            _ => self.crc.update(&self.body),
        }
        match (self.section, opcode) {
            (Section::Start, op::HEADER) => self.take_header(offset),
            (Section::Start, _) => Err(self.source.damage(
                offset,
                format!("the file starts with {}, not with its header", record_name(opcode)),
            )),
            (Section::Data, op::CHUNK) => self.take_chunk(offset),
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

    fn take_chunk(&mut self, offset: u64) -> Result<()> {
        self.counts.chunks += 1;
        self.open_batch(offset, true);
        if let Err(problem) = chunk::unpack(&self.body, &mut self.batch.bytes) {
            self.batch.bytes.clear();
            return Err(self.source.damage(offset, problem + &self.topics_of(offset)));
        }
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
        self.open_batch(offset, false);
        self.batch.bytes.clear();
        self.batch.bytes.extend_from_slice(head);
        self.batch.bytes.extend_from_slice(&self.body);
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
        self.summary.start = self.source.offset;
        self.section = Section::Summary;
        Ok(())
    }

    /// No record follows although the footer has not come.
    fn run_out(&mut self, offset: u64, left: u64, cut: &str) -> Result<()> {
        if self.source.is_complete {
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
    fn cut(&mut self, offset: u64, opcode: u8, length: u64, left: u64) -> Result<()> {
        let mut problem = format!(
            "the file is cut off in {} of {length} bytes, of which {left} are there",
            record_name(opcode)
        );
        if (self.section, opcode) == (Section::Data, op::CHUNK) && left <= MAX_RECORD {
            self.body.clear();
            self.source.read(left, &mut self.body)?;
            self.open_batch(offset, true);
            chunk::salvage(&self.body, length, &mut self.batch.bytes);
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
        mcap::parse_record(opcode, &self.body).map_err(|_| self.unreadable(offset, opcode))
    }

    fn unreadable(&self, offset: u64, opcode: u8) -> Error {
        let problem = format!("{} cannot be parsed", record_name(opcode));
        self.source.damage(offset, problem)
    }

    /// Topics of the messages in a damaged chunk, if the index still tells.
    fn topics_of(&self, chunk_offset: u64) -> String {
        match index::topics_of_chunk(&self.source.path, self.source.size, chunk_offset) {
            Some(topics) if !topics.is_empty() => {
                let topics: Vec<String> = topics.into_iter().collect();
                format!("; the chunk holds messages of {}", topics.join(", "))
            }
            _ => String::new(),
        }
    }
}
