//! Recordings of every shape, made by the format's own library, and what the tests do with them.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Metadata};
use mcap::write::PrivateRecordOptions;

use crate::{
    Compression, Error, Overview, Position, Record, RecordingReader, RecordingWriter, Result,
    WriteOptions,
};

#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    pub(super) compression: Option<mcap::Compression>,
    pub(super) is_chunked: bool,
    pub(super) has_summary: bool,
    pub(super) has_data_crc: bool,
}

pub(super) const CHUNKED: Shape = Shape {
    compression: Some(mcap::Compression::Zstd),
    is_chunked: true,
    has_summary: true,
    has_data_crc: true,
};

pub(super) fn shapes() -> Vec<Shape> {
    let mut shapes = Vec::new();
    for has_summary in [true, false] {
        for has_data_crc in [true, false] {
            for compression in [None, Some(mcap::Compression::Lz4), Some(mcap::Compression::Zstd)] {
                shapes.push(Shape { compression, has_summary, has_data_crc, ..CHUNKED });
            }
            shapes.push(Shape { compression: None, is_chunked: false, has_summary, has_data_crc });
        }
    }
    shapes
}

/// A recording with two equal schemas, two equal channels, a channel without a schema and one
/// without messages, log times out of order, an empty message, attachments, metadata and private
/// records.
pub(super) fn recording(shape: Shape) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new()
        .compression(shape.compression)
        .compression_threads(0)
        .use_chunks(shape.is_chunked)
        .chunk_size(Some(2048))
        .profile("ros2")
        .library("a recorder")
        .calculate_data_section_crc(shape.has_data_crc)
        .emit_summary_records(shape.has_summary)
        .emit_summary_offsets(shape.has_summary)
        .create(&mut bytes)
        .unwrap();
    let qos = BTreeMap::from([("offered_qos_profiles".to_owned(), "- depth: 1".to_owned())]);
    for id in [7, 9] {
        let name = "std_msgs/msg/String";
        writer.add_schema_with_id(id, name, "ros2msg", b"string data").unwrap();
    }
    for id in [3, 4] {
        writer.add_channel_with_id(id, 7, "/twice", "cdr", &qos).unwrap();
    }
    writer.add_channel_with_id(0, 0, "/bare", "json", &BTreeMap::new()).unwrap();
    writer.add_channel_with_id(500, 9, "/silent", "cdr", &qos).unwrap();
    for i in 0..40_u64 {
        let header = MessageHeader {
            channel_id: [3, 4, 0][i as usize % 3],
            sequence: i as u32 * 2,
            log_time: 1_000 + (i * 7) % 40,
            publish_time: 900 + i,
        };
        let data: Vec<u8> = (0..(i * 37) % 500).map(|j| ((i * 31 + j * j) % 251) as u8).collect();
        writer.write_to_known_channel(&header, &data).unwrap();
        match i {
            10 => writer
                .write_private_record(0x81, b"inside", PrivateRecordOptions::IncludeInChunks.into())
                .unwrap(),
            20 => attach(&mut writer, "calibration.yaml", b"a: 1"),
            25 => writer.write_private_record(0xff, b"", Default::default()).unwrap(),
            30 => writer
                .write_metadata(&Metadata { name: "rosbag2".into(), metadata: qos.clone() })
                .unwrap(),
            _ => {}
        }
    }
    attach(&mut writer, "empty", b"");
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

fn attach<W: std::io::Write + std::io::Seek>(
    writer: &mut mcap::Writer<W>,
    name: &str,
    data: &[u8],
) {
    writer
        .attach(&mcap::Attachment {
            log_time: 5,
            create_time: 6,
            name: name.into(),
            media_type: "text/plain".into(),
            data: data.into(),
        })
        .unwrap();
}

pub(super) struct Folder(tempfile::TempDir);

impl Folder {
    pub(super) fn new() -> Self {
        Folder(tempfile::tempdir().unwrap())
    }

    pub(super) fn root(&self) -> &Path {
        self.0.path()
    }

    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, bytes).unwrap();
        path
    }

    pub(super) fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        let name = |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name();
        entries.map(|e| name(e).into_string().unwrap()).collect()
    }
}

pub(super) fn read_all(path: &Path) -> Result<Vec<Record<'static>>> {
    let mut reader = RecordingReader::open(path)?;
    let mut records = Vec::new();
    while let Some(record) = reader.next_record()? {
        records.push(record.into_owned());
    }
    Ok(records)
}

/// Without what a copy may change: the library, and where messages lie.
pub(super) fn content(records: Vec<Record<'static>>) -> Vec<Record<'static>> {
    let nowhere = Position { chunk_offset: 0, index_in_chunk: 0 };
    let strip = |record| match record {
        Record::Header { profile, .. } => Record::Header { profile, library: String::new() },
        Record::Message { header, data, .. } => Record::Message { header, data, position: nowhere },
        record => record,
    };
    records.into_iter().map(strip).collect()
}

pub(super) fn messages(records: &[Record<'static>]) -> Vec<Record<'static>> {
    let is_message = |record: &&Record| matches!(record, Record::Message { .. });
    records.iter().filter(is_message).cloned().collect()
}

pub(super) fn has_warning(records: &[Record]) -> bool {
    let is_warning =
        |record: &Record| matches!(record, Record::Damaged { .. } | Record::Truncated { .. });
    records.iter().any(is_warning)
}

pub(super) fn copy(input: &Path, output: &Path, compression: Compression) -> Result<u64> {
    let overview = Overview::read(input)?;
    let mut writer = RecordingWriter::create(
        output,
        &WriteOptions {
            profile: overview.profile,
            recorded_by: overview.library,
            compression,
            force: false,
        },
    )?;
    let mut reader = RecordingReader::open(input)?;
    while let Some(record) = reader.next_record()? {
        writer.copy(&record)?;
    }
    writer.finish()
}

pub(super) fn problem_of(result: Result<impl Sized>) -> (u64, String) {
    match result {
        Err(Error::Damaged { offset, damage, .. }) => (offset, damage.to_string()),
        Err(error) => panic!("another error: {error}"),
        Ok(_) => panic!("no error"),
    }
}
