//! Drives of which clouds are a small part: chunks without a cloud, looked into or not.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use divmerge::Result;
use divmerge::annotate::{AnnotateOptions, AnnotationReport, RunEvent, annotate};
use divmerge::recording::{MessageHeader, Overview, Record, RecordingReader};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use tempfile::TempDir;

use crate::recordings::{assert_passed_through, drive, messages, records};

/// Bytes of a picture.
const PICTURE: usize = 40_000;

/// A drive of four clouds with three pictures to each, every message in a chunk of its own; without
/// a checksum over the data, as most recorders leave it out.
fn with_cameras() -> Vec<u8> {
    let (_folder, clouds) = drive(4);
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut bytes = Cursor::new(Vec::new());
    let options = mcap::WriteOptions::new().chunk_size(Some(1)).compression_threads(0);
    let options = options.calculate_data_section_crc(false).profile("ros2");
    let mut writer = options.create(&mut bytes).expect("a writer");
    let schema = writer.add_schema("sensor_msgs/msg/CompressedImage", "ros2msg", b"uint8[] data");
    let schema = schema.expect("a schema");
    let camera = writer.add_channel(schema, "/camera", "cdr", &BTreeMap::new()).expect("a channel");
    for record in records(&clouds) {
        match record {
            Record::Schema(schema) => {
                let (id, name) = (schema.id + 10, &schema.name);
                writer
                    .add_schema_with_id(id, name, &schema.encoding, &schema.data)
                    .expect("schema");
            }
            Record::Channel(channel) => {
                let (id, schema) = (channel.id + 10, channel.schema_id + 10);
                let (encoding, metadata) = (&channel.message_encoding, &channel.metadata);
                writer
                    .add_channel_with_id(id, schema, &channel.topic, encoding, metadata)
                    .expect("a channel");
            }
            Record::Message { header, data, .. } => {
                let channel_id = header.channel_id + 10;
                let header = MessageHeader { channel_id, ..header };
                writer.write_to_known_channel(&header, &data).expect("written");
                for sequence in 0..3 {
                    let picture: Vec<u8> =
                        (0..PICTURE).map(|_| random.random_range(0..=255)).collect();
                    let header = MessageHeader { channel_id: camera, sequence, ..header };
                    writer.write_to_known_channel(&header, &picture).expect("written");
                }
            }
            _ => {}
        }
    }
    writer.finish().expect("finished");
    drop(writer);
    bytes.into_inner()
}

fn write(bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("cameras.mcap");
    std::fs::write(&path, bytes).expect("written");
    (folder, path)
}

fn run(input: &Path, unchecked: bool) -> Result<(PathBuf, AnnotationReport)> {
    let output = input.with_extension(format!("{unchecked}.mcap"));
    let options =
        AnnotateOptions { unchecked, force: true, threads: 2, ..AnnotateOptions::default() };
    let go_on = &mut |_: RunEvent| std::ops::ControlFlow::Continue(());
    annotate(input, &output, &options, go_on).map(|report| (output, report))
}

/// Where a picture lies: the place of the middle of one in the file.
fn in_a_picture(bytes: &[u8], path: &Path) -> usize {
    let overview = Overview::read(path).expect("a recording");
    let camera = overview.channels_of("/camera").next().expect("the camera").id;
    let picture = records(path).into_iter().find_map(|record| match record {
        Record::Message { header, data, .. } if header.channel_id == camera => Some(data),
        _ => None,
    });
    let picture = &picture.expect("a picture")[PICTURE / 2..][..32];
    bytes.windows(32).position(|window| window == picture).expect("the picture")
}

#[test]
fn unopened_or_opened_the_same_recording_comes_out() {
    let (_folder, input) = write(&with_cameras());
    let [(checked, opened), (unchecked, closed)] =
        [false, true].map(|unchecked| run(&input, unchecked).expect("annotated"));
    assert_passed_through(&input, &unchecked);
    assert_eq!(opened.messages, closed.messages);
    assert_eq!(opened.input_sha256, closed.input_sha256);
    assert!(messages(&checked) == messages(&unchecked));
    let [a, b] = [&checked, &unchecked].map(|path| Overview::read(path).expect("whole"));
    assert!(b.from_summary);
    assert_eq!((a.message_counts, a.start_ns, a.end_ns), (b.message_counts, b.start_ns, b.end_ns));
    // Less was unpacked: the chunks of clouds alone, and of what is no picture.
    let (opened, closed) = (opened.profile.read.unpack.bytes, closed.profile.read.unpack.bytes);
    assert!(closed + 12 * PICTURE as u64 <= opened, "{closed} of {opened} bytes");
}

#[test]
fn a_damaged_picture_is_an_error_unless_that_is_not_asked_for() {
    let mut bytes = with_cameras();
    let (_folder, input) = write(&bytes);
    let at = in_a_picture(&bytes, &input);
    bytes[at] ^= 4;
    std::fs::write(&input, &bytes).expect("written");
    let error = run(&input, false).expect_err("damaged").to_string();
    assert!(error.contains("CRC mismatch") && error.contains("/camera"), "{error}");
    // Unchecked it passes as it is, and a reader of the output notices what a reader of the input
    // would.
    let (output, _) = run(&input, true).expect("annotated");
    let mut reader = RecordingReader::open(&output).expect("a recording");
    let error = loop {
        match reader.next_record() {
            Ok(Some(_)) => {}
            Ok(None) => panic!("nothing was noticed"),
            Err(error) => break error.to_string(),
        }
    };
    assert!(error.contains("CRC mismatch") && error.contains("/camera"), "{error}");
}

#[test]
fn message_indexes_that_lie_are_not_believed() {
    let mut bytes = with_cameras();
    let (_folder, input) = write(&bytes);
    let honest = run(&input, true).expect("annotated").1;
    // The message index of a picture's chunk names another channel, or another time.
    const MESSAGE_INDEX: u8 = 0x07;
    let chunk = in_a_picture(&bytes, &input);
    let index = (chunk..).find(|&at| {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().expect("a length"));
        bytes[at] == MESSAGE_INDEX && length == 2 + 4 + 16
    });
    let index = index.expect("an index");
    for place in [9, 15] {
        bytes[index + place] ^= 3;
        std::fs::write(&input, &bytes).expect("written");
        let (output, report) = run(&input, true).expect("annotated");
        assert!(report.profile.read.unpack.bytes >= honest.profile.read.unpack.bytes);
        assert_passed_through(&input, &output);
        let through = records(&output);
        assert!(!through.iter().any(|record| matches!(record, Record::Damaged { .. })));
        bytes[index + place] ^= 3;
    }
}
