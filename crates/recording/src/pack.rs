//! Chunks that are being written: records are put together, compressed and indexed.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::sync::Arc;
use std::time::Instant;

use mcap::records::{
    ChunkHeader, ChunkIndex, MessageHeader, MessageIndex, MessageIndexEntry, Record, op,
};

use crate::compression::Compression;
use crate::encode;
use crate::fields::{HEAD_LEN, head, split_head};
use crate::stopwatch::ms_since;

/// Zstandard's level.
const ZSTD_LEVEL: i32 = 1;

/// Where the messages of a chunk are: log times and offsets among its records, by channel.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct MessagePlaces {
    by_channel: BTreeMap<u16, Vec<MessageIndexEntry>>,
    /// Earliest and latest log time.
    bounds: Option<(u64, u64)>,
}

impl MessagePlaces {
    /// Takes a message whose record starts at `offset` bytes.
    pub(crate) fn take(&mut self, header: &MessageHeader, offset: u64) {
        let log_time = header.log_time;
        let (start, end) = self.bounds.unwrap_or((log_time, log_time));
        self.bounds = Some((start.min(log_time), end.max(log_time)));
        let entries = self.by_channel.entry(header.channel_id).or_default();
        entries.push(MessageIndexEntry { log_time, offset });
    }

    /// The places that message index records tell. `None` if there is another record, or a channel
    /// comes twice or has no message.
    pub(crate) fn read(mut bytes: &[u8]) -> Option<Self> {
        let mut places = MessagePlaces::default();
        while !bytes.is_empty() {
            let (opcode, length) = split_head(bytes)?;
            let (record, rest) =
                bytes.split_at_checked(HEAD_LEN + usize::try_from(length).ok()?)?;
            let Ok(Record::MessageIndex(index)) = mcap::parse_record(opcode, &record[HEAD_LEN..])
            else {
                return None;
            };
            let (start, end) = index.records.iter().fold((u64::MAX, 0), |(start, end), entry| {
                (entry.log_time.min(start), entry.log_time.max(end))
            });
            let (first, last) = places.bounds.unwrap_or((start, end));
            places.bounds = Some((first.min(start), last.max(end)));
            let is_new = !index.records.is_empty()
                && places.by_channel.insert(index.channel_id, index.records).is_none();
            is_new.then_some(())?;
            bytes = rest;
        }
        Some(places)
    }

    /// Messages of each channel.
    pub(crate) fn counts(&self) -> impl Iterator<Item = (u16, u64)> {
        self.by_channel.iter().map(|(&channel, entries)| (channel, entries.len() as u64))
    }

    /// Whether all messages begin below `end`.
    pub(crate) fn are_below(&self, end: u64) -> bool {
        self.by_channel.values().flatten().all(|entry| entry.offset < end)
    }

    /// Earliest and latest log time; 0 and 0 without messages, as the format prescribes.
    pub(crate) fn times(&self) -> (u64, u64) {
        self.bounds.unwrap_or_default()
    }
}

/// The chunk that is being filled.
#[derive(Debug, Default)]
pub(crate) struct OpenChunk {
    records: Vec<u8>,
    places: MessagePlaces,
}

impl OpenChunk {
    pub(crate) fn len(&self) -> u64 {
        self.records.len() as u64
    }

    pub(crate) fn records(&self) -> &[u8] {
        &self.records
    }

    pub(crate) fn put_record(&mut self, record: &[u8]) {
        self.records.extend_from_slice(record);
    }

    pub(crate) fn put_message(&mut self, header: &MessageHeader, data: &[u8]) {
        self.places.take(header, self.len());
        encode::put_message(header, data, &mut self.records);
    }

    /// Compresses the records.
    pub(crate) fn pack(self, compression: Compression) -> io::Result<PackedChunk> {
        let started = Instant::now();
        let OpenChunk { records, places } = self;
        let uncompressed_size = records.len() as u64;
        let uncompressed_crc = crc32fast::hash(&records);
        let data = match compression {
            Compression::None => records,
            Compression::Lz4 => lz4(&records)?,
            Compression::Zstd => zstd::bulk::compress(&records, ZSTD_LEVEL)?,
        };
        let (message_start_time, message_end_time) = places.times();
        let header = ChunkHeader {
            message_start_time,
            message_end_time,
            uncompressed_size,
            uncompressed_crc,
            compression: compression.name().to_owned(),
            compressed_size: data.len() as u64,
        };
        let mut start = encode::bytes(&header);
        let length = (start.len() + data.len()) as u64;
        start.splice(0..0, head(op::CHUNK, length));
        let ms = ms_since(started);
        let data = Arc::new(data);
        Ok(PackedChunk {
            start,
            data,
            places,
            uncompressed_size,
            compression: header.compression,
            compressed_size: header.compressed_size,
            ms,
        })
    }
}

/// One frame without checksums of blocks or content: the chunk has its own, and some readers of
/// MCAP fail on those of blocks.
fn lz4(records: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = lz4::EncoderBuilder::new()
        .level(0)
        .block_checksum(lz4::liblz4::BlockChecksum::NoBlockChecksum)
        .build(Vec::new())?;
    encoder.write_all(records)?;
    let (data, result) = encoder.finish();
    result.map(|()| data)
}

/// A whole chunk, ready to be placed in the file.
#[derive(Debug)]
pub(crate) struct PackedChunk {
    /// The first bytes of its record, up to what `data` holds.
    pub(crate) start: Vec<u8>,
    /// The rest of its record.
    pub(crate) data: Arc<Vec<u8>>,
    pub(crate) places: MessagePlaces,
    pub(crate) uncompressed_size: u64,
    pub(crate) compression: String,
    pub(crate) compressed_size: u64,
    /// Milliseconds that compressing took.
    pub(crate) ms: f64,
}

impl PackedChunk {
    /// The message indexes that follow a chunk at `offset`, and its entry in the summary.
    pub(crate) fn index(&self, offset: u64) -> (Vec<u8>, ChunkIndex) {
        let length = (self.start.len() + self.data.len()) as u64;
        let mut indexes = Vec::new();
        let mut message_index_offsets = BTreeMap::new();
        for (&channel_id, records) in &self.places.by_channel {
            message_index_offsets.insert(channel_id, offset + length + indexes.len() as u64);
            let index = MessageIndex { channel_id, records: records.clone() };
            indexes.extend(encode::record(op::MESSAGE_INDEX, &index));
        }
        let (message_start_time, message_end_time) = self.places.times();
        let index = ChunkIndex {
            message_start_time,
            message_end_time,
            chunk_start_offset: offset,
            chunk_length: length,
            message_index_offsets,
            message_index_length: indexes.len() as u64,
            compression: self.compression.clone(),
            compressed_size: self.compressed_size,
            uncompressed_size: self.uncompressed_size,
        };
        (indexes, index)
    }
}
