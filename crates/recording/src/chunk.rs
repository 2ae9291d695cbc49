//! A chunk: compressed records, and the checksum over them.

use std::io::{self, Read};

use crate::damage::Damage;
use crate::fields::{Fields, HEAD_LEN, MAX_RECORD, split_head};
use crate::names::record_name;

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

/// Puts the records of a whole chunk into `records`, one behind the other with their heads.
///
/// # Errors
/// Any [`Damage`] of a chunk: its checksum and the lengths of its records are checked.
pub(crate) fn unpack(body: &[u8], records: &mut Vec<u8>) -> Result<(), Damage> {
    records.clear();
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
    if quick(&header, data, records) {
        return Ok(());
    }
    inflate(&header, data, records).and_then(|()| header.check(records)).inspect_err(|_| {
        records.clear();
    })
}

/// The most bytes of records that are unpacked from this many bytes. A chunk can claim anything,
/// and a small one can hold a thousand times its size in zeros.
fn most_records(compressed: usize) -> u64 {
    (compressed as u64).saturating_mul(MOST_TIMES_SMALLER).clamp(ALWAYS, MAX_RECORD)
}

impl Header<'_> {
    /// Fails unless the records are what the header says, and whole.
    fn check(&self, records: &[u8]) -> Result<(), Damage> {
        let (found, claimed) = (records.len() as u64, self.uncompressed_size);
        if found != claimed {
            return Err(Damage::ChunkSize { claimed, found });
        }
        Damage::check("chunk", self.uncompressed_crc, crc32fast::hash(records))?;
        match records.get(whole_records(records)) {
            None => Ok(()),
            Some(&opcode) => Err(Damage::ChunkEnds { record: record_name(opcode) }),
        }
    }
}

/// Unpacks a chunk of one Zstandard frame at once, in half the time of unpacking it piece by piece.
/// Returns whether that worked and the records are right; if not, `records` is unchanged. Claims
/// far beyond what points compress to are not believed.
fn quick(header: &Header, data: &[u8], records: &mut Vec<u8>) -> bool {
    let size = header.uncompressed_size;
    if header.compression != "zstd" || size / MOST_TIMES_SMALLER > data.len() as u64 {
        return false;
    }
    match zstd::bulk::decompress(data, clamp(size)) {
        Ok(unpacked) if header.check(&unpacked).is_ok() => *records = unpacked,
        _ => return false,
    }
    true
}

/// Appends the records in `data` to `records`, at most one byte more than the header says. Memory
/// grows with the unpacked bytes, not with the claim. Records before an error are kept.
fn inflate(header: &Header, data: &[u8], records: &mut Vec<u8>) -> Result<(), Damage> {
    let most = header.uncompressed_size.saturating_add(1);
    let mut take = |source: &mut dyn Read| source.take(most).read_to_end(records).map(drop);
    let inflated = match header.compression {
        "" => take(&mut &*data),
        "zstd" => {
            zstd::stream::read::Decoder::with_buffer(data).and_then(|mut zstd| take(&mut zstd))
        }
        "lz4" => lz4::Decoder::new(data).and_then(|mut lz4| take(&mut lz4)),
        name => return Err(Damage::Compression { name: name.to_owned() }),
    };
    inflated.map_err(|error: io::Error| Damage::Decompression { problem: error.to_string() })
}

/// Puts the records that are still whole in a cut chunk into `records`, unchecked.
pub(crate) fn salvage(body: &[u8], records: &mut Vec<u8>) {
    records.clear();
    let Some(mut header) = Header::parse(body) else {
        return;
    };
    let data = &header.data[..header.data.len().min(clamp(header.compressed_size))];
    header.uncompressed_size = header.uncompressed_size.min(most_records(data.len()));
    // The cut is an error; the records before it are whole.
    let _ = inflate(&header, data, records);
    records.truncate(whole_records(records));
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
