//! Recordings that are cut off or damaged, and clouds that are.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use divmerge::PointCloud;
use divmerge::annotate::Semantics;
use divmerge::datasets::drive::{CLOUD_TOPIC, cloud_message};
use divmerge::messages::definitions::POINT_CLOUD2;
use divmerge::pipeline::Config;
use divmerge::recording::{MessageHeader, Overview, Record, RecordingWriter, WriteOptions};
use divmerge::simulate::{Drive, Scene, Sensor};
use tempfile::TempDir;

use super::{assert_passed_through, drive, options, records, run, same};
use crate::cli::{divmerge, path, text};

#[test]
fn truncated_in_the_middle_of_a_chunk() {
    let (_folder, input) = drive(12);
    let whole = std::fs::read(&input).expect("bytes");
    let overview = Overview::read(&input).expect("a recording");
    std::fs::write(&input, &whole[..whole.len() * 2 / 3]).expect("written");
    let (output, report) = run(&input, &options(Semantics::Auto)).expect("annotated");
    assert!(!report.is_complete());
    assert!(report.truncated.as_ref().is_some_and(|cut| cut.contains("byte")), "{report:?}");
    let frames = report.topics[CLOUD_TOPIC].frames;
    assert!((1..12).contains(&frames), "{frames} frames");
    assert!(report.messages < overview.message_count);
    assert_passed_through_cut(&input, &output);
}

#[test]
fn an_input_cut_off_before_its_first_topic_is_said_to_be() {
    let (_folder, input) = drive(1);
    let whole = std::fs::read(&input).expect("bytes");
    std::fs::write(&input, &whole[..100]).expect("written");
    let error = run(&input, &options(Semantics::Auto)).expect_err("no topic").to_string();
    assert!(error.contains("no topic at all") && error.contains("cut off"), "{error}");
}

/// What could be read of a cut-off input is in a whole output.
fn assert_passed_through_cut(input: &Path, output: &Path) {
    let overview = Overview::read(output).expect("a whole recording");
    assert!(overview.is_complete);
    let after = records(output);
    for record in records(input) {
        if !matches!(record, Record::Truncated { .. }) {
            assert!(after.iter().any(|other| same(&record, other)), "{record:?} is missing");
        }
    }
}

#[test]
fn a_flipped_byte_is_an_error_that_names_the_place() {
    let (folder, input) = drive(6);
    let mut bytes = std::fs::read(&input).expect("bytes");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    std::fs::write(&input, &bytes).expect("written");
    let error = run(&input, &options(Semantics::Auto)).expect_err("damaged").to_string();
    assert!(error.contains("drive.mcap") && error.contains("byte "), "{error}");
    assert!(error.contains(CLOUD_TOPIC), "{error}");
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("folder").collect();
    assert_eq!(left.len(), 1, "something was left behind: {left:?}");
}

#[test]
fn info_and_annotate_agree_on_what_is_incomplete() {
    let (folder, input) = drive(3);
    let whole = std::fs::read(&input).expect("bytes");
    let half = &whole[..whole.len() / 2];
    let cases: [(&str, Vec<u8>, i32); 6] = [
        ("whole", whole.clone(), 0),
        ("cut", half.to_vec(), 3),
        ("zeros", [half, &[0; 9000]].concat(), 3),
        ("zeros-behind", [&whole[..], &[0; 9000]].concat(), 0),
        ("two", [&whole[..], &whole].concat(), 3),
        ("more", [&whole[..], b"more"].concat(), 0),
    ];
    for (name, bytes, code) in cases {
        let (input, output) = (folder.path().join(name), folder.path().join("out.mcap"));
        std::fs::write(&input, bytes).expect("written");
        let (input, output) = (path(&input), path(&output));
        let info = divmerge(&["info", input]);
        assert_eq!(info.status.code(), Some(code), "{name}: {info:?}");
        let done = divmerge(&["annotate", input, "-o", output, "--force", "--no-layout"]);
        assert_eq!(done.status.code(), Some(code), "{name}: {}", text(&done.stderr));
        let frames = Overview::read(Path::new(output)).expect("a recording").message_counts;
        assert!(frames.values().any(|&count| count > 0), "{name}");
    }
}

/// A schema that defines nothing is not handed on.
#[test]
fn annotated_clouds_have_a_whole_definition() {
    let (_folder, whole) = drive(1);
    let whole = Overview::read(&whole).expect("a recording");
    let given = whole.schema_of(whole.channels_of(CLOUD_TOPIC).next().expect("clouds").id);
    let given = given.expect("a schema").data.clone();
    let own = POINT_CLOUD2.data.to_vec();
    let text = String::from_utf8(own.clone()).expect("text");
    let alone = text.split("====").next().expect("its own fields").as_bytes().to_vec();
    let other = format!("# A cloud.\n{text}").into_bytes();
    for (schema, expected) in [
        (given.clone(), given),
        (other.clone(), other),
        (b"".to_vec(), own.clone()),
        (b"sensor_msgs/msg/PointCloud2".to_vec(), own.clone()),
        (alone, own),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let input = folder.path().join("made.mcap");
        let options = WriteOptions { profile: "ros2".into(), ..WriteOptions::default() };
        let mut writer = RecordingWriter::create(&input, &options).expect("a writer");
        let id = writer.add_schema(POINT_CLOUD2.name, "ros2msg", &schema).expect("schema");
        let channel_id = writer.add_channel("/points", id, "cdr", &BTreeMap::new()).expect("one");
        let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
        writer.write_message(&header, &xyz_message(&[[1.0, 0.0, 0.0]])).expect("message");
        writer.finish().expect("finished");
        let (output, _) = run(&input, &super::options(Semantics::All)).expect("annotated");
        let made = Overview::read(&output).expect("a recording");
        let added = made.channels_of("/points/instances").next().expect("the topic").id;
        assert_eq!(made.schema_of(added).expect("a schema").data, expected);
    }
}

#[test]
fn what_is_no_recording_is_said_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let input = folder.path().join("x.mcap");
    for (bytes, word) in [
        (&b""[..], "empty"),
        (b"hello, this is a text file and no recording", "MCAP"),
        (b"#ROSBAG V2.0\nxxxxxxxxxxxxxxxxxxxxxxxxxxx", "ROS 1"),
    ] {
        std::fs::write(&input, bytes).expect("written");
        let error = run(&input, &options(Semantics::Auto)).expect_err("no recording").to_string();
        assert!(error.contains("x.mcap") && error.contains(word), "{error}");
    }
    let missing = run(&folder.path().join("y.mcap"), &options(Semantics::Auto));
    assert!(missing.expect_err("missing").to_string().contains("y.mcap"));
}

/// A recording of the given messages on `/points`, declared as PointCloud2.
fn recording_of(messages: &[Vec<u8>]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("made.mcap");
    let options = WriteOptions { profile: "ros2".into(), ..WriteOptions::default() };
    let mut writer = RecordingWriter::create(&path, &options).expect("a writer");
    let schema = POINT_CLOUD2.add_to(&mut writer).expect("schema");
    let metadata = BTreeMap::new();
    let channel_id = writer.add_channel("/points", schema, "cdr", &metadata).expect("channel");
    for (number, message) in (0_u32..).zip(messages) {
        let header = MessageHeader {
            channel_id,
            sequence: number,
            log_time: u64::from(number),
            publish_time: u64::from(number),
        };
        writer.write_message(&header, message).expect("message");
    }
    writer.finish().expect("finished");
    (folder, path)
}

/// A cloud of xyz FLOAT32 points in one row.
fn xyz_message(points: &[[f32; 3]]) -> Vec<u8> {
    let mut frame = Drive::new(Sensor::Vlp16, Scene::Parking, 1).frame(0);
    let count = points.len();
    let axis = |axis: usize| points.iter().map(|p| p[axis]).collect();
    let cloud = PointCloud::new(axis(0), axis(1), axis(2)).expect("three columns");
    let cloud = cloud.with_ring(vec![0; count]).and_then(|cloud| cloud.with_class(vec![0; count]));
    frame.cloud = cloud.expect("one for each point");
    frame.intensity = vec![0.0; count];
    frame.time_offset_ns = vec![0; count];
    frame.true_instance = vec![0; count];
    let mut message = Vec::new();
    cloud_message(&frame, &mut message).expect("a message");
    message
}

#[test]
fn clouds_that_lie_are_passed_through_and_named() {
    let good = xyz_message(&[[1.0, 0.0, 0.0], [1.0, 0.1, 0.0]]);
    let mut lying = good.clone();
    let cut = lying.len() - 9;
    lying.truncate(cut);
    let (_folder, input) = recording_of(&[good, lying, b"\0\x01\0\0".to_vec(), Vec::new()]);
    let (output, report) = run(&input, &options(Semantics::All)).expect("annotated");
    let topic = &report.topics["/points"];
    assert_eq!((topic.frames, topic.unreadable), (1, 3));
    assert!(!report.is_complete());
    let [warning] = report.warnings.as_slice() else { panic!("{:?}", report.warnings) };
    for words in ["/points: 3 clouds could not be read; the first: malformed", "message 2 of the"] {
        assert!(warning.contains(words), "{warning}");
    }
    assert_passed_through(&input, &output);
}

#[test]
fn empty_nan_and_crowded_clouds_are_annotated_with_a_word() {
    let crowd: Vec<[f32; 3]> =
        (0..1_000_000).map(|i| [5.0 + (i % 1000) as f32 * 1e-3, 0.0, 0.0]).collect();
    let (_folder, input) = recording_of(&[
        xyz_message(&[]),
        xyz_message(&[[f32::NAN; 3], [0.0; 3]]),
        xyz_message(&crowd),
    ]);
    for semantics in [Semantics::All, Semantics::Ground, Semantics::Auto] {
        let mut options = options(semantics);
        options.force = true;
        let (_, report) = run(&input, &options).expect("annotated");
        let topic = &report.topics["/points"];
        assert_eq!((topic.frames, topic.unreadable), (3, 0));
        assert_eq!(topic.points, 1_000_002);
        let words = report.warnings.join("\n");
        assert!(words.contains("without points"), "{words}");
        assert!(words.contains("none of 2 points is a return"), "{words}");
        assert!(words.contains("999999 of 1000000 returns"), "{words}");
    }
}

#[test]
fn clouds_of_no_rows_or_no_columns() {
    let empty = |height: usize, width: usize| {
        let mut frame = Drive::new(Sensor::Vlp16, Scene::Parking, 1).frame(0);
        frame.cloud = PointCloud::default().organised(height, width).expect("no points");
        let mut message = Vec::new();
        cloud_message(&frame, &mut message).expect("a message");
        message
    };
    let (_folder, input) = recording_of(&[empty(4, 0), empty(0, 4), empty(0, 0)]);
    for semantics in [Semantics::All, Semantics::Ground, Semantics::Auto] {
        for config in [Config::paper(), Config::authors(), Config::best()] {
            let mut options = options(semantics.clone());
            options.config.pipeline = config;
            options.force = true;
            let (_, report) = run(&input, &options).expect("annotated");
            assert_eq!(report.topics["/points"].frames, 3, "{:?}", report.warnings);
        }
    }
}

#[test]
fn a_missing_field_is_named_with_those_that_are_there() {
    let (_folder, input) = drive(1);
    let mut options = options(Semantics::Field("klass".into()));
    let error = run(&input, &options).expect_err("no such field").to_string();
    assert!(error.contains("`klass`") && error.contains("label"), "{error}");
    options.topics = vec!["/nothing".into()];
    options.force = true;
    let error = run(&input, &options).expect_err("no such topic").to_string();
    assert!(error.contains("/nothing") && error.contains(CLOUD_TOPIC), "{error}");
}
