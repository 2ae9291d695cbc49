//! The records of a file, read ahead, with chunks unpacked by threads.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::iter;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use mcap::records::op;

use super::records::Records;
use crate::chunk;
use crate::damage::Damage;
use crate::error::Result;
use crate::fields::{HEAD_LEN, MAX_RECORD, split_head};
use crate::names::record_name;
use crate::part::SourceChunk;
use crate::plan::{Gap, Plan, UnopenedChunk};
use crate::source::Source;
use crate::stopwatch::{Steps, ms_since};
use crate::unpacked::UnpackedBytes;
use crate::workers::{Ticket, Workers};

/// Bytes read ahead for each thread, unpacked chunks included: a few chunks of usual size. A larger
/// record is read ahead alone.
const AHEAD_PER_THREAD: u64 = 8 << 20;
/// Bytes read ahead, however many threads there are.
const MOST_AHEAD: u64 = 32 << 20;

/// Bytes in memory of a record that is read ahead, about, beside its own.
const BESIDE_RECORD: u64 = 1 << 10;
/// Bytes of an attachment that are read at a time.
const PIECE: u64 = 1 << 20;

/// The records of a chunk.
pub(super) type Unpacked = std::result::Result<Records, Damage>;

/// A record of the file.
pub(super) struct Raw {
    pub(super) offset: u64,
    /// Where it ends.
    pub(super) end: u64,
    pub(super) opcode: u8,
    /// Its bytes, those of its head included.
    pub(super) record: Arc<Vec<u8>>,
    /// Its records, if it is a chunk, and how many milliseconds unpacking took.
    pub(super) unpacked: Option<Ticket<(Unpacked, f64)>>,
    /// Bytes that it counts for, of those read ahead.
    size: u64,
}

/// Some of the bytes of an attachment's record. The first have those of its head before them.
pub(super) struct Piece {
    /// Where the record begins.
    pub(super) offset: u64,
    /// Where the piece ends.
    pub(super) end: u64,
    pub(super) bytes: Vec<u8>,
    pub(super) is_first: bool,
    pub(super) is_last: bool,
}

/// An attachment of which some has been read.
struct OpenAttachment {
    /// Where its record begins and ends.
    record: Range<u64>,
    /// Where the next piece begins.
    next: u64,
    /// Of a stream: the bytes of the record, which are not known to be there before they are read.
    held: Vec<u8>,
}

/// What comes next in the file.
pub(super) enum Next {
    Record(Raw),
    /// An attachment, or some of one.
    Piece(Piece),
    /// The file ends within a record, `left` bytes behind its head. They are in `body` for a chunk.
    Cut {
        offset: u64,
        opcode: u8,
        length: u64,
        left: u64,
        body: Vec<u8>,
    },
    /// A chunk that is not opened, with the message indexes behind it.
    Unopened {
        offset: u64,
        end: u64,
        /// The bytes of its record, those of its head included.
        record: Arc<Vec<u8>>,
        /// The records behind it.
        indexes: Arc<Vec<u8>>,
        /// `None` if those do not fit the chunk.
        chunk: Ticket<Option<SourceChunk>>,
    },
    /// A stretch of the file was skipped.
    Skipped {
        /// Where it ends.
        end: u64,
        /// Messages in it by numbered channel.
        counts: BTreeMap<u16, u64>,
    },
    /// No record follows: only `left` bytes remain, too few for a head.
    RunOut {
        offset: u64,
        left: u64,
    },
}

impl Next {
    /// Bytes that it counts for.
    fn size(&self) -> u64 {
        BESIDE_RECORD
            + match self {
                Next::Record(raw) => raw.size,
                Next::Piece(piece) => piece.bytes.len() as u64,
                Next::Unopened { offset, end, .. } => end - offset,
                _ => 0,
            }
    }
}

/// Reads the records of a file.
pub(super) struct Ahead {
    pub(super) source: Source,
    workers: Workers,
    /// Stretches that are skipped, in the order of the file.
    gaps: VecDeque<Gap>,
    /// Chunks that are not opened, by where they begin.
    unopened: BTreeMap<u64, UnopenedChunk>,
    /// Channels whose messages alone are kept of large chunks; `None`: those of all.
    pub(super) kept: Option<Arc<BTreeSet<u16>>>,
    /// The attachment that is being read.
    attachment: Option<OpenAttachment>,
    queue: VecDeque<Result<Next>>,
    /// Of compressed chunks and messages.
    unpacked: UnpackedBytes,
    size: u64,
    /// Whether nothing is left to be read: behind the footer, a cut or an error.
    is_over: bool,
    /// Reading and hashing.
    pub(super) steps: Steps,
}

impl Ahead {
    pub(super) fn new(mut source: Source, workers: Workers, plan: Plan) -> Self {
        let (queue, Plan { gaps, unopened, .. }) = (VecDeque::new(), plan);
        if !gaps.is_empty() {
            source.expect(between(&gaps, &source));
        }
        Ahead {
            unpacked: UnpackedBytes::of_file(source.size.unwrap_or(0)),
            source,
            workers,
            gaps,
            unopened,
            kept: None,
            attachment: None,
            queue,
            size: 0,
            is_over: false,
            steps: Steps::default(),
        }
    }

    /// What comes next. Must not be called behind a footer, a cut or an error.
    pub(super) fn next(&mut self) -> Result<Next> {
        self.fill();
        let next = self.queue.pop_front().unwrap_or_else(|| self.read())?;
        self.size = self.size.saturating_sub(next.size());
        Ok(next)
    }

    fn fill(&mut self) {
        // A stream is not read ahead: its records should not wait for those to come.
        let budget = match self.workers.is_parallel() && self.source.size.is_some() {
            true => MOST_AHEAD.min(AHEAD_PER_THREAD * self.workers.threads() as u64),
            false => 0,
        };
        while !self.is_over && (self.queue.is_empty() || self.size < budget) {
            let next = self.read();
            self.size += next.as_ref().map_or(0, Next::size);
            self.is_over = match &next {
                Ok(Next::Record(raw)) => raw.opcode == op::FOOTER,
                Ok(Next::Skipped { .. } | Next::Unopened { .. } | Next::Piece(_)) => false,
                _ => true,
            };
            self.queue.push_back(next);
        }
    }

    fn read(&mut self) -> Result<Next> {
        if let Some(gap) = self.gaps.pop_front_if(|gap| gap.start == self.source.offset) {
            self.source.skip_to(gap.end)?;
            return Ok(Next::Skipped { end: gap.end, counts: gap.counts });
        }
        let (started, before) = (Instant::now(), self.source.offset);
        let next = match (self.attachment.take(), self.unopened.remove(&before)) {
            (Some(attachment), _) => self.read_piece(attachment, Vec::new()),
            (None, Some(unopened)) => self.read_unopened(unopened),
            (None, None) => self.read_raw(),
        };
        self.steps.take_since(started, self.source.offset - before);
        let mut next = next?;
        if let Next::Record(raw) = &mut next
            && raw.opcode == op::CHUNK
        {
            self.take_chunk(raw.offset, &Arc::clone(&raw.record))?;
            let (record, kept) = (Arc::clone(&raw.record), self.kept.clone());
            raw.unpacked = Some(self.workers.run(move || unpack(&record, kept)));
        }
        Ok(next)
    }

    /// Counts what a chunk unpacks to, before it is unpacked.
    pub(super) fn take_chunk(&mut self, offset: u64, record: &[u8]) -> Result<()> {
        let body = &record[HEAD_LEN..];
        match chunk::compression(body).is_none_or(str::is_empty) {
            true => Ok(()),
            false => self.take_unpacked(offset, chunk_size(op::CHUNK, body)),
        }
    }

    /// Counts bytes that were compressed in the file.
    pub(super) fn take_unpacked(&mut self, offset: u64, bytes: u64) -> Result<()> {
        match self.unpacked.take(bytes) {
            true => Ok(()),
            false => {
                let most = self.unpacked.most;
                Err(self.source.damage(offset, Damage::UnpacksToTooMuch { most }))
            }
        }
    }

    fn read_unopened(&mut self, unopened: UnopenedChunk) -> Result<Next> {
        let source = &mut self.source;
        let offset = source.offset;
        let length = unopened.end - offset;
        let mut record = Vec::with_capacity(HEAD_LEN);
        if length <= source.remaining().min(MAX_RECORD) {
            source.read(HEAD_LEN as u64, &mut record)?;
        }
        let body_length = match split_head(&record) {
            Some((op::CHUNK, body)) if body <= length - HEAD_LEN as u64 => body,
            _ => return Err(source.damage(offset, Damage::NoChunk)),
        };
        let indexes_length = length - HEAD_LEN as u64 - body_length;
        record.reserve_exact(body_length as usize);
        let mut indexes = Vec::with_capacity(indexes_length as usize);
        source.read(body_length, &mut record)?;
        source.read(indexes_length, &mut indexes)?;
        let (record, indexes) = (Arc::new(record), Arc::new(indexes));
        let (of_chunk, of_indexes) = (Arc::clone(&record), Arc::clone(&indexes));
        let chunk = self
            .workers
            .run(move || SourceChunk::unopened(offset, &of_chunk, &of_indexes, unopened.channels));
        Ok(Next::Unopened { offset, end: unopened.end, record, indexes, chunk })
    }

    fn read_raw(&mut self) -> Result<Next> {
        let source = &mut self.source;
        let offset = source.offset;
        let tail = if source.is_complete { mcap::MAGIC.len() as u64 } else { 0 };
        let left = source.remaining().saturating_sub(tail);
        if left < HEAD_LEN as u64 {
            return Ok(Next::RunOut { offset, left });
        }
        let mut record = Vec::with_capacity(HEAD_LEN);
        let there = source.read(HEAD_LEN as u64, &mut record)?;
        if there < HEAD_LEN as u64 {
            return Ok(Next::RunOut { offset, left: there });
        }
        let (opcode, length) = split_head(&record).unwrap_or_default();
        let left = left - HEAD_LEN as u64;
        if length > left && !source.is_complete {
            let mut body = Vec::new();
            if opcode == op::CHUNK && left <= MAX_RECORD {
                source.read(left, &mut body)?;
            }
            // What is taken for the zeros at the end of the file may be the end of a chunk.
            if opcode == op::CHUNK && length - left <= source.zeros().min(MAX_RECORD) {
                record.extend_from_slice(&body);
                source.read(length - left, &mut record)?;
                if chunk::is_sound(&record[HEAD_LEN..]) {
                    return Ok(whole_record(offset, source.offset, opcode, record));
                }
            }
            return Ok(Next::Cut { offset, opcode, length, left, body });
        }
        if length > left || length > MAX_RECORD {
            let (record, most) = (record_name(opcode), MAX_RECORD);
            return Err(source.damage(offset, Damage::TooLong { record, length, left, most }));
        }
        if opcode == op::ATTACHMENT && source.size.is_some() {
            let end = source.offset + length;
            let open =
                OpenAttachment { record: offset..end, next: source.offset, held: Vec::new() };
            return self.read_piece(open, record);
        }
        // The bytes of a file are there; those of a stream are still to come.
        record.reserve_exact(source.size.map_or(0, |_| length as usize));
        let there = source.read(length, &mut record)?;
        if there < length {
            let body = record.split_off(HEAD_LEN);
            return Ok(Next::Cut { offset, opcode, length, left: there, body });
        }
        let end = source.offset;
        if opcode == op::ATTACHMENT {
            let open = OpenAttachment { record: offset..end, next: offset, held: record };
            return self.read_piece(open, Vec::new());
        }
        Ok(whole_record(offset, end, opcode, record))
    }

    /// Reads on in the record of an attachment, behind its head if that has just been read. All
    /// bytes of the record are there.
    fn read_piece(&mut self, mut open: OpenAttachment, head: Vec<u8>) -> Result<Next> {
        let OpenAttachment { record: Range { start, end }, next, held } = &mut open;
        let (is_first, mut bytes) = (!head.is_empty() || next == start, head);
        let length = (*end - *next).min(PIECE);
        bytes.reserve_exact(length as usize);
        match held.is_empty() {
            true => {
                self.source.read(length, &mut bytes)?;
            }
            false => bytes.extend_from_slice(&held[(*next - *start) as usize..][..length as usize]),
        }
        *next += length;
        let (offset, end, is_last) = (*start, *next, next == end);
        self.attachment = (!is_last).then_some(open);
        Ok(Next::Piece(Piece { offset, end, bytes, is_first, is_last }))
    }
}

fn whole_record(offset: u64, end: u64, opcode: u8, record: Vec<u8>) -> Next {
    let size = record.len() as u64 + chunk_size(opcode, &record[HEAD_LEN..]);
    Next::Record(Raw { offset, end, opcode, record: Arc::new(record), unpacked: None, size })
}

/// The stretches between the gaps, which are read.
fn between(gaps: &VecDeque<Gap>, source: &Source) -> Vec<Range<u64>> {
    let starts = iter::once(0).chain(gaps.iter().map(|gap| gap.end));
    let ends = gaps.iter().map(|gap| gap.start).chain(source.size);
    starts.zip(ends).map(|(start, end)| start..end).collect()
}

fn unpack(record: &Arc<Vec<u8>>, kept: Option<Arc<BTreeSet<u16>>>) -> (Unpacked, f64) {
    let started = Instant::now();
    let unpacked = match kept.filter(|_| chunk::is_large(&record[HEAD_LEN..])) {
        Some(kept) => Records::skimmed(record, kept),
        None => Records::unpacked(record),
    };
    (unpacked, ms_since(started))
}

/// Bytes that a chunk claims for its records.
fn chunk_size(opcode: u8, body: &[u8]) -> u64 {
    let sizes = (opcode == op::CHUNK).then(|| chunk::sizes(body)).flatten();
    sizes.map_or(0, |sizes| sizes.uncompressed_size.min(MAX_RECORD))
}
