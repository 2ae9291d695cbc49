//! The main job through the library: what the output holds, and what becomes of strange inputs.

mod broken;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use divmerge::Result;
use divmerge::annotate::{
    AnnotateConfig, AnnotateOptions, AnnotationReport, RunEvent, Semantics, annotate,
};
use divmerge::datasets::drive::{CLOUD_TOPIC, write_drive};
use divmerge::messages::clouds::CloudFormat;
use divmerge::recording::{MessageHeader, Overview, Record, RecordingReader, WriteOptions};
use divmerge::simulate::{Drive, Scene, Sensor};
use tempfile::TempDir;

use crate::shared_data::shared_data;

fn options(semantics: Semantics) -> AnnotateOptions {
    AnnotateOptions {
        config: AnnotateConfig { semantics, ..AnnotateConfig::default() },
        ..AnnotateOptions::default()
    }
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

/// Annotates a recording; the output stands beside it.
pub fn run(input: &Path, options: &AnnotateOptions) -> Result<(PathBuf, AnnotationReport)> {
    let output = input.with_extension("annotated.mcap");
    let report = annotate(input, &output, options, &mut |_: RunEvent| ControlFlow::Continue(()))?;
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
    let itself = annotate(&input, &input, &options, &mut |_: RunEvent| ControlFlow::Continue(()));
    assert!(itself.is_err(), "the input must not be its own output");
    assert!(before == std::fs::read(&input).expect("bytes"));
}

#[test]
fn an_interrupted_run_leaves_nothing() {
    let (folder, input) = drive(3);
    let output = folder.path().join("out.mcap");
    let broken = annotate(&input, &output, &options(Semantics::Auto), &mut |_: RunEvent| {
        ControlFlow::Break(())
    });
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
    annotate(&input, &output, &options, &mut |event: RunEvent| {
        if let RunEvent::Frame(frame) = event {
            numbers.push(frame.key.number);
        }
        ControlFlow::Continue(())
    })
    .expect("annotated");
    assert_eq!(numbers, [40, 41]);
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
                annotate(&input, &output, &options, &mut |_: RunEvent| ControlFlow::Continue(()))
                    .expect(name);
            assert!(report.is_complete(), "{name}: {:?}", report.warnings);
            assert!(report.topics.values().all(|topic| topic.instances > 0), "{name}");
            assert_passed_through(&input, &output);
        }
    }
}
