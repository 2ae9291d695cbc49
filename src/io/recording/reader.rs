//! Reading a recording from front to back.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::Range;
use std::path::Path;

use mcap::records::{self, AttachmentHeader, Channel, MessageHeader, op};

use super::chunk;
use super::overview;
use super::record::{Position, Record, Schema};
use super::scan::{Fields, HEAD_LEN, MAX_RECORD, Source};
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

/// Records that are in memory with their heads: those of a chunk, or one that was outside.
#[derive(Default)]
struct Batch {
    bytes: Vec<u8>,
    next: usize,
    offset: u64,
    in_chunk: bool,
    messages: u32,
}

/// What the end of the file says, held back until its checksum has been checked.
#[derive(Default)]
struct Summary {
    start: u64,
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    statistics: Option<records::Statistics>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Counts {
    pub(super) messages: u64,
    pub(super) chunks: u64,
    pub(super) attachments: u64,
    pub(super) metadata: u64,
}

/// A record of the batch; messages and private records stay there.
enum Found {
    Owned(Record<'static>),
    Message(MessageHeader, Range<usize>, Position),
    Private(u8, Range<usize>),
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
    /// [`Error::Recording`] with the place and what is wrong there, [`Error::Io`].
    pub fn next_record(&mut self) -> Result<Option<Record<'_>>> {
        let Some(found) = self.find()? else {
            return Ok(None);
        };
        Ok(Some(match found {
            Found::Owned(record) => record,
            Found::Message(header, place, position) => Record::Message {
                header,
                data: Cow::Borrowed(&self.batch.bytes[place]),
                position,
            },
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
            (
                Err(Error::Recording {
                    offset, problem, ..
                }),
                Section::Summary,
            ) => {
                self.give_up_summary(offset, problem);
                Ok(())
            }
            (result, _) => result,
        }
    }

    fn read_record(&mut self) -> Result<()> {
        let offset = self.source.offset;
        let tail = if self.source.is_complete {
            mcap::MAGIC.len() as u64
        } else {
            0
        };
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
                format!(
                    "the file starts with {}, not with its header",
                    record_name(opcode)
                ),
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
            self.waiting.push_back(Record::Header {
                profile: header.profile,
                library: header.library,
            });
        }
        self.section = Section::Data;
        Ok(())
    }

    fn take_chunk(&mut self, offset: u64) -> Result<()> {
        self.counts.chunks += 1;
        self.open_batch(offset, true);
        if let Err(problem) = chunk::unpack(&self.body, &mut self.batch.bytes) {
            self.batch.bytes.clear();
            return Err(self
                .source
                .damage(offset, problem + &self.topics_of(offset)));
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

    fn take_summary(&mut self, offset: u64, opcode: u8) -> Result<()> {
        match self.parse(offset, opcode)? {
            records::Record::Schema { header, data } => {
                let schema = owned_schema(header, &data);
                let is_new = self.is_new_schema(offset, &schema)?;
                let new = is_new.then_some((schema.id, schema));
                self.summary.schemas.extend(new);
            }
            records::Record::Channel(channel) => {
                let is_new = self.is_new_channel(offset, &channel)?;
                let new = is_new.then_some((channel.id, channel));
                self.summary.channels.extend(new);
            }
            records::Record::Statistics(statistics) => {
                self.summary.statistics = Some(statistics);
            }
            _ => {}
        }
        Ok(())
    }

    fn take_footer(&mut self, offset: u64) -> Result<()> {
        let records::Record::Footer(footer) = self.parse(offset, op::FOOTER)? else {
            return Ok(());
        };
        let (stored, computed) = (footer.summary_crc, self.crc.clone().finalize());
        if stored != 0 && stored != computed {
            let problem = crc_mismatch("summary section", stored, computed);
            return Err(self.source.damage(offset, problem));
        }
        if footer.summary_start != 0 && footer.summary_start != self.summary.start {
            let problem = format!(
                "the footer says that the summary starts at byte {}, but it starts at {}",
                footer.summary_start, self.summary.start
            );
            return Err(self.source.damage(offset, problem));
        }
        self.give_summary(offset);
        self.section = Section::End;
        self.check_end()
    }

    /// Gives what only the summary has, and compares its counts with what was read.
    fn give_summary(&mut self, offset: u64) {
        let Summary {
            schemas,
            channels,
            statistics,
            ..
        } = std::mem::take(&mut self.summary);
        for schema in schemas.into_values() {
            self.schemas.insert(schema.id, schema.clone());
            self.waiting.push_back(Record::Schema(schema));
        }
        for channel in channels.into_values() {
            if channel.schema_id == 0 || self.schemas.contains_key(&channel.schema_id) {
                self.waiting.push_back(Record::Channel(channel));
            } else {
                let problem = unknown_schema(&channel);
                self.waiting.push_back(Record::Damaged { offset, problem });
            }
        }
        let Some(statistics) = statistics else {
            return;
        };
        let counted = self.counts;
        let pairs = [
            ("messages", statistics.message_count, counted.messages),
            (
                "attachments",
                statistics.attachment_count.into(),
                counted.attachments,
            ),
            (
                "metadata records",
                statistics.metadata_count.into(),
                counted.metadata,
            ),
        ];
        for (what, said, found) in pairs.into_iter().filter(|(_, said, found)| said != found) {
            let problem = format!("the summary counts {said} {what}, the file has {found}");
            self.waiting.push_back(Record::Damaged { offset, problem });
        }
    }

    /// Ends at damage in the summary. What only the summary had cannot be trusted and is left out.
    fn give_up_summary(&mut self, offset: u64, problem: String) {
        let problem = format!(
            "the summary at the end of the file is damaged ({problem}); the messages are not \
             affected, but what stands only in the summary is left out"
        );
        self.waiting.push_back(Record::Damaged { offset, problem });
        self.batch.bytes.clear();
        self.section = Section::End;
    }

    /// Looks at what is behind the footer.
    fn check_end(&mut self) -> Result<()> {
        let offset = self.source.offset;
        let mut end = Vec::new();
        let length = self.source.remaining().min(mcap::MAGIC.len() as u64);
        self.source.read(length, &mut end)?;
        let more = self.source.remaining();
        let (offset, problem) = match (end == mcap::MAGIC, more) {
            (true, 0) => return Ok(()),
            (true, _) => (
                self.source.offset,
                format!("{more} bytes behind the end of the recording"),
            ),
            (false, 0) => {
                let problem = "the file is cut off in the eight bytes that close a recording";
                let problem = problem.to_owned();
                self.waiting
                    .push_back(Record::Truncated { offset, problem });
                return Ok(());
            }
            (false, _) => (
                offset,
                "the footer is not followed by the end of the file".to_owned(),
            ),
        };
        self.waiting.push_back(Record::Damaged { offset, problem });
        Ok(())
    }

    /// No record follows although the footer has not come.
    fn run_out(&mut self, offset: u64, left: u64, cut: &str) -> Result<()> {
        if self.source.is_complete {
            return Err(self.source.damage(
                offset,
                "the recording ends without the records that should close it",
            ));
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
        self.waiting
            .push_back(Record::Truncated { offset, problem });
        self.section = Section::End;
    }

    fn open_batch(&mut self, offset: u64, in_chunk: bool) {
        self.batch.next = 0;
        self.batch.offset = offset;
        self.batch.in_chunk = in_chunk;
        self.batch.messages = 0;
    }

    /// Takes the next record of the batch, whose records are known to be whole.
    fn next_of_batch(&mut self) -> Result<Option<Found>> {
        let offset = self.batch.offset;
        let rest = &self.batch.bytes[self.batch.next..];
        let (opcode, length) = chunk::split_head(rest).unwrap_or_default();
        let start = self.batch.next + HEAD_LEN;
        let place = start..start + length as usize;
        self.batch.next = place.end;
        let body = &self.batch.bytes[place.clone()];
        match opcode {
            op::MESSAGE => {
                let Some(header) = message_header(body) else {
                    return Err(self.unreadable(offset, opcode));
                };
                self.found_message(header, place).map(Some)
            }
            op::SCHEMA | op::CHANNEL => self.found_definition(opcode, place),
            op::ATTACHMENT if !self.batch.in_chunk => {
                self.counts.attachments += 1;
                let record =
                    attachment(body).map_err(|problem| self.source.damage(offset, problem))?;
                Ok(Some(Found::Owned(record)))
            }
            op::METADATA if !self.batch.in_chunk => {
                self.counts.metadata += 1;
                match mcap::parse_record(opcode, body) {
                    Ok(records::Record::Metadata(metadata)) => {
                        Ok(Some(Found::Owned(Record::Metadata(metadata))))
                    }
                    _ => Err(self.unreadable(offset, opcode)),
                }
            }
            0x80.. => Ok(Some(Found::Private(opcode, place))),
            0x10.. => Ok(Some(Found::Owned(Record::Damaged {
                offset,
                problem: format!(
                    "a record of {length} bytes with opcode {opcode:#04x}, which this version of \
                     the format does not know, is left out"
                ),
            }))),
            _ => Err(self.source.damage(
                offset,
                format!(
                    "{} (opcode {opcode:#04x}) inside a chunk",
                    record_name(opcode)
                ),
            )),
        }
    }

    fn found_message(&mut self, header: MessageHeader, place: Range<usize>) -> Result<Found> {
        const HEADER_LEN: usize = 2 + 4 + 8 + 8;
        let offset = self.batch.offset;
        if !self.channels.contains_key(&header.channel_id) {
            return Err(self.source.damage(
                offset,
                format!(
                    "a message (sequence {}, log time {} ns) of channel {}, which has not been \
                     defined",
                    header.sequence, header.log_time, header.channel_id
                ),
            ));
        }
        let position = Position {
            chunk_offset: offset,
            index_in_chunk: self.batch.messages,
        };
        self.batch.messages += 1;
        self.counts.messages += 1;
        let data = place.start + HEADER_LEN..place.end;
        Ok(Found::Message(header, data, position))
    }

    fn found_definition(&mut self, opcode: u8, place: Range<usize>) -> Result<Option<Found>> {
        let offset = self.batch.offset;
        match mcap::parse_record(opcode, &self.batch.bytes[place]) {
            Ok(records::Record::Schema { header, data }) => {
                let schema = owned_schema(header, &data);
                if !self.is_new_schema(offset, &schema)? {
                    return Ok(None);
                }
                self.schemas.insert(schema.id, schema.clone());
                Ok(Some(Found::Owned(Record::Schema(schema))))
            }
            Ok(records::Record::Channel(channel)) => {
                if !self.is_new_channel(offset, &channel)? {
                    return Ok(None);
                }
                if channel.schema_id != 0 && !self.schemas.contains_key(&channel.schema_id) {
                    return Err(self.source.damage(offset, unknown_schema(&channel)));
                }
                self.channels.insert(channel.id, channel.clone());
                Ok(Some(Found::Owned(Record::Channel(channel))))
            }
            _ => Err(self.unreadable(offset, opcode)),
        }
    }

    fn is_new_schema(&self, offset: u64, schema: &Schema) -> Result<bool> {
        if schema.id == 0 {
            let problem = format!(
                "schema `{}` has the id 0, which means no schema",
                schema.name
            );
            return Err(self.source.damage(offset, problem));
        }
        match self.schemas.get(&schema.id) {
            None => Ok(true),
            Some(known) if known == schema => Ok(false),
            Some(known) => Err(self.source.damage(
                offset,
                format!(
                    "schema {} is defined twice, as `{}` and differently as `{}`",
                    schema.id, known.name, schema.name
                ),
            )),
        }
    }

    fn is_new_channel(&self, offset: u64, channel: &Channel) -> Result<bool> {
        match self.channels.get(&channel.id) {
            None => Ok(true),
            Some(known) if known == channel => Ok(false),
            Some(known) => Err(self.source.damage(
                offset,
                format!(
                    "channel {} is defined twice, as `{}` and differently as `{}`",
                    channel.id, known.topic, channel.topic
                ),
            )),
        }
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
        match overview::topics_of_chunk(&self.source.path, self.source.size, chunk_offset) {
            Some(topics) if !topics.is_empty() => {
                let topics: Vec<String> = topics.into_iter().collect();
                format!("; the chunk holds messages of {}", topics.join(", "))
            }
            _ => String::new(),
        }
    }
}

fn message_header(body: &[u8]) -> Option<MessageHeader> {
    let mut fields = Fields(body);
    Some(MessageHeader {
        channel_id: fields.u16()?,
        sequence: fields.u32()?,
        log_time: fields.u64()?,
        publish_time: fields.u64()?,
    })
}

fn attachment(body: &[u8]) -> std::result::Result<Record<'static>, String> {
    let mut fields = Fields(body);
    let mut parse = || {
        let header = AttachmentHeader {
            log_time: fields.u64()?,
            create_time: fields.u64()?,
            name: fields.str()?.to_owned(),
            media_type: fields.str()?.to_owned(),
        };
        let length = fields.u64()?;
        let data = fields.bytes(length)?;
        let covered = body.len() - fields.0.len();
        Some((header, data, &body[..covered], fields.u32()?))
    };
    let (header, data, covered, stored) = parse().ok_or("an attachment record cannot be parsed")?;
    let computed = crc32fast::hash(covered);
    if stored != 0 && stored != computed {
        let what = format!("attachment `{}`:", header.name);
        return Err(crc_mismatch(&what, stored, computed));
    }
    Ok(Record::Attachment {
        header,
        data: Cow::Owned(data.to_vec()),
    })
}

fn owned_schema(header: records::SchemaHeader, data: &[u8]) -> Schema {
    Schema {
        id: header.id,
        name: header.name,
        encoding: header.encoding,
        data: data.to_vec(),
    }
}

fn unknown_schema(channel: &Channel) -> String {
    format!(
        "channel {} (`{}`) has schema {}, which has not been defined",
        channel.id, channel.topic, channel.schema_id
    )
}
