//! Clouds of every format through the main job: each annotated as it came, all with the same
//! labels.

mod mixed;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use divmerge::annotate::{AnnotateConfig, AnnotateOptions, Flavor, MessageTypes, Semantics};
use divmerge::datasets::drive::{CLOUD_TOPIC, cloud_message, cloud_message_in, write_drive_in};
use divmerge::frames::{EncodedCloud, EncodedClouds};
use divmerge::messages::clouds::{CloudFormat, CloudMessage, CloudPose};
use divmerge::recording::{Channel, MessageHeader, Overview, RecordingWriter, WriteOptions};
use divmerge::simulate::{Drive, Scene, Sensor};
use tempfile::TempDir;

use crate::cli::{divmerge, path as text_of, text};
use crate::recordings::{assert_passed_through, run};

fn vlp16() -> Drive {
    Drive::new(Sensor::Vlp16, Scene::Parking, 1)
}

/// A drive of two frames in a format.
fn drive(format: CloudFormat) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("drive.mcap");
    let options = WriteOptions::default();
    write_drive_in(&vlp16(), (format, 2), &path, &options, |_| ControlFlow::Continue(()))
        .expect("written");
    (folder, path)
}

fn with(flavor: Flavor) -> AnnotateOptions {
    let config = AnnotateConfig { semantics: Semantics::All, ..AnnotateConfig::default() };
    let types = MessageTypes { flavor, ..MessageTypes::default() };
    AnnotateOptions { config, types, force: true, ..AnnotateOptions::default() }
}

fn messages(path: &Path, topic: &str) -> Vec<EncodedCloud> {
    let messages = EncodedClouds::open(path, Some(topic), 0..=u64::MAX).expect("a cloud topic");
    messages.map(|message| message.expect("readable")).collect()
}

fn channel<'a>(overview: &'a Overview, topic: &str) -> &'a Channel {
    overview.channels_of(topic).next().expect("the topic")
}

/// Instance, component, class and reason of every point.
fn labels(cloud: &CloudMessage) -> [Vec<u32>; 4] {
    ["instance", "component", "semantic", "reason"].map(|name| cloud.column_u32(name).expect(name))
}

/// A recording of some profile with topics of messages in formats, the messages of all by turns.
fn recording(profile: &str, topics: &[(&str, CloudFormat, Vec<Vec<u8>>)]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("made.mcap");
    let options = WriteOptions { profile: profile.into(), ..WriteOptions::default() };
    let mut writer = RecordingWriter::create(&path, &options).expect("a writer");
    let mut add = |topic: &str, format: CloudFormat| {
        let schema = format.schema();
        let id = writer.add_schema(schema.name, schema.encoding, &schema.data).expect("schema");
        let encoding = format.message_encoding();
        writer.add_channel(topic, id, encoding, &BTreeMap::new()).expect("channel")
    };
    let channels: Vec<u16> = topics.iter().map(|(topic, format, _)| add(topic, *format)).collect();
    let most = topics.iter().map(|(.., messages)| messages.len()).max().unwrap_or(0);
    for number in 0..most {
        for (&channel_id, (.., messages)) in channels.iter().zip(topics) {
            let Some(message) = messages.get(number) else { continue };
            let (sequence, time) = (number as u32, number as u64);
            let header = MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
            writer.write_message(&header, message).expect("message");
        }
    }
    writer.finish().expect("finished");
    (folder, path)
}

fn encoded(cloud: &CloudMessage) -> Vec<u8> {
    let mut message = Vec::new();
    cloud.encode(&mut message).expect("sizes that agree");
    message
}

fn simulated(format: CloudFormat, frame: usize) -> Vec<u8> {
    let mut message = Vec::new();
    cloud_message_in(format, &vlp16().frame(frame), &mut message).expect("a message");
    message
}

#[test]
fn every_format_is_annotated_in_itself_with_the_same_labels() {
    let mut first: Option<Vec<[Vec<u32>; 4]>> = None;
    for format in CloudFormat::ALL {
        let (_folder, input) = drive(format);
        let (output, report) = run(&input, &AnnotateOptions::default()).expect("annotated");
        assert!(report.is_complete() && report.warnings.is_empty(), "{:?}", report.warnings);
        assert_passed_through(&input, &output);
        let overview = Overview::read(&output).expect("a recording");
        let added = format!("{CLOUD_TOPIC}/instances");
        let (cloud, instances) = (channel(&overview, CLOUD_TOPIC), channel(&overview, &added));
        assert_eq!(cloud.schema_id, instances.schema_id);
        assert_eq!(cloud.message_encoding, instances.message_encoding);
        assert_eq!(overview.message_counts[&instances.id], 2);
        check_metadata(format, cloud, instances);
        let clouds = messages(&output, CLOUD_TOPIC);
        let annotated = messages(&output, &added);
        let found: Vec<_> =
            clouds.iter().zip(&annotated).map(|(a, b)| check_points(format, a, b)).collect();
        assert_eq!(*first.get_or_insert(found.clone()), found, "{format:?}");
    }
}

fn check_metadata(format: CloudFormat, cloud: &Channel, instances: &Channel) {
    let of = |channel: &Channel, key: &str| channel.metadata.get(key).cloned();
    match format.profile() {
        "ros2" => assert!(of(instances, "offered_qos_profiles").is_some()),
        "ros1" => {
            assert_eq!(of(instances, "md5sum"), of(cloud, "md5sum"));
            assert_eq!(of(instances, "topic").as_ref(), Some(&instances.topic));
            assert_eq!(of(instances, "offered_qos_profiles"), None);
        }
        _ => assert!(instances.metadata.is_empty()),
    }
}

/// The labels of an annotated cloud, which has every byte of the other and the colours of its kind.
fn check_points(
    format: CloudFormat,
    cloud: &EncodedCloud,
    annotated: &EncodedCloud,
) -> [Vec<u32>; 4] {
    assert_eq!((cloud.log_time_ns(), cloud.format), (annotated.log_time_ns(), format));
    let (cloud, annotated) =
        (cloud.decode().expect("a cloud"), annotated.decode().expect("a cloud"));
    assert_eq!((annotated.format, annotated.stamp_ns()), (format, cloud.stamp_ns()));
    assert_eq!((&annotated.frame_id, annotated.pose), (&cloud.frame_id, cloud.pose));
    assert_eq!(annotated.point_count(), cloud.point_count());
    assert!(cloud.points().zip(annotated.points()).all(|(from, to)| to.starts_with(from)));
    assert_eq!(annotated.fields[..cloud.fields.len()], cloud.fields);
    let names: Vec<&str> = annotated.fields.iter().map(|field| field.name.as_str()).collect();
    match format.is_foxglove() {
        true => assert!(names.ends_with(&["red", "green", "blue", "alpha", "track"]), "{names:?}"),
        false => assert!(names.ends_with(&["rgb", "colors", "track"]), "{names:?}"),
    }
    let labels = labels(&annotated);
    check_colours(&annotated, &labels);
    assert!(labels[0].iter().any(|&instance| instance > 5));
    labels
}

fn check_colours(annotated: &CloudMessage, [instances, .., reasons]: &[Vec<u32>; 4]) {
    let column = |name: &str| annotated.column_u32(name).expect(name);
    let colours: Vec<u32> = match annotated.format.is_foxglove() {
        false => column("colors"),
        true => {
            let [red, green, blue, alpha] = ["red", "green", "blue", "alpha"].map(column);
            let bytes = red.iter().zip(green).zip(blue).zip(alpha);
            bytes.map(|(((r, g), b), a)| r << 24 | g << 16 | b << 8 | a).collect()
        }
    };
    // Where objects are followed, the track gives the colour.
    let tracks = annotated.column_u32("track").unwrap_or_else(|_| instances.clone());
    for ((&track, &reason), colour) in tracks.iter().zip(reasons).zip(colours) {
        let [red, green, blue] = match track {
            0 => divmerge::messages::palette::reason_colour(reason as u8),
            id => divmerge::messages::palette::instance_colour(id),
        };
        assert_eq!(colour.to_be_bytes(), [red, green, blue, 0xff]);
    }
}

#[test]
fn objects_go_with_their_clouds() {
    for (format, expected) in [
        (CloudFormat::Ros2, ("visualization_msgs/msg/MarkerArray", "cdr")),
        (CloudFormat::Ros1, ("visualization_msgs/MarkerArray", "ros1")),
        (CloudFormat::FoxgloveRos2, ("visualization_msgs/msg/MarkerArray", "cdr")),
        (CloudFormat::FoxgloveProtobuf, ("foxglove.SceneUpdate", "protobuf")),
        (CloudFormat::FoxgloveJson, ("foxglove.SceneUpdate", "json")),
    ] {
        let (_folder, input) = drive(format);
        let (output, report) = run(&input, &AnnotateOptions::default()).expect("annotated");
        let overview = Overview::read(&output).expect("a recording");
        let objects = channel(&overview, &format!("{CLOUD_TOPIC}/objects"));
        let schema = overview.schema_of(objects.id).expect("a schema");
        assert_eq!((schema.name.as_str(), objects.message_encoding.as_str()), expected);
        assert_eq!(objects.metadata.contains_key("md5sum"), format == CloudFormat::Ros1);
        assert_eq!(report.annotations, 4);
        // Its instances are no clouds to annotate.
        let again = run(&output, &with(Flavor::Auto)).expect_err("annotated before").to_string();
        assert!(again.contains("already has a topic"), "{again}");
        let topics = divmerge::frames::annotated_topics(&overview).into_iter();
        assert_eq!(topics.collect::<Vec<_>>(), [format!("{CLOUD_TOPIC}/instances")]);
    }
}

#[test]
fn the_pose_of_points_stays_with_them() {
    let pose = CloudPose { position: [1.0, 2.0, 3.0], orientation: [0.0, 0.6, 0.0, 0.8] };
    for format in CloudFormat::ALL.into_iter().filter(|format| format.is_foxglove()) {
        let message = simulated(format, 0);
        let mut cloud = format.decode(&message).expect("a cloud");
        let still = recording("", &[("/points", format, vec![encoded(&cloud)])]);
        cloud.pose = Some(pose);
        let moved = recording("", &[("/points", format, vec![encoded(&cloud)])]);
        let [still, moved] = [still, moved].map(|(_folder, input)| {
            let (output, _) = run(&input, &with(Flavor::Auto)).expect("annotated");
            messages(&output, "/points/instances").remove(0)
        });
        let (still, moved) = (still.decode().expect("a cloud"), moved.decode().expect("a cloud"));
        assert_eq!(moved.pose, Some(pose));
        assert_eq!(labels(&moved), labels(&still));
    }
}

#[test]
fn the_language_of_a_definition_does_not_matter() {
    let folder = tempfile::tempdir().expect("a folder");
    for (language, definition) in [("ros2idl", "module sensor_msgs {};"), ("", ""), ("omgidl", "x")]
    {
        let input = folder.path().join("made.mcap");
        let options =
            WriteOptions { profile: "ros2".into(), force: true, ..WriteOptions::default() };
        let mut writer = RecordingWriter::create(&input, &options).expect("a writer");
        let (name, data) = (CloudFormat::Ros2.type_name(), definition.as_bytes());
        let schema = writer.add_schema(name, language, data).expect("schema");
        let none = BTreeMap::new();
        let channel_id = writer.add_channel("/points", schema, "cdr", &none).expect("channel");
        let header = MessageHeader { channel_id, sequence: 0, log_time: 1, publish_time: 1 };
        let mut message = Vec::new();
        cloud_message(&vlp16().frame(0), &mut message).expect("a message");
        writer.write_message(&header, &message).expect("message");
        writer.finish().expect("finished");
        let (_, report) = run(&input, &with(Flavor::Auto)).expect("annotated");
        assert_eq!(report.topics["/points"].frames, 1, "{language}");
    }
}

#[test]
fn what_cannot_be_read_says_why() {
    let folder = tempfile::tempdir().expect("a folder");
    let input = folder.path().join("made.mcap");
    let options = WriteOptions { profile: "ros1".into(), ..WriteOptions::default() };
    let mut writer = RecordingWriter::create(&input, &options).expect("a writer");
    for (topic, name, encoding) in [
        ("/old", "sensor_msgs/PointCloud", "ros1"),
        ("/scan", "sensor_msgs/LaserScan", "ros1"),
        ("/packets", "velodyne_msgs/VelodyneScan", "ros1"),
        ("/small", "foxglove.CompressedPointCloud", "protobuf"),
    ] {
        let schema = writer.add_schema(name, "ros1msg", b"x").expect("schema");
        writer.add_channel(topic, schema, encoding, &BTreeMap::new()).expect("channel");
    }
    writer.finish().expect("finished");
    let error = run(&input, &with(Flavor::Auto)).expect_err("no cloud").to_string();
    for word in ["/old", "point_cloud_converter", "one plane", "driver", "point_cloud_transport"] {
        assert!(error.contains(word), "{error}");
    }
    let shown = divmerge(&["info", text_of(&input)]);
    let shown = text(&shown.stdout);
    assert!(shown.contains("not read: VelodyneScan holds a sensor's raw packets"), "{shown}");
}

#[test]
fn the_commands_work_on_every_encoding() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| text_of(&folder.path().join(name)).to_owned();
    let mut scores = Vec::new();
    for encoding in ["ros2", "ros1", "foxglove-ros2", "foxglove-protobuf", "foxglove-json"] {
        let (input, output) = (at("in.mcap"), at("out.mcap"));
        let simulate = ["--sensor", "vlp-16", "--scene", "parking", "--frames", "2", "--force"];
        let start = ["simulate", "--encoding", encoding, "-o", &input];
        let run = |arguments: &[&str]| {
            let done = divmerge(arguments);
            assert_eq!(done.status.code(), Some(0), "{encoding}: {}", text(&done.stderr));
            text(&done.stdout)
        };
        run(&[&start[..], &simulate].concat());
        run(&["annotate", &input, "-o", &output, "--force"]);
        let info = run(&["info", &input]);
        assert!(info.contains("all round") && !info.contains("not read"), "{info}");
        scores.push(run(&["evaluate", &output]));
        run(&["explain", &input, "--frame", "0", "--instance", "1", "--instance", "2"]);
        run(&["figure", &input, "--frame", "0", "-o", &at("x.png"), "--force"]);
        let differences = run(&["diff", &output, &output]);
        assert!(differences.contains("0 differences"), "{differences}");
        run(&["export", &output, "--labels", &at("labels"), "--force"]);
        let suspicion = at("suspicion.mcap");
        let triage = divmerge(&["triage", &input, "-o", &suspicion, "--force"]);
        let is_ros = !matches!(encoding, "foxglove-protobuf" | "foxglove-json");
        let code = if is_ros { 0 } else { 1 };
        assert_eq!(triage.status.code(), Some(code), "{encoding}: {}", text(&triage.stderr));
    }
    assert!(scores[0].contains("PQ"));
    assert!(scores.iter().all(|score| *score == scores[0]), "{scores:#?}");
}
