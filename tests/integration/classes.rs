//! Classes that someone else found: in files and on topics, through whole recordings.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use divmerge::annotate::{AnnotateConfig, AnnotateOptions, AnnotationReport, Semantics};
use divmerge::datasets::drive::{CLOUD_TOPIC, SENSOR_FRAME};
use divmerge::datasets::semantic_kitti::write_labels;
use divmerge::frames::{
    ClassSource, CloudKey, EncodedCloud, EncodedClouds, FrameClasses, TOLERANCE_NS,
};
use divmerge::messages::clouds::{CloudFormat, CloudMessage, Datatype, PointField};
use divmerge::recording::{
    MessageHeader, Overview, Record, RecordingReader, RecordingWriter, WriteOptions,
};
use divmerge::{Result, Taxonomy};

use crate::cli::{divmerge, path, text};
use crate::recordings::{self, drive};

const PREDICTIONS: &str = "/predictions";

/// Classes and stamps of the clouds of a recording, in its order.
fn truth(recording: &Path) -> Vec<(Vec<u32>, i64)> {
    let messages = EncodedClouds::open(recording, Some(CLOUD_TOPIC), 0..=u64::MAX).unwrap();
    let of = |message: Result<EncodedCloud>| {
        let message = message.unwrap();
        let cloud = message.decode().unwrap();
        (cloud.column_u32("label").unwrap(), cloud.stamp_ns())
    };
    messages.map(of).collect()
}

/// A cloud of classes alone.
fn prediction(classes: &[u32], stamp_ns: i64, frame_id: &str) -> Vec<u8> {
    let data: Vec<u8> = classes.iter().flat_map(|&class| (class as u16).to_le_bytes()).collect();
    let field =
        PointField { name: "label".into(), offset: 0, datatype: Datatype::UInt16, count: 1 };
    let cloud = CloudMessage {
        stamp_sec: stamp_ns.div_euclid(1_000_000_000),
        stamp_nanosec: stamp_ns.rem_euclid(1_000_000_000) as u32,
        frame_id: frame_id.into(),
        height: 1,
        width: classes.len() as u32,
        fields: vec![field],
        point_step: 2,
        row_step: 2 * classes.len() as u32,
        data: Cow::Borrowed(&data),
        ..CloudMessage::default()
    };
    let mut out = Vec::new();
    cloud.encode(&mut out).unwrap();
    out
}

/// The recording with predictions `behind` nanoseconds after the stamps of the clouds; `change` may
/// spoil them.
fn with_predictions(
    input: &Path,
    behind: i64,
    frame_id: &str,
    change: impl Fn(usize, Vec<u32>) -> Option<Vec<u32>>,
) -> PathBuf {
    let output = input.with_file_name("predicted.mcap");
    let options = WriteOptions { force: true, profile: "ros2".into(), ..WriteOptions::default() };
    let mut writer = RecordingWriter::create(&output, &options).unwrap();
    let overview = Overview::read(input).unwrap();
    writer.reserve(&overview);
    let mut reader = RecordingReader::open(input).unwrap();
    while let Some(record) = reader.next_record().unwrap() {
        match &record {
            Record::Message { header, data, .. } => writer.write_message(header, data).unwrap(),
            other => writer.copy(other).unwrap(),
        }
    }
    let schema = CloudFormat::Ros2.schema().add_to(&mut writer).unwrap();
    let channel_id = writer.add_channel(PREDICTIONS, schema, "cdr", &Default::default()).unwrap();
    for (number, (classes, stamp)) in truth(input).into_iter().enumerate() {
        let Some(classes) = change(number, classes) else { continue };
        let log_time = stamp as u64 + 500_000_000;
        let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
        let message = prediction(&classes, stamp + behind, frame_id);
        writer.write_message(&header, &message).unwrap();
    }
    writer.finish().unwrap();
    output
}

fn run(
    input: &Path,
    source: Option<ClassSource>,
    threads: usize,
) -> Result<(PathBuf, AnnotationReport)> {
    let taxonomy = Taxonomy::semantic_kitti();
    let semantics = match source {
        None => Semantics::Field("label".into()),
        Some(source) => {
            Semantics::Given(Arc::new(FrameClasses::open(&source, input, &taxonomy, TOLERANCE_NS)?))
        }
    };
    let config = AnnotateConfig { semantics, ..AnnotateConfig::default() };
    recordings::run(
        input,
        &AnnotateOptions { config, threads, force: true, ..AnnotateOptions::default() },
    )
}

/// What was found of each point. Whether the ground was looked for besides is another matter.
fn instances(annotated: &Path) -> Vec<[Vec<u32>; 4]> {
    let topic = format!("{CLOUD_TOPIC}/instances");
    let messages = EncodedClouds::open(annotated, Some(&topic), 0..=u64::MAX).unwrap();
    let columns = |message: EncodedCloud| {
        let cloud = message.decode().unwrap();
        let names = ["instance", "track", "semantic", "reason"];
        names.map(|name| cloud.column_u32(name).unwrap())
    };
    messages.map(|message| columns(message.unwrap())).collect()
}

fn of_topic() -> Option<ClassSource> {
    Some(ClassSource::Topic(PREDICTIONS.into()))
}

#[test]
fn classes_of_a_topic_and_of_files_are_those_of_the_field() {
    let (folder, input) = drive(4);
    let expected = instances(&run(&input, None, 1).unwrap().0);
    for threads in [1, 3] {
        let predicted =
            with_predictions(&input, 3_000_000, SENSOR_FRAME, |_, classes| Some(classes));
        let (output, report) = run(&predicted, of_topic(), threads).unwrap();
        assert!(instances(&output) == expected);
        assert_eq!(report.topics.len(), 1, "the predictions are no clouds to be annotated");
        let semantics = &report.topics[CLOUD_TOPIC].semantics;
        assert_eq!(semantics.get("topic:/predictions"), Some(&4));
    }
    let (by_number, by_stamp) = (folder.path().join("number"), folder.path().join("stamp"));
    for folder in [&by_number, &by_stamp] {
        std::fs::create_dir(folder).unwrap();
    }
    for (number, (classes, stamp)) in truth(&input).into_iter().enumerate() {
        write_labels(&by_number.join(format!("{number:06}.label")), &classes).unwrap();
        write_labels(&by_stamp.join(format!("{}.label", stamp - 1_000_000)), &classes).unwrap();
    }
    for folder in [by_number, by_stamp] {
        let (output, report) = run(&input, Some(ClassSource::Files(folder)), 2).unwrap();
        assert!(instances(&output) == expected);
        assert_eq!(report.topics[CLOUD_TOPIC].semantics.get("labels"), Some(&4));
    }
}

#[test]
fn clouds_without_classes_pass_through_and_are_counted() {
    let (_folder, input) = drive(3);
    let gap = |number, classes| (number != 1).then_some(classes);
    let predicted = with_predictions(&input, 0, SENSOR_FRAME, gap);
    let (output, report) = run(&predicted, of_topic(), 2).unwrap();
    assert_eq!((report.topics[CLOUD_TOPIC].frames, report.topics[CLOUD_TOPIC].unreadable), (2, 1));
    assert!(!report.is_complete() && instances(&output).len() == 2);
    assert!(report.warnings[0].contains("no classes for cloud 1"), "{:?}", report.warnings);
    assert!(report.warnings[0].contains("0.100000000 s away"), "{:?}", report.warnings);
    for (behind, frame_id, problem) in [
        (20_000_000, SENSOR_FRAME, "0.020000000 s away"),
        (0, "base_link", "its messages are in frame `base_link`, the cloud in `lidar`"),
    ] {
        let predicted = with_predictions(&input, behind, frame_id, |_, classes| Some(classes));
        let (_, report) = run(&predicted, of_topic(), 2).unwrap();
        assert_eq!(report.topics[CLOUD_TOPIC].unreadable, 3);
        assert!(report.warnings[0].contains(problem), "{:?}", report.warnings);
    }
}

#[test]
fn counts_that_differ_end_the_run_with_both_of_them() {
    let (folder, input) = drive(2);
    let shorter = |number: usize, mut classes: Vec<u32>| {
        classes.truncate(classes.len() - number);
        Some(classes)
    };
    let points = truth(&input)[1].0.len();
    let predicted = with_predictions(&input, 0, SENSOR_FRAME, shorter);
    let output = folder.path().join("out.mcap");
    let arguments = ["annotate", path(&predicted), "-o", path(&output), "--topic", CLOUD_TOPIC];
    let failed = divmerge(&[&arguments[..], &["--semantics", "topic:/predictions"]].concat());
    let said = text(&failed.stderr);
    assert_eq!(failed.status.code(), Some(1), "{said}");
    assert!(
        said.contains(&format!("{} points", points - 1)) && said.contains(&points.to_string()),
        "{said}"
    );
    assert!(said.contains("cloud 1") && !output.exists(), "{said}");
    let unknown = divmerge(&[&arguments[..], &["--semantics", "topic:/nowhere"]].concat());
    let said = text(&unknown.stderr);
    assert!(said.contains("no such topic") && said.contains(PREDICTIONS), "{said}");
    let other = divmerge(&[&arguments[..], &["--semantics", "topic:/tf"]].concat());
    assert!(text(&other.stderr).contains("classes are read from clouds and from images"));
    let files = divmerge(
        &[&arguments[..], &["--semantics", &format!("labels:{}", path(folder.path()))]].concat(),
    );
    assert!(text(&files.stderr).contains("000012.label"), "{}", text(&files.stderr));
}

#[test]
fn a_single_frame_finds_its_classes_wherever_it_is() {
    let (_folder, input) = drive(40);
    let predicted = with_predictions(&input, 0, SENSOR_FRAME, |_, classes| Some(classes));
    let classes =
        FrameClasses::open(&of_topic().unwrap(), &predicted, &Taxonomy::semantic_kitti(), 0)
            .unwrap();
    let clouds = truth(&input);
    // Forward, far back and forward again.
    for number in (0..40).chain([0, 39, 20, 3]) {
        let (expected, stamp_ns) = &clouds[number];
        let (topic, number) = (CLOUD_TOPIC, number as u64);
        let key = CloudKey { topic, number, stamp_ns: *stamp_ns, frame_id: SENSOR_FRAME };
        let found = classes.of(&key, [1, expected.len()]).unwrap();
        assert!(found.class.iter().map(|&class| u32::from(class)).eq(expected.iter().copied()));
    }
}
