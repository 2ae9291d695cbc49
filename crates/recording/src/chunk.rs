//! A chunk: compressed records, and the checksum over them.

use std::io::{self, ErrorKind, Read};
use std::sync::Arc;

use crc32fast::Hasher;
use mcap::records::op;

use crate::damage::Damage;
use crate::fields::{Fields, HEAD_LEN, MAX_RECORD, MESSAGE_HEADER_LEN, split_head};
use crate::names::record_name;
use crate::shared_bytes::SharedBytes;

/// A compressed chunk of more bytes of records is large: what is not needed of it is not held.
const LARGE_CHUNK: u64 = 32 << 20;

/// Bytes of records that any chunk may hold, however small it is in the file: many times a usual
/// chunk, and more than the largest message that compresses to nothing, such as an empty map.
const ALWAYS: u64 = 256 << 20;

/// How many times smaller than its records a larger chunk may be. Points compress to a half, images
/// to a tenth.
const MOST_TIMES_SMALLER: u64 = 64;

struct Header<'a> {
    /// Earliest and latest log time.
    times: (u64, u64),
    uncompressed_size: u64,
    uncompressed_crc: u32,
    compression: &'a str,
    compressed_size: u64,
    /// The compressed records, as far as they are there.
    data: &'a [u8],
}

impl<'a> Header<'a> {
    fn parse(body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        Some(Header {
            times: (fields.u64()?, fields.u64()?),
            uncompressed_size: fields.u64()?,
            uncompressed_crc: fields.u32()?,
            compression: fields.str()?,
            compressed_size: fields.u64()?,
            data: fields.0,
        })
    }
}

/// What a chunk's header says of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Sizes {
    /// Earliest and latest log time.
    pub(crate) times: (u64, u64),
    pub(crate) uncompressed_size: u64,
    pub(crate) compressed_size: u64,
    /// Name of the compression, empty for none.
    pub(crate) compression: String,
}

/// What the header says; `None` if the bytes behind it are more or fewer.
pub(crate) fn sizes(body: &[u8]) -> Option<Sizes> {
    let Header { times, uncompressed_size, compressed_size, compression, data, .. } =
        Header::parse(body)?;
    let compression = compression.to_owned();
    let is_whole = data.len() as u64 == compressed_size;
    is_whole.then_some(Sizes { times, uncompressed_size, compressed_size, compression })
}

/// Name of the compression, empty for none.
pub(crate) fn compression(body: &[u8]) -> Option<&str> {
    Header::parse(body).map(|header| header.compression)
}

/// Whether a chunk is compressed and claims more records than are held in memory without need.
pub(crate) fn is_large(body: &[u8]) -> bool {
    Header::parse(body).is_some_and(|header| {
        !header.compression.is_empty() && header.uncompressed_size > LARGE_CHUNK
    })
}

/// Whether a chunk has a checksum, and is right.
pub(crate) fn is_sound(body: &[u8]) -> bool {
    Header::parse(body).is_some_and(|header| header.uncompressed_crc != 0)
        && skim(body, &|_| false).is_ok()
}

/// The records in the record of a whole chunk, one behind the other with their heads. Those of a
/// chunk without compression are not copied.
///
/// # Errors
/// Any [`Damage`] of a chunk: its checksum and the lengths of its records are checked.
pub(crate) fn unpack(record: &Arc<Vec<u8>>) -> Result<SharedBytes, Damage> {
    let (header, data) = Header::of_whole(&record[HEAD_LEN..])?;
    if header.compression.is_empty() {
        let found = (data.len() as u64).min(header.uncompressed_size.saturating_add(1)) as usize;
        header.check(&data[..found])?;
        let start = record.len() - header.data.len();
        return Ok(SharedBytes::new(record, start..start + found));
    }
    let records = match quick(&header, data) {
        Some(records) => records,
        None => {
            let mut records = Vec::new();
            inflate(&header, data, &mut records)?;
            header.check(&records)?;
            records
        }
    };
    Ok(records.into())
}

/// The records of a whole chunk as [`unpack`] gives them, but without the content of messages that
/// are not kept: of those only the record's head and the message's own header are there. What is
/// left out is unpacked and checked all the same, and never held.
///
/// # Errors
/// Those of [`unpack`].
pub(crate) fn skim(body: &[u8], is_kept: &dyn Fn(u16) -> bool) -> Result<Vec<u8>, Damage> {
    let (header, data) = Header::of_whole(body)?;
    let most = header.uncompressed_size.saturating_add(1);
    let unpacked = Checked { from: decoder(&header, data)?, crc: Hasher::new(), length: 0 };
    let mut unpacked = unpacked.take(most);
    let mut records = Vec::new();
    let cut = skim_records(&mut unpacked, is_kept, &mut records).map_err(decompression)?;
    io::copy(&mut unpacked, &mut io::sink()).map_err(decompression)?;
    let Checked { crc, length, .. } = unpacked.into_inner();
    header.check_sums(length, &|| crc.clone().finalize())?;
    match cut {
        None => Ok(records),
        Some(opcode) => Err(Damage::ChunkEnds { record: record_name(opcode) }),
    }
}

/// Appends records up to the end, or up to one that is cut, whose opcode is returned.
fn skim_records(
    from: &mut impl Read,
    is_kept: &dyn Fn(u16) -> bool,
    records: &mut Vec<u8>,
) -> io::Result<Option<u8>> {
    loop {
        let start = records.len();
        from.take(HEAD_LEN as u64).read_to_end(records)?;
        let Some((opcode, length)) = split_head(&records[start..]) else {
            return Ok(records.get(start).copied());
        };
        let mut there = 0;
        if opcode == op::MESSAGE {
            let header = length.min(MESSAGE_HEADER_LEN as u64);
            there += from.take(header).read_to_end(records)? as u64;
            let channel = Fields(&records[start + HEAD_LEN..]).u16();
            if there == MESSAGE_HEADER_LEN as u64 && !channel.is_some_and(is_kept) {
                there += io::copy(&mut from.take(length - there), &mut io::sink())?;
            }
        }
        there += from.take(length - there).read_to_end(records)? as u64;
        if there < length {
            return Ok(Some(opcode));
        }
    }
}

/// Counts and sums up what is read.
struct Checked<R> {
    from: R,
    crc: Hasher,
    length: u64,
}

impl<R: Read> Read for Checked<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.from.read(into)?;
        self.crc.update(&into[..read]);
        self.length += read as u64;
        Ok(read)
    }
}

/// The most bytes of records that are unpacked from this many bytes. A chunk can claim anything,
/// and a small one can hold a thousand times its size in zeros.
fn most_records(compressed: usize) -> u64 {
    (compressed as u64).saturating_mul(MOST_TIMES_SMALLER).clamp(ALWAYS, MAX_RECORD)
}

impl<'a> Header<'a> {
    /// The header of a whole chunk, and its compressed records.
    fn of_whole(body: &'a [u8]) -> Result<(Self, &'a [u8]), Damage> {
        let unreadable = Damage::Unreadable { record: "the chunk's header" };
        let header = Header::parse(body).ok_or(unreadable)?;
        let (claimed, found) = (header.compressed_size, header.data.len() as u64);
        let data = usize::try_from(claimed).ok().and_then(|size| header.data.get(..size));
        let data = data.ok_or(Damage::ChunkSize { claimed, found })?;
        let (claimed, most) = (header.uncompressed_size, most_records(data.len()));
        if claimed > most {
            let compressed = data.len() as u64;
            return Err(Damage::ChunkTooLarge { claimed, compressed, most });
        }
        Ok((header, data))
    }

    /// Fails unless the records are what the header says, and whole.
    fn check(&self, records: &[u8]) -> Result<(), Damage> {
        self.check_sums(records.len() as u64, &|| crc32fast::hash(records))?;
        match records.get(whole_records(records)) {
            None => Ok(()),
            Some(&opcode) => Err(Damage::ChunkEnds { record: record_name(opcode) }),
        }
    }

    fn check_sums(&self, found: u64, crc: &dyn Fn() -> u32) -> Result<(), Damage> {
        let claimed = self.uncompressed_size;
        if found != claimed {
            return Err(Damage::ChunkSize { claimed, found });
        }
        Damage::check("chunk", self.uncompressed_crc, crc())
    }
}

/// The records of a chunk of one Zstandard frame, unpacked at once, in half the time of unpacking
/// it piece by piece; `None` if that does not work or the records are not right. Claims far beyond
/// what points compress to are not believed.
fn quick(header: &Header, data: &[u8]) -> Option<Vec<u8>> {
    let size = header.uncompressed_size;
    if header.compression != "zstd" || size / MOST_TIMES_SMALLER > data.len() as u64 {
        return None;
    }
    let records = zstd::bulk::decompress(data, clamp(size)).ok()?;
    header.check(&records).is_ok().then_some(records)
}

/// Appends the records in `data` to `records`, at most one byte more than the header says. Memory
/// grows with the unpacked bytes, not with the claim. Records before an error are kept.
fn inflate(header: &Header, data: &[u8], records: &mut Vec<u8>) -> Result<(), Damage> {
    let most = header.uncompressed_size.saturating_add(1);
    decoder(header, data)?.take(most).read_to_end(records).map(drop).map_err(decompression)
}

fn decoder<'a>(header: &Header, data: &'a [u8]) -> Result<Box<dyn Read + 'a>, Damage> {
    Ok(match header.compression {
        "" => Box::new(data),
        "zstd" => {
            let zstd = zstd::stream::read::Decoder::with_buffer(data);
            Box::new(zstd.map_err(decompression)?)
        }
        "lz4" => Box::new(Lz4Frame(Some(lz4::Decoder::new(data).map_err(decompression)?))),
        name => return Err(Damage::Compression { name: name.to_owned() }),
    })
}

/// An LZ4 frame, which must have its end: the library passes over one that has none, and other
/// readers do not. `None` behind the end.
struct Lz4Frame<'a>(Option<lz4::Decoder<&'a [u8]>>);

impl Read for Lz4Frame<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let Some(decoder) = &mut self.0 else { return Ok(0) };
        let read = decoder.read(into)?;
        if read > 0 || into.is_empty() {
            return Ok(read);
        }
        let is_whole = self.0.take().is_some_and(|decoder| decoder.finish().1.is_ok());
        let no_end = || io::Error::new(ErrorKind::UnexpectedEof, "the LZ4 frame has no end");
        is_whole.then_some(0).ok_or_else(no_end)
    }
}

fn decompression(error: io::Error) -> Damage {
    Damage::Decompression { problem: error.to_string() }
}

/// A message that was compressed by itself, as rosbag2 does with zstd. `None` of any other: no
/// message of ROS 2 begins as a frame of Zstandard does.
pub(crate) fn unpack_message(message: &[u8]) -> Option<Vec<u8>> {
    const ZSTD: [u8; 4] = 0xfd2f_b528_u32.to_le_bytes();
    if !message.starts_with(&ZSTD) {
        return None;
    }
    let most = most_records(message.len());
    let mut unpacked = Vec::new();
    let decoder = zstd::stream::read::Decoder::with_buffer(message).ok()?;
    let length = decoder.take(most + 1).read_to_end(&mut unpacked).ok()?;
    (length as u64 <= most).then_some(unpacked)
}

/// The records that are still whole in a cut chunk, unchecked.
pub(crate) fn salvage(body: &[u8]) -> Vec<u8> {
    let mut records = Vec::new();
    let Some(mut header) = Header::parse(body) else {
        return records;
    };
    let data = &header.data[..header.data.len().min(clamp(header.compressed_size))];
    header.uncompressed_size = header.uncompressed_size.min(most_records(data.len()));
    // The cut is an error; the records before it are whole.
    let _ = inflate(&header, data, &mut records);
    records.truncate(whole_records(&records));
    records
}

/// Bytes of the whole records at the start of `data`.
fn whole_records(data: &[u8]) -> usize {
    let mut whole = 0;
    while let Some((_, length)) = split_head(&data[whole..]) {
        let left = (data.len() - whole - HEAD_LEN) as u64;
        if length > left {
            break;
        }
        whole += HEAD_LEN + length as usize;
    }
    whole
}

fn clamp(size: u64) -> usize {
    usize::try_from(size).unwrap_or(usize::MAX)
}
