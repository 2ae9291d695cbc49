//! Recordings of every shape, written record by record.

use std::collections::BTreeMap;
use std::io::Write as _;

use mcap::records::op;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::{Shape, u16_at, u64_at};

/// A record: opcode and content.
pub(super) type Raw = (u8, Vec<u8>);

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat()
}

fn framed((opcode, content): &Raw) -> Vec<u8> {
    let length = (content.len() as u64).to_le_bytes();
    [&[*opcode], length.as_slice(), content].concat()
}

pub(super) fn schema(id: u16, name: &str, data: &[u8]) -> Raw {
    let length = (data.len() as u32).to_le_bytes();
    (
        op::SCHEMA,
        [&id.to_le_bytes(), text(name).as_slice(), &text("ros2msg"), &length, data].concat(),
    )
}

pub(super) fn channel(id: u16, schema: u16, topic: &str, encoding: &str) -> Raw {
    let key = [text("offered_qos_profiles"), text("- depth: 1")].concat();
    let map = [(key.len() as u32).to_le_bytes().to_vec(), key].concat();
    let ids = [id.to_le_bytes(), schema.to_le_bytes()].concat();
    (op::CHANNEL, [ids, text(topic), text(encoding), map].concat())
}

pub(super) fn message(channel: u16, sequence: u32, times: [u64; 2], data: &[u8]) -> Raw {
    let ids = [&channel.to_le_bytes(), sequence.to_le_bytes().as_slice()].concat();
    let times = times.map(u64::to_le_bytes).concat();
    (op::MESSAGE, [ids.as_slice(), &times, data].concat())
}

pub(super) fn attachment(name: &str, data: &[u8], has_crc: bool) -> Raw {
    let length = (data.len() as u64).to_le_bytes();
    let times = [5_u64, 6].map(u64::to_le_bytes).concat();
    let content = [times.as_slice(), &text(name), &text("text/plain"), &length, data].concat();
    let crc = if has_crc { crc32fast::hash(&content) } else { 0 };
    (op::ATTACHMENT, [content.as_slice(), &crc.to_le_bytes()].concat())
}

pub(super) fn metadata(name: &str) -> Raw {
    let map = [text("key"), text("value")].concat();
    (op::METADATA, [text(name), (map.len() as u32).to_le_bytes().to_vec(), map].concat())
}

/// A file that is being put together.
pub(super) struct Recorder {
    shape: Shape,
    random: Pcg64Mcg,
    file: Vec<u8>,
    open: Vec<Raw>,
    pub(super) definitions: Vec<Raw>,
    chunk_indexes: Vec<Raw>,
    counts: BTreeMap<u16, u64>,
    others: [u32; 2],
    chunks: u32,
}

impl Recorder {
    pub(super) fn new(shape: Shape) -> Self {
        let header = (op::HEADER, [text("ros2"), text("a recorder")].concat());
        Recorder {
            shape,
            random: Pcg64Mcg::seed_from_u64(shape.seed ^ 0xabc),
            file: [mcap::MAGIC, &framed(&header)].concat(),
            open: Vec::new(),
            definitions: Vec::new(),
            chunk_indexes: Vec::new(),
            counts: BTreeMap::new(),
            others: [0; 2],
            chunks: 0,
        }
    }

    pub(super) fn define(&mut self, record: Raw) {
        self.definitions.push(record.clone());
        self.put(record);
    }

    /// Puts a record into the open chunk or beside it.
    pub(super) fn put(&mut self, record: Raw) {
        if record.0 == op::MESSAGE {
            *self.counts.entry(u16_at(&record.1, 0)).or_default() += 1;
        }
        match self.random.random_bool(self.shape.chunked) {
            true => self.open.push(record),
            false => self.bare(&record),
        }
    }

    /// Puts a record beside chunks, behind the one that is open.
    pub(super) fn bare(&mut self, record: &Raw) {
        self.close_chunk();
        self.others[0] += u32::from(record.0 == op::ATTACHMENT);
        self.others[1] += u32::from(record.0 == op::METADATA);
        self.file.extend(framed(record));
    }

    pub(super) fn close_chunk(&mut self) {
        if self.open.is_empty() {
            return;
        }
        let (shape, records) = (self.shape, std::mem::take(&mut self.open));
        let (mut content, mut indexes) = (Vec::new(), BTreeMap::<u16, Vec<[u64; 2]>>::new());
        for record in &records {
            if record.0 == op::MESSAGE {
                let entry = [u64_at(&record.1, 6), content.len() as u64];
                indexes.entry(u16_at(&record.1, 0)).or_default().push(entry);
            }
            content.extend(framed(record));
        }
        let times = indexes.values().flatten().map(|entry| entry[0]);
        let times = [times.clone().min().unwrap_or(0), times.max().unwrap_or(0)];
        let any = ["", "lz4", "zstd"][self.random.random_range(0..3)];
        let compression = shape.compression.unwrap_or(any);
        let data = compressed(&content, compression);
        let crc = if shape.has_crcs { crc32fast::hash(&content) } else { 0 };
        let sizes = (content.len() as u64).to_le_bytes();
        let header = [times.map(u64::to_le_bytes).concat(), sizes.to_vec()].concat();
        let lengths = (data.len() as u64).to_le_bytes();
        let body = [header.as_slice(), &crc.to_le_bytes(), &text(compression), &lengths, &data];
        let chunk = framed(&(op::CHUNK, body.concat()));
        let start = self.file.len() as u64;
        self.file.extend(&chunk);
        let mut offsets = Vec::new();
        let behind = self.file.len();
        for (channel, entries) in indexes.into_iter().filter(|_| shape.has_message_indexes) {
            offsets.extend(
                [&channel.to_le_bytes(), (self.file.len() as u64).to_le_bytes().as_slice()]
                    .concat(),
            );
            let entries: Vec<u8> =
                entries.as_flattened().iter().flat_map(|n| n.to_le_bytes()).collect();
            let length = (entries.len() as u32).to_le_bytes();
            let index = [channel.to_le_bytes().as_slice(), &length, &entries].concat();
            self.file.extend(framed(&(op::MESSAGE_INDEX, index)));
        }
        let index = [
            [times[0], times[1], start, chunk.len() as u64].map(u64::to_le_bytes).concat(),
            (offsets.len() as u32).to_le_bytes().to_vec(),
            offsets,
            ((self.file.len() - behind) as u64).to_le_bytes().to_vec(),
            text(compression),
            [data.len() as u64, content.len() as u64].map(u64::to_le_bytes).concat(),
        ];
        self.chunk_indexes.push((op::CHUNK_INDEX, index.concat()));
        self.chunks += 1;
    }

    fn statistics(&self, times: [u64; 2]) -> Raw {
        let definitions = |opcode| self.definitions.iter().filter(|d| d.0 == opcode).count();
        let counts: Vec<u8> = self
            .counts
            .iter()
            .flat_map(|(id, count)| [id.to_le_bytes().as_slice(), &count.to_le_bytes()].concat())
            .collect();
        let content = [
            self.counts.values().sum::<u64>().to_le_bytes().to_vec(),
            (definitions(op::SCHEMA) as u16).to_le_bytes().to_vec(),
            [definitions(op::CHANNEL) as u32, self.others[0], self.others[1], self.chunks]
                .map(u32::to_le_bytes)
                .concat(),
            times.map(u64::to_le_bytes).concat(),
            (counts.len() as u32).to_le_bytes().to_vec(),
            counts,
        ];
        (op::STATISTICS, content.concat())
    }

    pub(super) fn finish(mut self, times: [u64; 2]) -> Vec<u8> {
        self.close_chunk();
        let shape = self.shape;
        let crc = if shape.has_crcs { crc32fast::hash(&self.file) } else { 0 };
        self.file.extend(framed(&(op::DATA_END, crc.to_le_bytes().to_vec())));
        let start = self.file.len();
        if shape.has_summary {
            let statistics = self.statistics(times);
            let statistics = shape.has_statistics.then_some(&statistics);
            let indexes = self.chunk_indexes.iter().filter(|_| shape.has_chunk_indexes);
            for record in self.definitions.iter().chain(statistics).chain(indexes) {
                self.file.extend(framed(record));
            }
        }
        let summary = if self.file.len() > start { start as u64 } else { 0 };
        let footer = [summary, 0].map(u64::to_le_bytes).concat();
        let mut covered = self.file[start..].to_vec();
        covered.extend(framed(&(op::FOOTER, [footer.as_slice(), &[0; 4]].concat())));
        covered.truncate(covered.len() - 4);
        let crc = if shape.has_crcs { crc32fast::hash(&covered) } else { 0 };
        self.file.extend(framed(&(op::FOOTER, [footer.as_slice(), &crc.to_le_bytes()].concat())));
        self.file.extend(mcap::MAGIC);
        self.file
    }
}

fn compressed(content: &[u8], compression: &str) -> Vec<u8> {
    match compression {
        "lz4" => {
            let mut encoder = lz4::EncoderBuilder::new()
                .block_checksum(lz4::liblz4::BlockChecksum::NoBlockChecksum)
                .build(Vec::new())
                .expect("an encoder");
            encoder.write_all(content).expect("memory");
            encoder.finish().0
        }
        "zstd" => zstd::bulk::compress(content, 1).expect("memory"),
        _ => content.to_vec(),
    }
}
