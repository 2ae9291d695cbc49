//! A chunk: compressed records, and the checksum over them.

use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::scan::{Fields, HEAD_LEN, MAX_RECORD, head};
use super::words::{chunk_problem, crc_mismatch, record_name};

/// Bytes handed to the decompressor at a time.
const PIECE: usize = 1 << 20;

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
pub(super) struct Sizes {
    /// Earliest and latest log time.
    pub(super) times: (u64, u64),
    pub(super) uncompressed_size: u64,
    pub(super) compressed_size: u64,
    /// Name of the compression, empty for none.
    pub(super) compression: String,
}

/// What the header says; nothing if there is more or less behind it than it says.
pub(super) fn sizes(body: &[u8]) -> Option<Sizes> {
    let Header { times, uncompressed_size, compressed_size, compression, data, .. } =
        Header::parse(body)?;
    let compression = compression.to_owned();
    let is_whole = data.len() as u64 == compressed_size;
    is_whole.then_some(Sizes { times, uncompressed_size, compressed_size, compression })
}

/// Name of the compression, empty for none.
pub(super) fn compression(body: &[u8]) -> Option<&str> {
    Header::parse(body).map(|header| header.compression)
}

/// Puts the records of a whole chunk into `records`, one behind the other with their heads, after
/// checking the chunk's checksum and that every record is whole. Says what is wrong otherwise.
pub(super) fn unpack(body: &[u8], records: &mut Vec<u8>) -> Result<(), String> {
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
    if header.uncompressed_size > MAX_RECORD {
        return Err(format!(
            "the chunk claims {} bytes of records, more than the {MAX_RECORD} that can be read here",
            header.uncompressed_size
        ));
    }
    if quick(&header, data, records) {
        return Ok(());
    }
    if !header.compression.is_empty() {
        return decompress(body, body.len() as u64, header.uncompressed_size, records);
    }
    if header.uncompressed_size != header.compressed_size {
        return Err(format!(
            "the chunk is not compressed but claims {} bytes in {}",
            header.uncompressed_size, header.compressed_size
        ));
    }
    let (stored, computed) = (header.uncompressed_crc, crc32fast::hash(data));
    if stored != 0 && stored != computed {
        return Err(crc_mismatch("chunk", stored, computed));
    }
    let whole = whole_records(data);
    if whole < data.len() {
        let name = data.get(whole).map_or("", |&opcode| record_name(opcode));
        return Err(format!("the chunk ends in the middle of {name}"));
    }
    records.extend_from_slice(data);
    Ok(())
}

/// Unpacks a chunk of one Zstandard frame at once, which takes half the time of doing it piece by piece. Whether
/// that could be done and nothing is wrong; `records` are as they were otherwise. Claims far beyond what points
/// compress to are not believed.
fn quick(header: &Header, data: &[u8], records: &mut Vec<u8>) -> bool {
    const MOST_TIMES_SMALLER: u64 = 64;
    let size = header.uncompressed_size;
    if header.compression != "zstd" || size / MOST_TIMES_SMALLER > data.len() as u64 {
        return false;
    }
    let is_sound = |records: &[u8]| {
        let crc = header.uncompressed_crc;
        records.len() as u64 == size
            && (crc == 0 || crc == crc32fast::hash(records))
            && whole_records(records) == records.len()
    };
    match zstd::bulk::decompress(data, clamp(size)) {
        Ok(unpacked) if is_sound(&unpacked) => *records = unpacked,
        _ => return false,
    }
    true
}

/// Puts what records are still whole of a chunk that was cut off into `records`. There is no
/// checksum to check them with. `length` is what the chunk's body should have been.
pub(super) fn salvage(body: &[u8], length: u64, records: &mut Vec<u8>) {
    records.clear();
    let Some(header) = Header::parse(body) else {
        return;
    };
    if header.compression.is_empty() {
        let size = header.data.len().min(clamp(header.compressed_size));
        let data = &header.data[..size];
        records.extend_from_slice(&data[..whole_records(data)]);
    } else {
        // Ends in an error at the cut; what came before it is whole.
        let size = header.uncompressed_size.min(MAX_RECORD);
        let _ = decompress(body, length, size, records);
    }
}

fn decompress(
    body: &[u8],
    length: u64,
    uncompressed_size: u64,
    records: &mut Vec<u8>,
) -> Result<(), String> {
    let limit = clamp(uncompressed_size.max(body.len() as u64).min(MAX_RECORD));
    let mut reader = LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(limit),
    );
    let head = head(op::CHUNK, length);
    let mut unread: [&[u8]; 2] = [&head, body];
    while let Some(event) = reader.next_event() {
        match event.map_err(chunk_problem)? {
            LinearReadEvent::Record { opcode, data } => {
                records.extend_from_slice(&self::head(opcode, data.len() as u64));
                records.extend_from_slice(data);
            }
            LinearReadEvent::ReadRequest(wanted) => {
                let source = if unread[0].is_empty() { &mut unread[1] } else { &mut unread[0] };
                let (piece, rest) = source.split_at(wanted.min(PIECE).min(source.len()));
                reader.insert(piece.len()).copy_from_slice(piece);
                reader.notify_read(piece.len());
                *source = rest;
            }
        }
    }
    Ok(())
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

/// Opcode and length of the record that `bytes` begins with.
pub(super) fn split_head(bytes: &[u8]) -> Option<(u8, u64)> {
    let mut fields = Fields(bytes);
    Some((fields.u8()?, fields.u64()?))
}

fn clamp(size: u64) -> usize {
    usize::try_from(size).unwrap_or(usize::MAX)
}
