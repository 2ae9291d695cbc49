//! The main job through the library: what the output holds, and what becomes of strange inputs.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use divmerge::Result;
use divmerge::annotate::{Event, Method, Options, Report, Semantics, annotate};
use divmerge::io::drive::{CLOUD_TOPIC, cloud_message, write_drive};
use divmerge::io::{
    CloudFormat, MessageHeader, Overview, POINT_CLOUD2, Record, RecordingReader, RecordingWriter,
    WriteOptions,
};
use divmerge::pipeline::Config;
use divmerge::simulate::{Drive, Scene, Sensor};
use tempfile::TempDir;

use crate::shared_data::shared_data;

fn options(semantics: Semantics) -> Options {
    Options { method: Method { semantics, ..Method::default() }, ..Options::default() }
}

/// A short VLP-16 drive in a fresh folder.
pub fn drive(frames: usize) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("drive.mcap");
    let drive = Drive::new(Sensor::Vlp16, Scene::Parking, 1);
    write_drive(&drive, frames, &path, &WriteOptions::default(), |_| ControlFlow::Continue(()))
        .expect("written");
    (folder, path)
}

fn run(input: &Path, options: &Options) -> Result<(PathBuf, Report)> {
    let output = input.with_extension("annotated.mcap");
    let report = annotate(input, &output, options, &mut |_: Event| ControlFlow::Continue(()))?;
    Ok((output, report))
}

/// All records of a recording but its header.
pub fn records(path: &Path) -> Vec<Record<'static>> {
    let mut reader = RecordingReader::open(path).expect("a recording");
    let mut records = Vec::new();
    while let Some(record) = reader.next_record().expect("readable") {
        if !matches!(record, Record::Header { .. }) {
            records.push(record.into_owned());
        }
    }
    records
}

/// Equal but for where a message lies.
fn same(a: &Record, b: &Record) -> bool {
    match (a, b) {
        (
            Record::Message { header: h1, data: d1, .. },
            Record::Message { header: h2, data: d2, .. },
        ) => h1 == h2 && d1 == d2,
        _ => a == b,
    }
}

/// The messages of a recording in the order of the file.
pub fn messages(path: &Path) -> Vec<(MessageHeader, Vec<u8>)> {
    let of = |record| match record {
        Record::Message { header, data, .. } => Some((header, data.into_owned())),
        _ => None,
    };
    records(path).into_iter().filter_map(of).collect()
}

/// The input's records are a subsequence of the output's, messages in their order.
pub fn assert_passed_through(input: &Path, output: &Path) {
    let (before, after) = (records(input), records(output));
    let is_message = |record: &&Record| matches!(record, Record::Message { .. });
    let mut rest = after.iter().filter(is_message);
    for message in before.iter().filter(is_message) {
        assert!(rest.any(|other| same(message, other)), "a message is missing or out of order");
    }
    for record in before.iter().filter(|record| !is_message(record)) {
        assert!(after.iter().any(|other| same(record, other)), "{record:?} is missing");
    }
}

#[test]
fn everything_is_passed_through_and_two_topics_come_with_it() {
    let (_folder, input) = drive(3);
    let (output, report) = run(&input, &options(Semantics::Auto)).expect("annotated");
    assert_passed_through(&input, &output);
    assert!(report.is_complete() && report.warnings.is_empty(), "{:?}", report.warnings);
    let topic = &report.topics[CLOUD_TOPIC];
    assert_eq!((topic.frames, topic.unreadable), (3, 0));
    assert_eq!(topic.semantics, BTreeMap::from([("field:label".to_owned(), 3)]));
    assert_eq!(topic.reasons.values().sum::<u64>(), topic.points);

    let overview = Overview::read(&output).expect("a recording");
    assert_eq!(overview.profile, "ros2");
    for end in ["instances", "objects"] {
        let topic = format!("{CLOUD_TOPIC}/{end}");
        let channel = overview.channels_of(&topic).next().expect("a new topic");
        assert_eq!(overview.message_counts[&channel.id], 3);
        assert!(channel.metadata["offered_qos_profiles"].contains("reliability"));
    }
}

#[test]
fn an_annotated_cloud_keeps_every_byte_of_every_point() {
    let (_folder, input) = drive(2);
    let (output, _) = run(&input, &options(Semantics::Auto)).expect("annotated");
    let overview = Overview::read(&output).expect("a recording");
    let id = |topic: &str| overview.channels_of(topic).next().expect("the topic").id;
    let (clouds, instances) = (id(CLOUD_TOPIC), id(&format!("{CLOUD_TOPIC}/instances")));
    let messages = records(&output).into_iter().filter_map(|record| match record {
        Record::Message { header, data, .. } => Some((header, data)),
        _ => None,
    });
    let messages: Vec<_> = messages.collect();
    let of = |channel: u16| messages.iter().filter(move |(h, _)| h.channel_id == channel);
    for ((before, original), (after, annotated)) in of(clouds).zip(of(instances)) {
        assert_eq!((before.log_time, before.sequence), (after.log_time, after.sequence));
        let original = CloudFormat::Ros2.decode(original).expect("the cloud");
        let annotated = CloudFormat::Ros2.decode(annotated).expect("the annotated cloud");
        assert_eq!(original.stamp_ns(), annotated.stamp_ns());
        assert_eq!(original.point_count(), annotated.point_count());
        for (from, to) in original.points().zip(annotated.points()) {
            assert_eq!(from, &to[..from.len()]);
        }
        let instance = annotated.column_u32("instance").expect("instance");
        let reason = annotated.column_u32("reason").expect("reason");
        assert!(instance.iter().zip(&reason).all(|(&i, &r)| (i != 0) == (r == 0)));
        assert!(instance.iter().any(|&i| i > 5));
        for name in ["component", "semantic", "rgb", "colors"] {
            assert!(annotated.field(name).is_some_and(|field| field.count == 1), "{name}");
        }
    }
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let (_folder, input) = drive(2);
    let mut again = options(Semantics::Ground);
    let (output, _) = run(&input, &again).expect("annotated");
    let first = std::fs::read(&output).expect("bytes");
    again.force = true;
    run(&input, &again).expect("annotated");
    assert!(first == std::fs::read(&output).expect("bytes"));
}

#[test]
fn how_it_was_made_is_recorded() {
    let (_folder, input) = drive(1);
    let (output, report) = run(&input, &options(Semantics::Ground)).expect("annotated");
    let made = records(&output).into_iter().find_map(|record| match record {
        Record::Metadata(metadata) if metadata.name == "divmerge" => Some(metadata.metadata),
        _ => None,
    });
    let made = made.expect("a metadata record");
    assert_eq!(Some(&made["input_sha256"]), report.input_sha256.as_ref());
    assert!(!made.contains_key("input_read") && !made.contains_key("from_ns"));
    assert_eq!(made["version"], env!("CARGO_PKG_VERSION"));
    assert!(made["parameters"].contains("\"voxel\":0.5"));
    assert!(made[&format!("topic {CLOUD_TOPIC}")].contains("\"ground\":"));
}

#[test]
fn an_output_is_not_replaced_unasked_and_the_input_never() {
    let (_folder, input) = drive(1);
    let before = std::fs::read(&input).expect("bytes");
    let mut options = options(Semantics::Auto);
    let (output, _) = run(&input, &options).expect("annotated");
    std::fs::write(&output, b"mine").expect("written");
    assert!(run(&input, &options).is_err());
    assert_eq!(std::fs::read(&output).expect("bytes"), b"mine");
    options.force = true;
    let itself = annotate(&input, &input, &options, &mut |_: Event| ControlFlow::Continue(()));
    assert!(itself.is_err(), "the input must not be its own output");
    assert!(before == std::fs::read(&input).expect("bytes"));
}

#[test]
fn an_interrupted_run_leaves_nothing() {
    let (folder, input) = drive(3);
    let output = folder.path().join("out.mcap");
    let broken =
        annotate(
            &input,
            &output,
            &options(Semantics::Auto),
            &mut |_: Event| ControlFlow::Break(()),
        );
    assert!(broken.expect_err("interrupted").to_string().contains("interrupted"));
    assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 1);
}

#[test]
fn an_annotated_recording_is_not_annotated_twice() {
    let (_folder, input) = drive(1);
    let (output, _) = run(&input, &options(Semantics::Auto)).expect("annotated");
    let error = run(&output, &options(Semantics::Auto)).expect_err("twice").to_string();
    assert!(error.contains("/lidar/points/instances"), "{error}");
}

#[test]
fn a_window_keeps_its_messages_and_every_channel() {
    let (_folder, input) = drive(4);
    let start = Overview::read(&input).expect("a recording").start_ns.expect("messages");
    let mut options = options(Semantics::Auto);
    options.from_ns = Some(start + 100_000_000);
    options.to_ns = Some(start + 300_000_000);
    let (output, report) = run(&input, &options).expect("annotated");
    assert_eq!(report.topics[CLOUD_TOPIC].frames, 2);
    assert_eq!(report.messages, 4);
    let overview = Overview::read(&output).expect("a recording");
    assert_eq!(overview.start_ns, options.from_ns);
    assert!(overview.channels_of("/tf").next().is_some());
}

#[test]
fn a_window_costs_its_own_length() {
    let (_folder, input) = drive(60);
    let size = std::fs::metadata(&input).expect("the drive").len();
    let start = Overview::read(&input).expect("a recording").start_ns.expect("messages");
    let mut options = options(Semantics::Auto);
    (options.from_ns, options.to_ns) = (Some(start + 3_000_000_000), Some(start + 3_500_000_000));
    let (output, report) = run(&input, &options).expect("annotated");
    assert_eq!(report.topics[CLOUD_TOPIC].frames, 5);
    assert!(report.warnings.is_empty() && report.input_sha256.is_none(), "{report:?}");
    // Chunks hold thirteen of the sixty clouds each.
    assert!(report.input_bytes_read < size * 2 / 5, "{} of {size}", report.input_bytes_read);
    let made = records(&output).into_iter().find_map(|record| match record {
        Record::Metadata(metadata) if metadata.name == "divmerge" => Some(metadata.metadata),
        _ => None,
    });
    let made = made.expect("a metadata record");
    assert!(made["input_read"].contains(&format!("of {size} bytes")) && made.contains_key("to_ns"));
    assert!(!made.contains_key("input_sha256"));

    // The same without an index: everything is read, and the same messages come out.
    let whole = std::fs::read(&input).expect("bytes");
    let bare = input.with_file_name("bare.mcap");
    std::fs::write(&bare, &whole[..whole.len() - 8]).expect("written");
    let (read_through, through) = run(&bare, &options).expect("annotated");
    assert_eq!(through.input_bytes_read, size - 8);
    assert!(messages(&output) == messages(&read_through));
}

#[test]
fn frames_are_numbered_whatever_is_passed_over() {
    let (_folder, input) = drive(60);
    let start = Overview::read(&input).expect("a recording").start_ns.expect("messages");
    let mut options = options(Semantics::Auto);
    (options.from_ns, options.to_ns) = (Some(start + 4_000_000_000), Some(start + 4_200_000_000));
    let (output, mut numbers) = (input.with_file_name("out.mcap"), Vec::new());
    annotate(&input, &output, &options, &mut |event: Event| {
        if let Event::Frame(frame) = event {
            numbers.push(frame.number);
        }
        ControlFlow::Continue(())
    })
    .expect("annotated");
    assert_eq!(numbers, [40, 41]);
}

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
    let cloud = &mut frame.cloud;
    (cloud.height, cloud.width) = (1, count);
    cloud.x = points.iter().map(|p| p[0]).collect();
    cloud.y = points.iter().map(|p| p[1]).collect();
    cloud.z = points.iter().map(|p| p[2]).collect();
    for column in [&mut cloud.ring, &mut cloud.class] {
        *column = Some(vec![0; count]);
    }
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
    assert_eq!(report.warnings.len(), 3);
    assert!(report.warnings.iter().all(|w| w.contains("/points") && w.contains("byte")));
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
        frame.cloud = divmerge::PointCloud { height, width, ..divmerge::PointCloud::default() };
        let mut message = Vec::new();
        cloud_message(&frame, &mut message).expect("a message");
        message
    };
    let (_folder, input) = recording_of(&[empty(4, 0), empty(0, 4), empty(0, 0)]);
    for semantics in [Semantics::All, Semantics::Ground, Semantics::Auto] {
        for config in [Config::paper(), Config::authors(), Config::best()] {
            let mut options = options(semantics.clone());
            options.method.config = config;
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
    let (_, report) = run(&input, &options).expect("passed through");
    assert_eq!(report.topics[CLOUD_TOPIC].unreadable, 1);
    assert!(report.warnings[0].contains("klass") && report.warnings[0].contains("label"));
    options.topics = vec!["/nothing".into()];
    options.force = true;
    let error = run(&input, &options).expect_err("no such topic").to_string();
    assert!(error.contains("/nothing") && error.contains(CLOUD_TOPIC), "{error}");
}

#[test]
fn real_recordings_of_every_sensor() {
    let Some(data) = shared_data() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    for name in [
        "semantickitti_04_ros2",
        "sensors_ros2",
        "pointcloud2_32ring_unaligned",
        "xyz_ros2",
        "ouster_os1-64_ros1",
    ] {
        let input = data.join("recordings").join(name).with_extension("mcap");
        for semantics in [Semantics::Auto, Semantics::Ground] {
            let output = folder.path().join("out.mcap");
            let mut options = options(semantics);
            options.force = true;
            let report =
                annotate(&input, &output, &options, &mut |_: Event| ControlFlow::Continue(()))
                    .expect(name);
            assert!(report.is_complete(), "{name}: {:?}", report.warnings);
            assert!(report.topics.values().all(|topic| topic.instances > 0), "{name}");
            assert_passed_through(&input, &output);
        }
    }
}
