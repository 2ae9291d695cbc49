//! Whether a chunk is what the index in the summary says. A chunk that is passed over is never
//! opened, so that a false index would lose its messages in silence.

use std::collections::BTreeMap;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::{ChunkIndex, op};

use crate::address::is_remote;
use crate::fields::{Fields, HEAD_LEN, split_head};
use crate::input::Input;
use crate::open::open;

/// Bytes that are read at a time: a chunk's header, or the message indexes of a usual chunk.
const PIECE: usize = 4 << 10;

/// Compares chunks with what the index says of them, by their own headers and message indexes.
pub(crate) struct ChunkCheck {
    /// `None` for a remote object: a request for every chunk would cost more than reading them all,
    /// so that its index is believed.
    file: Option<BufReader<Box<dyn Input>>>,
    place: u64,
}

impl ChunkCheck {
    /// Opens the file; `None` if that fails.
    pub(crate) fn open(path: &Path) -> Option<Self> {
        let file = match is_remote(path) {
            true => None,
            false => Some(BufReader::with_capacity(PIECE, open(path).ok()?)),
        };
        Some(ChunkCheck { file, place: 0 })
    }

    /// Whether the chunk's header has the same times, sizes and compression, and its message
    /// indexes, which `counts` says the lengths of, the same channels with messages of those times.
    pub(crate) fn agrees(&mut self, index: &ChunkIndex, counts: &[(u16, u64)]) -> bool {
        self.file.is_none() || self.compare(index, counts).unwrap_or(false)
    }

    fn compare(&mut self, index: &ChunkIndex, counts: &[(u16, u64)]) -> Option<bool> {
        let times = (index.message_start_time, index.message_end_time);
        let start = index.chunk_start_offset;
        let head = self.read(start, (HEAD_LEN + 8 + 8 + 8 + 4 + 4) as u64)?;
        let (opcode, length) = split_head(&head)?;
        let mut fields = Fields(&head[HEAD_LEN..]);
        let own_times = (fields.u64()?, fields.u64()?);
        let uncompressed_size = fields.u64()?;
        let (_crc, name_length) = (fields.u32()?, fields.u32()?);
        let is_header_right = opcode == op::CHUNK
            && length.checked_add(HEAD_LEN as u64) == Some(index.chunk_length)
            && own_times == times
            && uncompressed_size == index.uncompressed_size
            && u64::from(name_length) == index.compression.len() as u64;
        if !is_header_right {
            return Some(false);
        }
        let name = self.read(start + head.len() as u64, name_length.into())?;
        let indexes = self.read(start + index.chunk_length, index.message_index_length)?;
        let (found, bounds) = message_indexes(&indexes)?;
        let is_right = name == index.compression.as_bytes()
            && found == counts.iter().copied().collect()
            && bounds.is_none_or(|bounds| bounds == times);
        Some(is_right)
    }

    /// Some bytes of the file; `None` if they are not there. Memory grows with those that are.
    fn read(&mut self, start: u64, length: u64) -> Option<Vec<u8>> {
        let file = self.file.as_mut()?;
        match i64::try_from(start).ok()?.checked_sub(i64::try_from(self.place).ok()?) {
            Some(by) => file.seek_relative(by).ok()?,
            None => file.seek(SeekFrom::Start(start)).map(drop).ok()?,
        }
        let mut bytes = Vec::new();
        file.take(length).read_to_end(&mut bytes).ok()?;
        self.place = start + bytes.len() as u64;
        (bytes.len() as u64 == length).then_some(bytes)
    }
}

/// Messages of each channel, and the earliest and latest log time if there are any. `None` if the
/// bytes are no message indexes.
#[expect(clippy::type_complexity, reason = "two facts of one pass over the entries")]
fn message_indexes(mut bytes: &[u8]) -> Option<(BTreeMap<u16, u64>, Option<(u64, u64)>)> {
    let (mut counts, mut bounds) = (BTreeMap::new(), None);
    while !bytes.is_empty() {
        let mut fields = Fields(bytes);
        let (opcode, length) = (fields.u8()?, fields.u64()?);
        let mut record = Fields(fields.bytes(length)?);
        let channel = record.u16()?;
        let (entries, rest) = record.block()?.as_chunks::<16>();
        let is_new = counts.insert(channel, entries.len() as u64).is_none();
        if opcode != op::MESSAGE_INDEX || !is_new || !rest.is_empty() {
            return None;
        }
        for entry in entries {
            let time = Fields(entry).u64()?;
            let (first, last) = bounds.unwrap_or((time, time));
            bounds = Some((time.min(first), time.max(last)));
        }
        bytes = fields.0;
    }
    Some((counts, bounds))
}
