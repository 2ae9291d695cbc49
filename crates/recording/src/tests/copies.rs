//! Recordings of every shape, copied, cut and damaged.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use mcap::records::MessageHeader;

use super::fixtures::{CHUNKED, Folder, Shape, recording, shapes};
use crate::fields::head;
use crate::{
    Compression, Error, Overview, PartialFile, Position, Record, RecordingReader, RecordingWriter,
    Result, WriteOptions,
};

fn read_all(path: &Path) -> Result<Vec<Record<'static>>> {
    let mut reader = RecordingReader::open(path)?;
    let mut records = Vec::new();
    while let Some(record) = reader.next_record()? {
        records.push(record.into_owned());
    }
    Ok(records)
}

/// Without what a copy may change: the library, and where messages lie.
fn content(records: Vec<Record<'static>>) -> Vec<Record<'static>> {
    let nowhere = Position { chunk_offset: 0, index_in_chunk: 0 };
    let strip = |record| match record {
        Record::Header { profile, .. } => Record::Header { profile, library: String::new() },
        Record::Message { header, data, .. } => Record::Message { header, data, position: nowhere },
        record => record,
    };
    records.into_iter().map(strip).collect()
}

fn messages(records: &[Record<'static>]) -> Vec<Record<'static>> {
    let is_message = |record: &&Record| matches!(record, Record::Message { .. });
    records.iter().filter(is_message).cloned().collect()
}

fn has_warning(records: &[Record]) -> bool {
    let is_warning =
        |record: &Record| matches!(record, Record::Damaged { .. } | Record::Truncated { .. });
    records.iter().any(is_warning)
}

fn copy(input: &Path, output: &Path, compression: Compression) -> Result<u64> {
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

fn problem_of(result: Result<impl Sized>) -> (u64, String) {
    match result {
        Err(Error::Damaged { offset, damage, .. }) => (offset, damage.to_string()),
        Err(error) => panic!("another error: {error}"),
        Ok(_) => panic!("no error"),
    }
}

#[test]
fn every_shape_is_read_whole() {
    let folder = Folder::new();
    for shape in shapes() {
        let records = read_all(&folder.write("in.mcap", &recording(shape))).unwrap();
        let count = |of: fn(&Record) -> bool| records.iter().filter(|r| of(r)).count();
        assert_eq!(count(|r| matches!(r, Record::Header { .. })), 1, "{shape:?}");
        assert_eq!(count(|r| matches!(r, Record::Schema(_))), 2, "{shape:?}");
        assert_eq!(count(|r| matches!(r, Record::Channel(_))), 4, "{shape:?}");
        assert_eq!(count(|r| matches!(r, Record::Message { .. })), 40, "{shape:?}");
        assert_eq!(count(|r| matches!(r, Record::Attachment { .. })), 2, "{shape:?}");
        assert_eq!(count(|r| matches!(r, Record::Metadata(_))), 1, "{shape:?}");
        assert_eq!(count(|r| matches!(r, Record::Private { .. })), 2, "{shape:?}");
        assert!(!has_warning(&records), "{shape:?}");
    }
}

#[test]
fn a_copy_is_the_same_recording() {
    let folder = Folder::new();
    for (i, shape) in shapes().into_iter().enumerate() {
        let input = folder.write("in.mcap", &recording(shape));
        let original = content(read_all(&input).unwrap());
        for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
            let output = folder.path(&format!("{i}-{compression:?}.mcap"));
            let size = copy(&input, &output, compression).unwrap();
            assert_eq!(size, fs::metadata(&output).unwrap().len());
            let mut expected = original.clone();
            if !shape.is_chunked {
                // There are chunks in the copy, so a private record that was asked to be in one is.
                let mut copied = content(read_all(&output).unwrap());
                for record in expected.iter_mut().chain(&mut copied) {
                    if let Record::Private { in_chunk, .. } = record {
                        *in_chunk = false;
                    }
                }
                assert_eq!(copied, expected, "{shape:?}");
            } else {
                assert_eq!(content(read_all(&output).unwrap()), expected, "{shape:?}");
            }
        }
    }
}

#[test]
fn the_format_s_own_library_reads_the_copy() {
    let folder = Folder::new();
    let input = folder.write("in.mcap", &recording(CHUNKED));
    let output = folder.path("out.mcap");
    copy(&input, &output, Compression::Zstd).unwrap();
    let [a, b] = [input, output].map(|path| fs::read(path).unwrap());
    let stream = |bytes| -> Vec<_> {
        mcap::MessageStream::new(bytes)
            .unwrap()
            .map(|message| message.unwrap())
            .map(|m| (m.channel, m.sequence, m.log_time, m.publish_time, m.data.into_owned()))
            .collect()
    };
    assert_eq!(stream(&a), stream(&b));
    let [a, b] = [a, b].map(|bytes| mcap::Summary::read(&bytes).unwrap().unwrap());
    assert_eq!((a.schemas, a.channels), (b.schemas, b.channels));
    let [a, b] = [a.stats, b.stats].map(Option::unwrap);
    assert_eq!(a.channel_message_counts, b.channel_message_counts);
    assert_eq!((a.attachment_count, a.metadata_count), (b.attachment_count, b.metadata_count));
}

#[test]
fn a_copy_is_deterministic() {
    let folder = Folder::new();
    let input = folder.write("in.mcap", &recording(CHUNKED));
    let [a, b] = ["a.mcap", "b.mcap"].map(|name| folder.path(name));
    copy(&input, &a, Compression::Zstd).unwrap();
    copy(&input, &b, Compression::Zstd).unwrap();
    assert_eq!(fs::read(a).unwrap(), fs::read(b).unwrap());
}

#[test]
fn positions_name_the_chunk_and_the_message() {
    let folder = Folder::new();
    let input = folder.write("in.mcap", &recording(CHUNKED));
    let bytes = fs::read(&input).unwrap();
    let mut last: Option<Position> = None;
    for record in messages(&read_all(&input).unwrap()) {
        let Record::Message { position, .. } = record else { unreachable!() };
        assert_eq!(bytes[position.chunk_offset as usize], mcap::records::op::CHUNK);
        match last {
            Some(last) if last.chunk_offset == position.chunk_offset => {
                assert_eq!(position.index_in_chunk, last.index_in_chunk + 1);
            }
            _ => assert_eq!(position.index_in_chunk, 0),
        }
        last = Some(position);
    }
}

#[test]
fn the_hash_is_that_of_the_file_however_much_was_read() {
    let folder = Folder::new();
    let input = folder.write("in.mcap", &recording(CHUNKED));
    use sha2::Digest;
    let digest = sha2::Sha256::digest(fs::read(&input).unwrap());
    let expected: String = digest.iter().map(|b| format!("{b:02x}")).collect();
    for count in [0, 1, 20, 1000] {
        let mut reader = RecordingReader::open(&input).unwrap();
        for _ in 0..count {
            reader.next_record().unwrap();
        }
        assert_eq!(reader.finish().unwrap().as_ref(), Some(&expected));
    }
}

#[test]
fn overviews_from_the_index_and_from_the_records_agree() {
    let folder = Folder::new();
    for shape in shapes() {
        let overview = Overview::read(&folder.write("in.mcap", &recording(shape))).unwrap();
        let found = (overview.profile.as_str(), overview.library.as_str());
        assert_eq!(found, ("ros2", "a recorder"));
        assert_eq!(overview.from_summary, shape.has_summary);
        assert!(overview.is_complete);
        assert_eq!(overview.schemas.keys().copied().collect::<Vec<_>>(), [7, 9]);
        let channels: Vec<_> = overview.channels.keys().copied().collect();
        assert_eq!(channels, [0, 3, 4, 500]);
        assert_eq!(overview.message_count, 40);
        assert_eq!(overview.message_counts[&3], 14);
        assert_eq!((overview.start_ns, overview.end_ns), (Some(1000), Some(1039)));
        assert_eq!((overview.attachment_count, overview.metadata_count), (2, 1));
        assert_eq!(overview.chunk_count > 0, shape.is_chunked);
        assert_eq!(overview.compression.len(), usize::from(shape.is_chunked));
        assert_eq!(overview.problems, Vec::<String>::new());
        assert_eq!(overview.schema_of(500).unwrap().id, 9);
        assert_eq!(overview.channels_of("/twice").count(), 2);
    }
}

/// A recording put together by hand, whose summary has a schema and a channel that stand nowhere
/// else.
fn with_a_channel_only_in_the_summary() -> Vec<u8> {
    fn text(text: &str) -> Vec<u8> {
        [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat()
    }
    fn record(opcode: u8, parts: &[&[u8]]) -> Vec<u8> {
        let body = parts.concat();
        [head(opcode, body.len() as u64).as_slice(), &body].concat()
    }
    fn schema(id: u8) -> Vec<u8> {
        record(3, &[&[id, 0], &text("S"), &text(""), &[0; 4]])
    }
    fn channel(id: u8, schema: u8) -> Vec<u8> {
        let ids = [id, 0, schema, 0];
        record(4, &[&ids, &text(&format!("/{id}")), &text("cdr"), &[0; 4]])
    }
    let statistics = {
        let (counts, times) = ([1, 0, 0, 0, 0, 0, 0, 0], [5_u64.to_le_bytes(); 2].concat());
        let others = [2, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        let by_channel = [10, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 0];
        record(11, &[&counts, &others, &times, &by_channel])
    };
    let message = record(5, &[&[1, 0], &[0; 4], &[5; 8], &[5; 8], b"hello"]);
    let data = [record(1, &[&text(""), &text("hand")]), schema(1), channel(1, 1), message].concat();
    let mut bytes = [mcap::MAGIC, &data, &record(15, &[&[0; 4]])].concat();
    let start = bytes.len() as u64;
    // The channels before the schemas, as a writer may order them.
    for part in [channel(1, 1), channel(2, 2), schema(1), schema(2), statistics] {
        bytes.extend(part);
    }
    bytes.extend(record(2, &[&start.to_le_bytes(), &[0; 8], &[0; 4]]));
    bytes.extend(mcap::MAGIC);
    bytes
}

#[test]
fn a_channel_only_in_the_summary_is_kept() {
    let folder = Folder::new();
    let input = folder.write("in.mcap", &with_a_channel_only_in_the_summary());
    let overview = Overview::read(&input).unwrap();
    assert!(overview.from_summary);
    assert_eq!(overview.channels[&2].topic, "/2");
    let output = folder.path("out.mcap");
    copy(&input, &output, Compression::None).unwrap();
    let [a, b] = [&input, &output].map(|path| content(read_all(path).unwrap()));
    assert_eq!(a, b);
    assert!(!has_warning(&a));
    assert!(matches!(a.last(), Some(Record::Channel(channel)) if channel.topic == "/2"));
}

#[test]
fn a_summary_that_contradicts_itself_is_not_believed() {
    let folder = Folder::new();
    let mut bytes = with_a_channel_only_in_the_summary();
    // The statistics' count of schemas, from 2 to 3.
    let at = bytes.len() - 8 - 29 - (8 + 18 + 16 + 14) + 8;
    assert_eq!(bytes[at], 2);
    bytes[at] = 3;
    let overview = Overview::read(&folder.write("in.mcap", &bytes)).unwrap();
    assert!(!overview.from_summary);
    assert_eq!(overview.channels.len(), 2);
}

#[test]
fn a_file_cut_anywhere_gives_a_prefix_of_its_messages() {
    let folder = Folder::new();
    for shape in shapes().into_iter().filter(|shape| shape.has_data_crc) {
        let whole = recording(shape);
        let original = messages(&read_all(&folder.write("in.mcap", &whole)).unwrap());
        let mut most = 0;
        for length in (1..whole.len()).step_by(97).chain(whole.len() - 40..whole.len()) {
            let path = folder.write("cut.mcap", &whole[..length]);
            if length < mcap::MAGIC.len() {
                assert!(problem_of(read_all(&path)).1.contains("cut off"));
                continue;
            }
            let records = read_all(&path).unwrap();
            assert!(matches!(records.last(), Some(Record::Truncated { .. })), "{shape:?} {length}");
            let found = messages(&records);
            assert!(found == original[..found.len()], "{shape:?} {length}");
            assert!(found.len() >= most, "{shape:?} {length}");
            most = found.len();
            let overview = Overview::read(&path).unwrap();
            assert_eq!(overview.message_count, found.len() as u64);
            assert!(!overview.is_complete && !overview.problems.is_empty());
        }
        assert_eq!(most, original.len());
    }
}

#[test]
fn messages_are_saved_from_a_chunk_that_is_cut() {
    let folder = Folder::new();
    let shape = Shape { compression: None, ..CHUNKED };
    let whole = recording(shape);
    let records = read_all(&folder.write("in.mcap", &whole)).unwrap();
    let last = 38;
    let Record::Message { position, .. } = &messages(&records)[last] else { unreachable!() };
    // In the middle of the last chunk of several messages.
    let path = folder.write("cut.mcap", &whole[..position.chunk_offset as usize + 600]);
    let saved = messages(&read_all(&path).unwrap());
    let first_of_chunk = last - position.index_in_chunk as usize;
    assert!(saved.len() > first_of_chunk && saved.len() <= last, "{}", saved.len());
}

/// Bytes that no checksum covers may change without notice where there is no data section checksum:
/// the heads and fields of records outside chunks (the header's profile, message indexes, metadata,
/// times in chunk headers), and whole messages outside chunks. So unchunked recordings are damaged
/// here only where they have that checksum; the messages of all others are always covered.
#[test]
fn no_flipped_byte_passes_unnoticed() {
    let folder = Folder::new();
    let is_covered = |shape: &Shape| shape.is_chunked || shape.has_data_crc;
    for (i, shape) in shapes().into_iter().filter(is_covered).enumerate() {
        let whole = recording(shape);
        let original = messages(&read_all(&folder.write("in.mcap", &whole)).unwrap());
        for offset in (i * 5..whole.len()).step_by(61).chain(0..40) {
            let mut bytes = whole.clone();
            bytes[offset] ^= [0xff, 0x01, 0x80][offset % 3];
            let path = folder.write("flipped.mcap", &bytes);
            if let Ok(records) = read_all(&path) {
                let is_same = messages(&records) == original;
                assert!(is_same || has_warning(&records), "{shape:?} {offset}");
            }
            let _ = Overview::read(&path);
        }
    }
}

#[test]
fn a_damaged_chunk_is_named_with_its_place_and_topics() {
    let folder = Folder::new();
    let shape = Shape { compression: None, ..CHUNKED };
    let mut bytes = recording(shape);
    let records = read_all(&folder.write("in.mcap", &bytes)).unwrap();
    let Record::Message { position, .. } = &messages(&records)[0] else { unreachable!() };
    bytes[position.chunk_offset as usize + 300] ^= 1;
    let (offset, problem) = problem_of(read_all(&folder.write("in.mcap", &bytes)));
    assert_eq!(offset, position.chunk_offset);
    assert!(problem.starts_with("chunk CRC mismatch: stored "), "{problem}");
    assert!(problem.ends_with("; the chunk holds messages of /bare, /twice"), "{problem}");
}

#[test]
fn damage_behind_the_data_costs_no_message() {
    let folder = Folder::new();
    let whole = recording(CHUNKED);
    let original = messages(&read_all(&folder.write("in.mcap", &whole)).unwrap());
    // In the topic of a channel: /bare.
    let at = whole.windows(5).rposition(|window| window == b"/bare").unwrap();
    let mut bytes = whole.clone();
    bytes[at + 1] = b'f';
    let path = folder.write("in.mcap", &bytes);
    let records = read_all(&path).unwrap();
    assert_eq!(messages(&records), original);
    assert!(matches!(records.last(), Some(Record::Damaged { .. })));
    let overview = Overview::read(&path).unwrap();
    assert!(!overview.from_summary);
    assert_eq!(overview.problems.len(), 1);
    assert_eq!(overview.channels[&0].topic, "/bare");
}

#[test]
fn a_length_that_lies_allocates_nothing() {
    let folder = Folder::new();
    for shape in shapes() {
        let whole = recording(shape);
        let header_len = u64::from_le_bytes(whole[9..17].try_into().unwrap()) as usize;
        // The first record behind the header; and, in an uncompressed chunk, the first inside it.
        let first = 8 + 9 + header_len;
        let inside = shape.is_chunked.then_some(first + 9 + 40);
        for at in [first].into_iter().chain(inside) {
            for claim in [u64::MAX, u64::MAX - 8, 1 << 62, 1 << 40, 3 << 30] {
                let mut bytes = whole.clone();
                bytes[at + 1..at + 9].copy_from_slice(&claim.to_le_bytes());
                let path = folder.write("lie.mcap", &bytes);
                assert!(read_all(&path).is_err(), "{shape:?} {at} {claim}");
                // Cut as well, so that the reader tries to save what is there.
                let path = folder.write("lie.mcap", &bytes[..bytes.len() - 9]);
                let _ = read_all(&path);
            }
        }
    }
}

#[test]
fn other_files_are_named() {
    let folder = Folder::new();
    let cases: [(&[u8], &str); 8] = [
        (b"", "empty"),
        (b"#ROSBAG V2.0\n", "ROS 1 bag"),
        (b"SQLite format 3\0", ".db3"),
        (b"\x1f\x8b\x08\0", "gzip"),
        (b"\x28\xb5\x2f\xfd\0", "zstd"),
        (b"\x89MCAP", "cut off"),
        (b"\x89MCAP1\r\n more", "version '1'"),
        (b"hello, world", "68 65 6c 6c 6f"),
    ];
    for (bytes, expected) in cases {
        let path = folder.write("other", bytes);
        for (offset, problem) in
            [problem_of(RecordingReader::open(&path)), problem_of(Overview::read(&path))]
        {
            assert_eq!(offset, 0);
            assert!(problem.contains(expected), "{problem}");
        }
    }
    let (_, problem) = problem_of(RecordingReader::open(folder.root()));
    assert!(problem.contains("folder"), "{problem}");
    let missing = RecordingReader::open(&folder.path("missing.mcap"));
    assert!(matches!(missing, Err(Error::Io { .. })));
}

#[test]
fn new_ids_collide_with_nothing_of_the_input() {
    let folder = Folder::new();
    let input = folder.write("in.mcap", &recording(CHUNKED));
    let overview = Overview::read(&input).unwrap();
    let output = folder.path("out.mcap");
    let mut writer = RecordingWriter::create(&output, &WriteOptions::default()).unwrap();
    writer.reserve(&overview);
    let same = writer.add_schema("std_msgs/msg/String", "ros2msg", b"string data").unwrap();
    assert_eq!(same, 7);
    let schema = writer.add_schema("new", "ros2msg", b"bool new").unwrap();
    assert_eq!(schema, 10);
    let channel = writer.add_channel("/new", schema, "cdr", &BTreeMap::new()).unwrap();
    assert_eq!(channel, 501);
    let mut reader = RecordingReader::open(&input).unwrap();
    while let Some(record) = reader.next_record().unwrap() {
        writer.copy(&record).unwrap();
    }
    let header = MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_message(&header, b"new").unwrap();
    writer.write_metadata("run", &BTreeMap::new()).unwrap();
    writer.finish().unwrap();
    let copied = Overview::read(&output).unwrap();
    assert_eq!(copied.message_count, overview.message_count + 1);
    assert_eq!(copied.channels.len(), overview.channels.len() + 1);
    assert_eq!(copied.metadata_count, overview.metadata_count + 1);
}

#[test]
fn the_output_appears_only_when_it_is_whole() {
    let folder = Folder::new();
    let output = folder.path("out.mcap");
    let writer = RecordingWriter::create(&output, &WriteOptions::default()).unwrap();
    let names = folder.names();
    assert_eq!(names.len(), 1);
    assert_eq!(names, [".out.mcap.partial"]);
    let second = RecordingWriter::create(&output, &WriteOptions::default()).map(drop);
    assert!(second.unwrap_err().to_string().contains("being written by another run"));
    drop(writer);
    assert_eq!(folder.names(), Vec::<String>::new());

    let writer = RecordingWriter::create(&output, &WriteOptions::default()).unwrap();
    writer.finish().unwrap();
    assert_eq!(folder.names(), ["out.mcap"]);
}

#[test]
fn an_existing_file_is_replaced_only_when_asked() {
    let folder = Folder::new();
    let output = folder.path("out.mcap");
    let options = WriteOptions::default();
    // What a run left that was killed is in nobody's way.
    fs::write(PartialFile::name_for(&output), "half a recording").unwrap();
    let late = RecordingWriter::create(&output, &options).unwrap();
    fs::write(&output, "mine").unwrap();
    for error in [
        RecordingWriter::create(&output, &options).map(drop).unwrap_err(),
        late.finish().map(drop).unwrap_err(),
    ] {
        assert!(error.to_string().contains("exists already"), "{error}");
    }
    assert_eq!(fs::read_to_string(&output).unwrap(), "mine");
    assert_eq!(folder.names(), ["out.mcap"]);

    let force = WriteOptions { force: true, ..options };
    let writer = RecordingWriter::create(&output, &force).unwrap();
    writer.finish().unwrap();
    assert!(Overview::read(&output).is_ok());
}

#[cfg(unix)]
#[test]
fn the_output_has_the_permissions_of_any_new_file() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    let any = folder.write("any", b"");
    let output = folder.path("out.mcap");
    let writer = RecordingWriter::create(&output, &WriteOptions::default()).unwrap();
    writer.finish().unwrap();
    let [any, output] = [any, output].map(|path| fs::metadata(path).unwrap().permissions().mode());
    assert_eq!(any, output);
}
