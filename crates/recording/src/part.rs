//! A recording in parts: whole chunks with their records, and records outside of chunks.

use std::sync::Arc;

use mcap::records::{MessageHeader, op};

use crate::chunk;
use crate::fields::{Fields, HEAD_LEN, MESSAGE_HEADER_LEN, message_header, split_head};
use crate::pack::{MessagePlaces, PackedChunk};
use crate::record::{Position, Record};
use crate::shared_bytes::SharedBytes;

/// A record, to keep.
#[derive(Debug, Clone)]
pub enum Item {
    /// A message.
    Message {
        /// Channel, sequence, log and publish time.
        header: MessageHeader,
        /// The message itself.
        data: SharedBytes,
        /// Where it lies.
        position: Position,
    },
    /// Anything else.
    Record(Record<'static>),
}

/// A part of a recording, as it is read.
#[derive(Debug, Clone)]
pub enum Part {
    /// A whole chunk that can be copied as it is.
    Chunk(SourceChunk),
    /// Records outside of chunks, or of a chunk that cannot be copied as it is.
    Items(Vec<Item>),
}

/// A chunk as it lies in its file, and its records. Its checksum, the times in its header and its
/// records have been checked, unless it is unopened.
#[derive(Debug, Clone)]
pub struct SourceChunk {
    /// Its records without repeated definitions; empty if it is unopened. Of a large chunk,
    /// messages that the [`ReadFilter`](crate::ReadFilter) does not number may be left out.
    pub items: Vec<Item>,
    /// Where it lies in the file.
    offset: u64,
    /// Its record, the head included.
    record: Arc<Vec<u8>>,
    /// Its records, unpacked; `None` if it is unopened or messages are left out.
    records: Option<SharedBytes>,
    places: MessagePlaces,
    header: chunk::Sizes,
}

impl SourceChunk {
    /// The chunk, or its items back if it should not be copied as it is. `records` is `None` if
    /// messages are left out.
    pub(crate) fn new(
        offset: u64,
        record: &Arc<Vec<u8>>,
        (items, places): (Vec<Item>, MessagePlaces),
        records: Option<SharedBytes>,
    ) -> Result<Self, Vec<Item>> {
        let is_damaged = |item: &Item| matches!(item, Item::Record(Record::Damaged { .. }));
        let header = chunk::sizes(&record[HEAD_LEN..]);
        match header.filter(|header| header.times == places.times()) {
            Some(header) if !items.iter().any(is_damaged) => {
                let record = Arc::clone(record);
                Ok(SourceChunk { items, offset, record, records, places, header })
            }
            _ if records.is_none() => Err(with_left_out(offset, record, items)),
            _ => Err(items),
        }
    }

    /// The chunk unopened, its messages where the message indexes say that they are. `None` if
    /// these do not fit the header of the chunk, or are not of this many channels.
    pub(crate) fn unopened(
        offset: u64,
        record: &Arc<Vec<u8>>,
        indexes: &[u8],
        channels: usize,
    ) -> Option<Self> {
        let places = MessagePlaces::read(indexes)?;
        let header = chunk::sizes(&record[HEAD_LEN..])?;
        let is_sound = header.times == places.times()
            && places.counts().count() == channels
            && places.are_below(header.uncompressed_size);
        let (items, record, records) = (Vec::new(), Arc::clone(record), None);
        is_sound.then_some(SourceChunk { items, offset, record, records, places, header })
    }

    /// Its record in the file.
    pub(crate) fn record(&self) -> &Arc<Vec<u8>> {
        &self.record
    }

    /// Messages of each channel in it.
    pub(crate) fn counts(&self) -> impl Iterator<Item = (u16, u64)> {
        self.places.counts()
    }

    /// Its records, unpacked; `None` if it is unopened or messages are left out.
    pub(crate) fn records(&self) -> Option<&[u8]> {
        self.records.as_deref()
    }

    /// Its records with the messages that are left out of a large chunk. It must not be unopened.
    pub fn into_items(self) -> Vec<Item> {
        match self.records {
            Some(_) => self.items,
            None => with_left_out(self.offset, &self.record, self.items),
        }
    }

    /// Name of its compression, empty for none.
    pub fn compression(&self) -> &str {
        &self.header.compression
    }

    /// The earliest and the latest log time of its messages, nanoseconds; 0 and 0 if it has none.
    pub fn times(&self) -> (u64, u64) {
        self.header.times
    }

    /// Messages in it.
    pub fn message_count(&self) -> u64 {
        self.counts().map(|(_, count)| count).sum()
    }

    /// Its bytes in memory: as it lies in its file, and unpacked as far as it is.
    pub fn size(&self) -> usize {
        let is_compressed = !self.compression().is_empty();
        let unpacked = match &self.records {
            Some(records) if is_compressed => records.len(),
            Some(_) => 0,
            None => self.items.iter().map(Item::size).sum(),
        };
        self.record.len() + unpacked
    }

    pub(crate) fn verbatim(&self) -> PackedChunk {
        PackedChunk {
            parts: [
                Arc::clone(&self.record).into(),
                SharedBytes::default(),
                SharedBytes::default(),
            ],
            places: self.places.clone(),
            uncompressed_size: self.header.uncompressed_size,
            compression: self.header.compression.clone(),
            compressed_size: self.header.compressed_size,
            ms: 0.0,
        }
    }
}

impl Item {
    /// Bytes of a message or of what is attached.
    pub fn size(&self) -> usize {
        match self {
            Item::Message { data, .. } => data.len(),
            Item::Record(Record::Attachment { data, .. }) => data.len(),
            Item::Record(_) => 0,
        }
    }
}

/// The items of a chunk, which has been checked, with the messages that are not among `items`.
fn with_left_out(offset: u64, record: &Arc<Vec<u8>>, items: Vec<Item>) -> Vec<Item> {
    let records = chunk::unpack(record).expect("a chunk that has been checked");
    let mut others = items.into_iter().filter(|item| matches!(item, Item::Record(_))).peekable();
    let (mut all, mut next, mut messages) = (Vec::new(), 0, 0);
    while let Some((opcode, length)) = split_head(&records[next..]) {
        let start = next + HEAD_LEN;
        next = start + length as usize;
        let header = message_header(&records[start..]).filter(|_| opcode == op::MESSAGE);
        match header {
            Some(header) => {
                let position = Position { chunk_offset: offset, index_in_chunk: messages };
                let data = records.slice(start + MESSAGE_HEADER_LEN..next);
                all.push(Item::Message { header, data, position });
                messages += 1;
            }
            None => all.extend(others.next_if(|item| is_of(item, opcode, &records[start..next]))),
        }
    }
    all
}

/// Whether an item may have been made of such a record. A definition that is repeated has none.
fn is_of(item: &Item, opcode: u8, body: &[u8]) -> bool {
    let id = Fields(body).u16();
    match item {
        Item::Record(Record::Schema(schema)) => opcode == op::SCHEMA && id == Some(schema.id),
        Item::Record(Record::Channel(channel)) => opcode == op::CHANNEL && id == Some(channel.id),
        _ => opcode >= 0x10,
    }
}
