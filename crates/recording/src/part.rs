//! A recording in parts: whole chunks with their records, and records outside of chunks.

use std::ops::{Deref, Range};
use std::sync::Arc;

use mcap::records::{MessageHeader, op};

use crate::chunk;
use crate::fields::{HEAD_LEN, MESSAGE_HEADER_LEN, head};
use crate::pack::{MessagePlaces, PackedChunk};
use crate::record::{Position, Record};

/// Bytes to keep or to use in another thread without a copy. The bytes around them are kept, too.
#[derive(Debug, Clone)]
pub struct SharedBytes {
    all: Arc<Vec<u8>>,
    place: Range<usize>,
}

impl SharedBytes {
    pub(crate) fn new(all: &Arc<Vec<u8>>, place: Range<usize>) -> Self {
        SharedBytes { all: Arc::clone(all), place }
    }
}

impl From<Vec<u8>> for SharedBytes {
    fn from(bytes: Vec<u8>) -> Self {
        let place = 0..bytes.len();
        SharedBytes { all: Arc::new(bytes), place }
    }
}

impl Deref for SharedBytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.all[self.place.clone()]
    }
}

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
    /// Its records without repeated definitions; empty if it is unopened.
    pub items: Vec<Item>,
    body: Arc<Vec<u8>>,
    places: MessagePlaces,
    header: chunk::Sizes,
}

impl SourceChunk {
    /// The chunk, or its items back if it should not be copied as it is.
    pub(crate) fn new(body: &Arc<Vec<u8>>, items: Vec<Item>) -> Result<Self, Vec<Item>> {
        let mut places = MessagePlaces::default();
        for item in &items {
            match item {
                Item::Message { header, data, .. } => {
                    let start = data.place.start - MESSAGE_HEADER_LEN - HEAD_LEN;
                    places.take(header, start as u64);
                }
                Item::Record(Record::Damaged { .. }) => return Err(items),
                Item::Record(_) => {}
            }
        }
        match chunk::sizes(body).filter(|header| header.times == places.times()) {
            Some(header) => Ok(SourceChunk { items, body: Arc::clone(body), places, header }),
            None => Err(items),
        }
    }

    /// The chunk unopened, its messages where the message indexes say that they are. `None` if
    /// these do not fit the header of the chunk, or are not of this many channels.
    pub(crate) fn unopened(body: &Arc<Vec<u8>>, indexes: &[u8], channels: usize) -> Option<Self> {
        let places = MessagePlaces::read(indexes)?;
        let header = chunk::sizes(body)?;
        let is_sound = header.times == places.times()
            && places.counts().count() == channels
            && places.are_below(header.uncompressed_size);
        let (items, body) = (Vec::new(), Arc::clone(body));
        is_sound.then_some(SourceChunk { items, body, places, header })
    }

    /// The content of its record in the file.
    pub(crate) fn body(&self) -> &Arc<Vec<u8>> {
        &self.body
    }

    /// Messages of each channel in it.
    pub(crate) fn counts(&self) -> impl Iterator<Item = (u16, u64)> {
        self.places.counts()
    }

    /// Its records, unpacked; `None` if it is unopened or has no message.
    pub(crate) fn records(&self) -> Option<&[u8]> {
        self.items.iter().find_map(|item| match item {
            Item::Message { data, .. } => Some(data.all.as_slice()),
            Item::Record(_) => None,
        })
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

    /// Its bytes in memory: as it lies in its file, and unpacked unless it is unopened.
    pub fn size(&self) -> usize {
        let unpacked = if self.items.is_empty() { 0 } else { self.header.uncompressed_size };
        self.body.len() + unpacked as usize
    }

    pub(crate) fn verbatim(&self) -> PackedChunk {
        PackedChunk {
            start: head(op::CHUNK, self.body.len() as u64).to_vec(),
            data: Arc::clone(&self.body),
            places: self.places.clone(),
            uncompressed_size: self.header.uncompressed_size,
            compression: self.header.compression.clone(),
            compressed_size: self.header.compressed_size,
            ms: 0.0,
        }
    }
}
