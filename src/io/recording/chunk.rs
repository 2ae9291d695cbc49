//! A chunk: compressed records, and the checksum over them.

use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::scan::{Fields, HEAD_LEN, MAX_RECORD, head};
use super::words::{chunk_problem, crc_mismatch, record_name};

/// Bytes handed to the decompressor at a time.
const PIECE: usize = 1 << 20;

struct Header<'a> {
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
        let _start_and_end_time = (fields.u64()?, fields.u64()?);
        Some(Header {
            uncompressed_size: fields.u64()?,
            uncompressed_crc: fields.u32()?,
            compression: fields.str()?,
            compressed_size: fields.u64()?,
            data: fields.0,
        })
    }
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
