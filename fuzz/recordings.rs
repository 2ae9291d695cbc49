//! Recordings of every shape, whole and broken, put together record by record.
//!
//! Random bytes seldom pass a checksum. So records are changed first and put together afterwards,
//! with checksums that are right, absent or wrong, and in every shape that the format allows:
//! chunked or not, each compression, with and without indexes, statistics and summary.

use std::collections::BTreeMap;
use std::io::Write;

use crate::mutate::Mutator;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
const HEADER: u8 = 1;
const FOOTER: u8 = 2;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const MESSAGE_INDEX: u8 = 7;
const CHUNK_INDEX: u8 = 8;
const ATTACHMENT: u8 = 9;
const STATISTICS: u8 = 11;
const METADATA: u8 = 12;
const SUMMARY_OFFSET: u8 = 14;
const DATA_END: u8 = 15;
const PRIVATE: u8 = 0x90;
const FUTURE: u8 = 0x42;

/// An opcode and what is behind its length.
pub type Plain = (u8, Vec<u8>);

/// How records become a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Messages in each chunk; none: no chunks.
    pub per_chunk: Option<usize>,
    /// `""`, `"lz4"` or `"zstd"`.
    pub compression: &'static str,
    /// Whether checksums are there.
    pub has_crc: bool,
    /// Whether there are indexes behind the chunks.
    pub has_index: bool,
    /// Whether there is a summary.
    pub has_summary: bool,
    /// Whether it holds statistics.
    pub has_statistics: bool,
}

impl Shape {
    /// Any shape.
    pub fn any(mutator: &mut Mutator) -> Shape {
        Shape {
            per_chunk: (!mutator.once_in(4)).then(|| 1 + mutator.below(4)),
            compression: ["", "lz4", "zstd"][mutator.below(3)],
            has_crc: !mutator.once_in(3),
            has_index: mutator.once_in(2),
            has_summary: !mutator.once_in(3),
            has_statistics: !mutator.once_in(3),
        }
    }
}

/// The records of a small recording: two schemas, three channels, the given clouds, other messages,
/// an attachment, metadata, a private record.
pub fn records(clouds: &[Vec<u8>]) -> Vec<Plain> {
    let schema = |id: u16, name: &str, text: &str| {
        (SCHEMA, [&id.to_le_bytes(), &*string(name), &string("ros2msg"), &string(text)].concat())
    };
    let channel = |id: u16, schema: u16, topic: &str, encoding: &str| {
        let ids = [id, schema].map(u16::to_le_bytes).concat();
        (CHANNEL, [&*ids, &string(topic), &string(encoding), &[0; 4]].concat())
    };
    let mut records = vec![
        schema(1, "sensor_msgs/msg/PointCloud2", "std_msgs/Header header"),
        schema(2, "std_msgs/msg/String", "string data"),
        channel(1, 1, "/points", "cdr"),
        channel(2, 2, "/log", "cdr"),
        channel(3, 0, "/speed", "json"),
    ];
    for (number, cloud) in (0_u32..).zip(clouds) {
        records.push(message(2, number, b"\0\x01\0\0\x03\0\0\0hi\0"));
        records.push(message(1, number, cloud));
        records.push(message(3, number, b"{\"speed\": 3.5}"));
    }
    records.push((PRIVATE, b"mine".to_vec()));
    records.push((METADATA, [string("rosbag2"), map(&[("version", "9")])].concat()));
    records.push((ATTACHMENT, attachment("calib.txt", b"Tr: 1 0 0")));
    records
}

fn message(channel: u16, sequence: u32, data: &[u8]) -> Plain {
    let time = (1_700_000_000_000_000_000 + u64::from(sequence) * 100_000_000).to_le_bytes();
    let ids = [&channel.to_le_bytes()[..], &sequence.to_le_bytes()].concat();
    (MESSAGE, [&*ids, &time, &time, data].concat())
}

fn attachment(name: &str, data: &[u8]) -> Vec<u8> {
    let length = (data.len() as u64).to_le_bytes();
    let body = [&[0; 16][..], &string(name), &string("text/plain"), &length, data].concat();
    let crc = crc32fast::hash(&body).to_le_bytes();
    [&*body, &crc].concat()
}

/// Changes some of the records: their order, number, opcode or bytes.
pub fn change(records: &mut Vec<Plain>, mutator: &mut Mutator) {
    let contents: Vec<Vec<u8>> = records.iter().map(|(_, body)| body.clone()).collect();
    for _ in 0..mutator.below(4) {
        let (at, other) = (mutator.below(records.len()), mutator.below(records.len()));
        match mutator.below(8) {
            0 => records.swap(at, other),
            1 => records.insert(at, records[other].clone()),
            2 if records.len() > 1 => drop(records.remove(at)),
            3 => {
                records[at].0 =
                    *mutator.pick(&[0, CHUNK, FOOTER, DATA_END, FUTURE, PRIVATE, MESSAGE])
            }
            // The fields at the front of a record are what its reader believes.
            4 => {
                let body = &mut records[at].1;
                let mut front: Vec<u8> = body.drain(..body.len().min(24)).collect();
                mutator.mutate(&mut front, &[], &[]);
                body.splice(0..0, front);
            }
            _ => mutator.mutate(&mut records[at].1, &contents, &[]),
        }
    }
}

/// The file. `lie` may change the body of each chunk and of the summary's records on the way.
pub fn file(records: &[Plain], shape: Shape, mut lie: impl FnMut(u8, &mut Vec<u8>)) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    put(&mut out, HEADER, &[string("ros2"), string("fuzz")].concat());
    let mut group: Vec<&Plain> = Vec::new();
    let mut indexes = Vec::new();
    for record in records {
        let is_loose = matches!(record.0, ATTACHMENT | METADATA | PRIVATE);
        match shape.per_chunk {
            Some(most) if !is_loose => {
                group.push(record);
                if group.len() >= 5 + most {
                    put_chunk(&mut out, &std::mem::take(&mut group), shape, &mut indexes, &mut lie);
                }
            }
            _ => put(&mut out, record.0, &record.1),
        }
    }
    if !group.is_empty() {
        put_chunk(&mut out, &group, shape, &mut indexes, &mut lie);
    }
    let crc = if shape.has_crc { crc32fast::hash(&out) } else { 0 };
    put(&mut out, DATA_END, &crc.to_le_bytes());
    put_summary(&mut out, records, shape, &indexes, &mut lie);
    out
}

fn put_chunk(
    out: &mut Vec<u8>,
    group: &[&Plain],
    shape: Shape,
    indexes: &mut Vec<Vec<u8>>,
    lie: &mut impl FnMut(u8, &mut Vec<u8>),
) {
    let mut inner = Vec::new();
    let mut places: BTreeMap<u16, Vec<u8>> = BTreeMap::new();
    let mut times = (u64::MAX, 0);
    for (opcode, body) in group {
        if let (MESSAGE, Some(id), Some(time)) = (*opcode, word(body, 0), long(body, 6)) {
            times = (times.0.min(time), times.1.max(time));
            let entry = [time, inner.len() as u64].map(u64::to_le_bytes).concat();
            places.entry(id).or_default().extend(entry);
        }
        put(&mut inner, *opcode, body);
    }
    if places.is_empty() {
        times = (0, 0);
    }
    let crc = if shape.has_crc { crc32fast::hash(&inner) } else { 0 };
    let data = compressed(&inner, shape.compression);
    let mut body = [times.0, times.1, inner.len() as u64].map(u64::to_le_bytes).concat();
    body.extend(crc.to_le_bytes());
    body.extend(string(shape.compression));
    body.extend((data.len() as u64).to_le_bytes());
    body.extend(data);
    lie(CHUNK, &mut body);
    let start = out.len() as u64;
    put(out, CHUNK, &body);
    let length = out.len() as u64 - start;
    let mut offsets = Vec::new();
    let first_index = out.len() as u64;
    for (id, entries) in places.iter().filter(|_| shape.has_index) {
        offsets.extend(id.to_le_bytes());
        offsets.extend((out.len() as u64).to_le_bytes());
        let length = (entries.len() as u32).to_le_bytes();
        put(out, MESSAGE_INDEX, &[&id.to_le_bytes()[..], &length, entries].concat());
    }
    let mut index = [times.0, times.1, start, length].map(u64::to_le_bytes).concat();
    index.extend((offsets.len() as u32).to_le_bytes());
    index.extend(offsets);
    index.extend((out.len() as u64 - first_index).to_le_bytes());
    index.extend(string(shape.compression));
    index.extend([body.len() as u64, inner.len() as u64].map(u64::to_le_bytes).concat());
    indexes.push(index);
}

fn put_summary(
    out: &mut Vec<u8>,
    records: &[Plain],
    shape: Shape,
    indexes: &[Vec<u8>],
    lie: &mut impl FnMut(u8, &mut Vec<u8>),
) {
    let start = out.len();
    if shape.has_summary {
        for (opcode, body) in records.iter().filter(|(op, _)| matches!(*op, SCHEMA | CHANNEL)) {
            put(out, *opcode, body);
        }
        let index = indexes.iter().filter(|_| shape.has_index);
        let mut rest: Vec<Plain> = index.map(|index| (CHUNK_INDEX, index.clone())).collect();
        if shape.has_statistics {
            rest.push((STATISTICS, statistics(records, indexes.len())));
        }
        for (opcode, mut body) in rest {
            lie(opcode, &mut body);
            put(out, opcode, &body);
        }
        put(out, SUMMARY_OFFSET, &[&[SCHEMA][..], &[0; 16]].concat());
    }
    let summary_start = if shape.has_summary { start as u64 } else { 0 };
    let mut footer = vec![FOOTER];
    footer.extend(20_u64.to_le_bytes());
    footer.extend(summary_start.to_le_bytes());
    footer.extend(0_u64.to_le_bytes());
    let crc = crc32fast::hash(&[&out[start..], &footer].concat());
    footer.extend(if shape.has_crc { crc.to_le_bytes() } else { [0; 4] });
    out.extend(footer);
    out.extend(MAGIC);
}

fn statistics(records: &[Plain], chunks: usize) -> Vec<u8> {
    let of = |opcode: u8| records.iter().filter(move |(other, _)| *other == opcode);
    let mut counts: BTreeMap<u16, u64> = BTreeMap::new();
    for id in of(MESSAGE).filter_map(|(_, body)| word(body, 0)) {
        *counts.entry(id).or_default() += 1;
    }
    let times: Vec<u64> = of(MESSAGE).filter_map(|(_, body)| long(body, 6)).collect();
    let mut body = (of(MESSAGE).count() as u64).to_le_bytes().to_vec();
    body.extend((of(SCHEMA).count() as u16).to_le_bytes());
    for count in [of(CHANNEL).count(), of(ATTACHMENT).count(), of(METADATA).count(), chunks] {
        body.extend((count as u32).to_le_bytes());
    }
    for time in [times.iter().min(), times.iter().max()] {
        body.extend(time.copied().unwrap_or(0).to_le_bytes());
    }
    body.extend((counts.len() as u32 * 10).to_le_bytes());
    for (id, count) in counts {
        body.extend([&id.to_le_bytes()[..], &count.to_le_bytes()].concat());
    }
    body
}

fn compressed(bytes: &[u8], compression: &str) -> Vec<u8> {
    match compression {
        "zstd" => zstd::bulk::compress(bytes, 1).expect("memory"),
        "lz4" => {
            let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).expect("memory");
            encoder.write_all(bytes).expect("memory");
            encoder.finish().0
        }
        _ => bytes.to_vec(),
    }
}

/// Appends a record.
pub fn put(out: &mut Vec<u8>, opcode: u8, body: &[u8]) {
    out.push(opcode);
    out.extend((body.len() as u64).to_le_bytes());
    out.extend_from_slice(body);
}

fn string(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat()
}

fn map(entries: &[(&str, &str)]) -> Vec<u8> {
    let entries: Vec<u8> =
        entries.iter().flat_map(|(key, value)| [string(key), string(value)].concat()).collect();
    [&(entries.len() as u32).to_le_bytes()[..], &entries].concat()
}

fn word(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn long(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}
