//! The sections of a recording: which records may stand where, and what each adds.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Instant;

use mcap::records::{self, op};

use super::ahead::{Ahead, Next, Piece, Raw, Unpacked};
use super::attachment::Attachment;
use super::batch::Batch;
use super::counts::Counts;
use super::definitions::Definitions;
use super::records::Records;
use super::summary::Summary;
use super::times::ReadTimes;
use crate::chunk;
use crate::damage::Damage;
use crate::error::{Error, Result};
use crate::fields::HEAD_LEN;
use crate::names::record_name;
use crate::parse::parse_record;
use crate::part::{Item, SourceChunk};
use crate::record::Record;
use crate::summary::topics_of_chunk;

/// Where in the file the next record lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Section {
    Start,
    Data,
    Summary,
    End,
}

/// Reads one record of the file after the other, and keeps what came of it until it is given.
pub(super) struct Sections {
    pub(super) source: Ahead,
    /// Where the record of the file ends that was taken last.
    pub(super) offset: u64,
    pub(super) section: Section,
    /// Opcode of the record of the file that was taken last.
    previous: u8,
    pub(super) batch: Batch,
    /// The record of the file that was taken last, its head included.
    pub(super) record: Arc<Vec<u8>>,
    /// The attachment that is being read.
    attachment: Option<Attachment>,
    /// Checksum of the section so far.
    crc: crc32fast::Hasher,
    pub(super) definitions: Definitions,
    summary: Summary,
    pub(super) counts: Counts,
    /// Records to be given before the next is read.
    pub(super) pending: VecDeque<Record<'static>>,
    /// Chunks by compression.
    pub(super) compression: BTreeMap<String, u64>,
    pub(super) times: ReadTimes,
    /// Definitions that are given first, where some of those in the file may be skipped.
    pub(super) known: Option<Definitions>,
    /// Whether messages that are compressed each by itself are unpacked.
    pub(super) unpacks_messages: bool,
    /// Whether there was one.
    pub(super) has_unpacked: bool,
    /// Channels whose messages must not be left in chunks that are not opened.
    pub(super) numbered: BTreeSet<u16>,
    /// A chunk that was not opened, to be given next, and where it begins.
    pub(super) unopened: Option<(u64, SourceChunk)>,
    /// Whether some of the file was skipped.
    has_skipped: bool,
}

impl Sections {
    pub(super) fn new(source: Ahead) -> Self {
        let mut crc = crc32fast::Hasher::new();
        crc.update(mcap::MAGIC);
        Sections {
            offset: source.source.offset,
            source,
            section: Section::Start,
            previous: 0,
            batch: Batch::default(),
            record: Arc::default(),
            attachment: None,
            crc,
            definitions: Definitions::default(),
            summary: Summary::default(),
            counts: Counts::default(),
            pending: VecDeque::new(),
            compression: BTreeMap::new(),
            times: ReadTimes::default(),
            known: None,
            unpacks_messages: false,
            has_unpacked: false,
            numbered: BTreeSet::new(),
            unopened: None,
            has_skipped: false,
        }
    }

    /// Gives nothing more.
    pub(super) fn end(&mut self) {
        self.section = Section::End;
        self.batch = Batch::default();
        self.pending.clear();
    }

    /// Takes the next record of the batch; `None` for a definition that is repeated.
    pub(super) fn next_of_batch(&mut self) -> Result<Option<Item>> {
        self.batch.unpacks_messages = self.unpacks_messages;
        let found = self.batch.take_next(&mut self.definitions, &mut self.counts);
        self.has_unpacked |= self.batch.has_unpacked;
        self.source.take_unpacked(self.batch.offset, std::mem::take(&mut self.batch.unpacked))?;
        found.map_err(|damage| self.damage(self.batch.offset, damage))
    }

    /// Reads one record of the file. Damage of the summary ends it and costs no message.
    pub(super) fn step(&mut self) -> Result<()> {
        // What has been given is not held while the next is read.
        (self.batch, self.record) = (Batch::default(), Arc::default());
        match (self.read_record(), self.section) {
            (Err(Error::Damaged { offset, damage, .. }), Section::Summary) => {
                self.give_up_summary(offset, damage);
                Ok(())
            }
            (result, _) => result,
        }
    }

    fn read_record(&mut self) -> Result<()> {
        match self.source.next()? {
            Next::RunOut { offset, left } => self.run_out(offset, left),
            Next::Cut { offset, opcode, length, left, body } => {
                self.cut(offset, opcode, length, left, &body);
                Ok(())
            }
            Next::Unopened { offset, end, record, indexes, chunk } => {
                for bytes in [&record, &indexes] {
                    self.crc.update(bytes);
                }
                (self.offset, self.previous) = (end, op::CHUNK);
                self.count_chunk(&record);
                match chunk.wait().filter(|chunk| self.may_stay_unopened(chunk)) {
                    Some(chunk) => {
                        self.counts.messages += chunk.message_count();
                        self.unopened = Some((offset, chunk));
                        Ok(())
                    }
                    None => self.open_chunk(offset, &record),
                }
            }
            Next::Piece(piece) => self.take_piece(&piece),
            Next::Skipped { end, counts } => {
                (self.offset, self.has_skipped, self.previous) = (end, true, op::CHUNK);
                self.pending.push_back(Record::Skipped { counts });
                Ok(())
            }
            Next::Record(raw) => {
                self.offset = raw.end;
                self.take_raw(raw)
            }
        }
    }

    fn count_chunk(&mut self, record: &[u8]) {
        self.counts.chunks += 1;
        let compression = chunk::compression(&record[HEAD_LEN..]).unwrap_or_default().to_owned();
        *self.compression.entry(compression).or_default() += 1;
    }

    /// Whether the message indexes of a chunk tell of known channels only, and of no numbered one.
    fn may_stay_unopened(&self, chunk: &SourceChunk) -> bool {
        chunk.counts().all(|(channel, _)| {
            self.definitions.channels.contains_key(&channel) && !self.numbered.contains(&channel)
        })
    }

    /// Opens a chunk that could have stayed unopened.
    pub(super) fn open_chunk(&mut self, offset: u64, record: &Arc<Vec<u8>>) -> Result<()> {
        self.source.take_chunk(offset, record)?;
        self.record = Arc::clone(record);
        self.open_batch(offset, Records::unpacked(record))
    }

    fn open_batch(&mut self, offset: u64, records: Unpacked) -> Result<()> {
        let records =
            records.map_err(|damage| self.damage(offset, self.of_topics(offset, damage)))?;
        self.batch = Batch::new(offset, true, records);
        self.batch.is_copyable = true;
        Ok(())
    }

    /// Takes some of an attachment, which stands in the data.
    fn take_piece(&mut self, piece: &Piece) -> Result<()> {
        self.offset = piece.end;
        self.crc.update(&piece.bytes);
        match self.section {
            Section::Data => {}
            Section::Start => return Err(self.no_header(piece.offset, op::ATTACHMENT)),
            section => return Err(self.misplaced(piece.offset, section, op::ATTACHMENT)),
        }
        self.counts.attachments += u64::from(piece.is_first);
        let taken = Attachment::take(&mut self.attachment, piece);
        self.pending.push_back(taken.map_err(|damage| self.damage(piece.offset, damage))?);
        self.previous = op::ATTACHMENT;
        Ok(())
    }

    fn take_raw(&mut self, raw: Raw) -> Result<()> {
        let Raw { offset, opcode, record, unpacked, .. } = raw;
        self.record = record;
        let records = unpacked.map(|unpacked| {
            let started = Instant::now();
            let (records, ms) = unpacked.wait();
            self.times.wait.take_since(started, 0);
            let bytes = records.as_ref().map_or(0, |records| records.bytes.len() as u64);
            self.times.unpack.take(ms, bytes);
            records
        });
        self.take_record(offset, opcode, records)?;
        self.previous = opcode;
        Ok(())
    }

    fn take_record(&mut self, offset: u64, opcode: u8, records: Option<Unpacked>) -> Result<()> {
        let section_crc = self.crc.clone();
        self.crc.update(match opcode {
            op::FOOTER => self.record.get(..HEAD_LEN + 16).unwrap_or(&self.record[..HEAD_LEN]),
            _ => &self.record,
        });
        match (self.section, opcode) {
            (Section::Data, op::CHUNK) => {
                self.count_chunk(&Arc::clone(&self.record));
                self.open_batch(offset, records.unwrap_or_else(|| Ok(Records::default())))
            }
            (Section::Start, op::HEADER) => self.take_header(offset),
            (Section::Start, _) => Err(self.no_header(offset, opcode)),
            (Section::Data, op::MESSAGE_INDEX) => self.take_message_index(offset),
            (Section::Data, op::DATA_END) => self.take_data_end(offset, section_crc),
            (Section::Data, op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA | 0x10..)
            | (Section::Summary, 0x10..) => {
                let record = Records::whole(Arc::clone(&self.record).into());
                self.batch = Batch::new(offset, false, record);
                Ok(())
            }
            (
                Section::Summary,
                op::SCHEMA
                | op::CHANNEL
                | op::STATISTICS
                | op::CHUNK_INDEX
                | op::ATTACHMENT_INDEX
                | op::METADATA_INDEX
                | op::SUMMARY_OFFSET,
            ) => self.take_summary(offset, opcode),
            (Section::Summary, op::FOOTER) => self.take_footer(offset),
            (Section::End, _) => Ok(()),
            (section, _) => Err(self.misplaced(offset, section, opcode)),
        }
    }

    fn no_header(&self, offset: u64, opcode: u8) -> Error {
        self.damage(offset, Damage::NoHeader { record: record_name(opcode) })
    }

    fn misplaced(&self, offset: u64, section: Section, opcode: u8) -> Error {
        let place = match section {
            Section::Summary => "where none can be, in the summary",
            _ => "where none can be, in the data",
        };
        self.damage(offset, Damage::Misplaced { record: record_name(opcode), opcode, place })
    }

    fn take_header(&mut self, offset: u64) -> Result<()> {
        if let records::Record::Header(header) = self.parse(offset, op::HEADER)? {
            let records::Header { profile, library } = header;
            self.pending.push_back(Record::Header { profile, library });
        }
        self.section = Section::Data;
        if let Some(known) = self.known.take() {
            self.pending.extend(known.schemas.values().cloned().map(Record::Schema));
            self.pending.extend(known.channels.values().cloned().map(Record::Channel));
            self.definitions = known;
        }
        Ok(())
    }

    /// An index is not needed here, but one without its chunk tells of a chunk that was not seen.
    fn take_message_index(&mut self, offset: u64) -> Result<()> {
        self.parse(offset, op::MESSAGE_INDEX)?;
        if !matches!(self.previous, op::CHUNK | op::MESSAGE_INDEX) {
            self.pending.push_back(Record::Damaged { offset, damage: Damage::LostChunk });
        }
        Ok(())
    }

    fn take_data_end(&mut self, offset: u64, crc: crc32fast::Hasher) -> Result<()> {
        if let records::Record::DataEnd(end) = self.parse(offset, op::DATA_END)? {
            let checked = Damage::check("data section", end.data_section_crc, crc.finalize());
            if !self.has_skipped {
                checked.map_err(|damage| self.damage(offset, damage))?;
            }
        }
        self.crc = crc32fast::Hasher::new();
        self.summary.start = self.offset;
        self.section = Section::Summary;
        Ok(())
    }

    fn take_summary(&mut self, offset: u64, opcode: u8) -> Result<()> {
        let record = Arc::clone(&self.record);
        let taken = parse_record(opcode, &record[HEAD_LEN..])
            .and_then(|record| self.summary.take(record, &self.definitions));
        taken.map_err(|damage| self.damage(offset, damage))
    }

    fn take_footer(&mut self, offset: u64) -> Result<()> {
        let records::Record::Footer(footer) = self.parse(offset, op::FOOTER)? else {
            return Ok(());
        };
        let computed = self.crc.clone().finalize();
        Damage::check("summary section", footer.summary_crc, computed)
            .and_then(|()| self.summary.check_start(&footer))
            .map_err(|damage| self.damage(offset, damage))?;
        self.give_summary(offset);
        self.section = Section::End;
        self.check_end()
    }

    pub(super) fn give_summary(&mut self, offset: u64) {
        let summary = std::mem::take(&mut self.summary);
        let (known, skipped) = (&mut self.definitions, self.has_skipped);
        self.pending.extend(summary.finish(offset, known, self.counts, skipped));
    }

    /// Ends at damage in the summary. What stands only in the summary cannot be trusted and is left
    /// out.
    fn give_up_summary(&mut self, offset: u64, damage: Damage) {
        let damage = Damage::Summary { damage: Box::new(damage) };
        self.pending.push_back(Record::Damaged { offset, damage });
        self.batch = Batch::default();
        self.section = Section::End;
    }

    /// The record that was taken last.
    fn parse(&self, offset: u64, opcode: u8) -> Result<records::Record<'_>> {
        parse_record(opcode, &self.record[HEAD_LEN..]).map_err(|damage| self.damage(offset, damage))
    }

    /// An error about what is at `offset`.
    pub(super) fn damage(&self, offset: u64, damage: Damage) -> Error {
        self.source.source.damage(offset, damage)
    }

    /// Damage of a chunk, with the topics of its messages if the summary still tells.
    fn of_topics(&self, chunk_offset: u64, damage: Damage) -> Damage {
        let source = &self.source.source;
        let topics = topics_of_chunk(&source.path, source.size.unwrap_or(0), chunk_offset);
        match topics.map(Vec::from_iter) {
            Some(topics) if !topics.is_empty() => {
                Damage::OfTopics { damage: Box::new(damage), topics }
            }
            _ => damage,
        }
    }
}
