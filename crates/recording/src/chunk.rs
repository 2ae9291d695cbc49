//! A chunk: compressed records, and the checksum over them.

use std::io::{self, Read};

use crate::fields::{Fields, HEAD_LEN, MAX_RECORD, split_head};
use crate::names::{crc_mismatch, record_name};

/// Bytes of records that a chunk may hold however few it has in the file: many times a usual chunk,
/// and more than the largest message that compresses to nothing, such as an empty map.
const ALWAYS: u64 = 256 << 20;

/// How many times smaller than its records a chunk may be beyond that. Points compress to a half,
/// images to a tenth.
const MOST_TIMES_SMALLER: u64 = 64;

struct Header<'a> {
    /// Earliest and latest log time.
    times: (u64, u64),
    uncompressed_size: u64,
    uncompressed_crc: u32,
    compression: &'a str,
    compressed_size: u64,
    /// What is there of the compressed records.
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

/// What the header says; nothing if there is more or less behind it than it says.
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

/// Puts the records of a whole chunk into `records`, one behind the other with their heads, after
/// checking the chunk's checksum and that every record is whole. Says what is wrong otherwise.
pub(crate) fn unpack(body: &[u8], records: &mut Vec<u8>) -> Result<(), String> {
    records.clear();
    let header = Header::parse(body).ok_or("the chunk's header cannot be parsed")?;
    let Some(data) =
        usize::try_from(header.compressed_size).ok().and_then(|size| header.data.get(..size))
    else {
        return Err(format!(
            "the chunk claims {} bytes of records and has {}",
            header.compressed_size,
            header.data.len()
        ));
    };
    let most = most_records(data.len());
    if header.uncompressed_size > most {
        return Err(format!(
            "the chunk claims {} bytes of records in {} bytes, more than the {most} that are \
             believed",
            header.uncompressed_size,
            data.len()
        ));
    }
    if quick(&header, data, records) {
        return Ok(());
    }
    inflate(&header, data, records).and_then(|()| header.check(records)).inspect_err(|_| {
        records.clear();
    })
}

/// The most bytes of records that are unpacked from so many bytes: a chunk can claim anything, and
/// a small one can truly hold a thousand times its size of zeros.
fn most_records(compressed: usize) -> u64 {
    (compressed as u64).saturating_mul(MOST_TIMES_SMALLER).clamp(ALWAYS, MAX_RECORD)
}

impl Header<'_> {
    /// Whether records are what the header says, and whole.
    fn check(&self, records: &[u8]) -> Result<(), String> {
        if records.len() as u64 != self.uncompressed_size {
            let (found, claimed) = (records.len() as u64, self.uncompressed_size);
            let more = if found > claimed { " or more" } else { "" };
            return Err(format!(
                "the chunk claims {claimed} bytes of records and has {found}{more}"
            ));
        }
        let (stored, computed) = (self.uncompressed_crc, crc32fast::hash(records));
        if stored != 0 && stored != computed {
            return Err(crc_mismatch("chunk", stored, computed));
        }
        let whole = whole_records(records);
        match records.get(whole) {
            None => Ok(()),
            Some(&opcode) => {
                Err(format!("the chunk ends in the middle of {}", record_name(opcode)))
            }
        }
    }
}

/// Unpacks a chunk of one Zstandard frame at once, which takes half the time of doing it piece by
/// piece. Whether that could be done and nothing is wrong; `records` are as they were otherwise.
/// Claims far beyond what points compress to are not believed.
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

/// Appends what `data` holds to `records`, a byte beyond what the header says at most. Memory grows
/// with what has come out, not with what is claimed. What came before an error is there.
fn inflate(header: &Header, data: &[u8], records: &mut Vec<u8>) -> Result<(), String> {
    let most = header.uncompressed_size.saturating_add(1);
    let mut take = |source: &mut dyn Read| source.take(most).read_to_end(records).map(drop);
    let inflated = match header.compression {
        "" => take(&mut &*data),
        "zstd" => {
            zstd::stream::read::Decoder::with_buffer(data).and_then(|mut zstd| take(&mut zstd))
        }
        "lz4" => lz4::Decoder::new(data).and_then(|mut lz4| take(&mut lz4)),
        other => {
            return Err(format!(
                "the chunk is compressed with `{other}`, which cannot be read here"
            ));
        }
    };
    inflated.map_err(|error: io::Error| format!("the chunk cannot be decompressed: {error}"))
}

/// Puts what records are still whole of a chunk that was cut off into `records`. There is no
/// checksum to check them with.
pub(crate) fn salvage(body: &[u8], records: &mut Vec<u8>) {
    records.clear();
    let Some(mut header) = Header::parse(body) else {
        return;
    };
    let data = &header.data[..header.data.len().min(clamp(header.compressed_size))];
    header.uncompressed_size = header.uncompressed_size.min(most_records(data.len()));
    // Ends in an error at the cut; what came before it is whole.
    let _ = inflate(&header, data, records);
    records.truncate(whole_records(records));
}

/// Length of the part of `data` that is whole records.
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
