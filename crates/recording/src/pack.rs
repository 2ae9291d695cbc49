//! Chunks that are being written: records are put together, compressed and indexed.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::time::Instant;

use mcap::records::{
    ChunkHeader, ChunkIndex, MessageHeader, MessageIndex, MessageIndexEntry, Record, op,
};

use crate::compression::Compression;
use crate::encode;
use crate::fields::{HEAD_LEN, head, split_head};
use crate::shared_bytes::SharedBytes;
use crate::stopwatch::ms_since;

/// Zstandard's level.
const ZSTD_LEVEL: i32 = 1;

/// A message of more bytes is large: it is not copied.
pub(crate) const LARGE_MESSAGE: usize = 32 << 20;

/// How many times smaller compression must make a large message.
const TIMES_SMALLER: usize = 8;

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
    /// The data of a large message, which the records end with.
    large: SharedBytes,
    places: MessagePlaces,
}

impl OpenChunk {
    pub(crate) fn len(&self) -> u64 {
        (self.records.len() + self.large.len()) as u64
    }

    /// Its records; `None` if there is a large message among them.
    pub(crate) fn records(&self) -> Option<&[u8]> {
        self.large.is_empty().then_some(&self.records)
    }

    pub(crate) fn put_record(&mut self, record: &[u8]) {
        self.records.extend_from_slice(record);
    }

    pub(crate) fn put_message(&mut self, header: &MessageHeader, data: &[u8]) {
        self.places.take(header, self.len());
        encode::put_message_start(header, data.len(), &mut self.records);
        self.records.extend_from_slice(data);
    }

    /// Puts a message whose data are not copied. No record may follow.
    pub(crate) fn put_large_message(&mut self, header: &MessageHeader, data: SharedBytes) {
        self.places.take(header, self.len());
        encode::put_message_start(header, data.len(), &mut self.records);
        self.large = data;
    }

    /// Compresses the records. Those with a large message are left uncompressed unless that makes
    /// them much smaller, so that it is not in memory twice.
    pub(crate) fn pack(self, compression: Compression) -> io::Result<PackedChunk> {
        let started = Instant::now();
        let OpenChunk { records, large, places } = self;
        let uncompressed_size = (records.len() + large.len()) as u64;
        let mut crc = crc32fast::Hasher::new();
        crc.update(&records);
        crc.update(&large);
        let (compression, data) = match compression {
            _ if !large.is_empty() => match compress_large([&records, &large], compression)? {
                Some(data) => (compression, data),
                None => (Compression::None, Vec::new()),
            },
            Compression::None => (compression, Vec::new()),
            Compression::Lz4 => (compression, lz4(&[&records], Vec::new())?),
            Compression::Zstd => (compression, zstd::bulk::compress(&records, ZSTD_LEVEL)?),
        };
        let (message_start_time, message_end_time) = places.times();
        let compressed_size = match compression {
            Compression::None => uncompressed_size,
            _ => data.len() as u64,
        };
        let header = ChunkHeader {
            message_start_time,
            message_end_time,
            uncompressed_size,
            uncompressed_crc: crc.finalize(),
            compression: compression.name().to_owned(),
            compressed_size,
        };
        let mut start = encode::bytes(&header);
        let length = start.len() as u64 + compressed_size;
        start.splice(0..0, head(op::CHUNK, length));
        let parts = match compression {
            Compression::None => [start.into(), records.into(), large],
            _ => [start.into(), data.into(), SharedBytes::default()],
        };
        let (compression, ms) = (header.compression, ms_since(started));
        Ok(PackedChunk { parts, places, uncompressed_size, compression, compressed_size, ms })
    }
}

/// Compresses the records of a chunk with a large message; `None` if they do not become
/// [`TIMES_SMALLER`] times smaller.
fn compress_large(records: [&[u8]; 2], compression: Compression) -> io::Result<Option<Vec<u8>>> {
    let most = records.iter().map(|part| part.len()).sum::<usize>() / TIMES_SMALLER;
    let mut into = Limited { bytes: Vec::new(), most, is_full: false };
    let compressed = match compression {
        Compression::None => return Ok(None),
        Compression::Lz4 => lz4(&records, &mut into).map(drop),
        Compression::Zstd => {
            let mut encoder = zstd::Encoder::new(&mut into, ZSTD_LEVEL)?;
            let written = records.iter().try_for_each(|part| encoder.write_all(part));
            written.and_then(|()| encoder.finish().map(drop))
        }
    };
    match into.is_full {
        true => Ok(None),
        false => compressed.map(|()| Some(into.bytes)),
    }
}

/// Takes no more bytes than this.
struct Limited {
    bytes: Vec<u8>,
    most: usize,
    is_full: bool,
}

impl Write for &mut Limited {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.is_full |= self.bytes.len() + bytes.len() > self.most;
        if self.is_full {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// One frame without checksums of blocks or content: the chunk has its own, and some readers of
/// MCAP fail on those of blocks.
fn lz4<W: Write>(records: &[&[u8]], into: W) -> io::Result<W> {
    let mut encoder = lz4::EncoderBuilder::new()
        .level(0)
        .block_checksum(lz4::liblz4::BlockChecksum::NoBlockChecksum)
        .build(into)?;
    records.iter().try_for_each(|part| encoder.write_all(part))?;
    let (into, result) = encoder.finish();
    result.map(|()| into)
}

/// A whole chunk, ready to be placed in the file.
#[derive(Debug)]
pub(crate) struct PackedChunk {
    /// Its record, head included.
    pub(crate) parts: [SharedBytes; 3],
    pub(crate) places: MessagePlaces,
    pub(crate) uncompressed_size: u64,
    pub(crate) compression: String,
    pub(crate) compressed_size: u64,
    /// Milliseconds that compressing took.
    pub(crate) ms: f64,
}

impl PackedChunk {
    /// Bytes of its record.
    pub(crate) fn len(&self) -> u64 {
        self.parts.iter().map(|part| part.len() as u64).sum()
    }

    /// The message indexes that follow a chunk at `offset`, and its entry in the summary.
    pub(crate) fn index(&self, offset: u64) -> (Vec<u8>, ChunkIndex) {
        let length = self.len();
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
