//! Recordings of every shape, read and copied.

use std::collections::BTreeMap;
use std::fs;

use mcap::records::MessageHeader;

use super::fixtures::{
    CHUNKED, Folder, content, copy, has_warning, messages, read_all, recording, shapes,
};
use crate::fields::head;
use crate::{
    Compression, Overview, PartialFile, Position, Record, RecordingReader, RecordingWriter,
    WriteOptions,
};

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
