//! Clouds of Livox's own messages, and sweeps that come in parts.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use divmerge::annotate::{AnnotateConfig, AnnotateOptions, Semantics};
use divmerge::datasets::drive::cloud_message;
use divmerge::frames::Assemble;
use divmerge::messages::clouds::{CloudFormat, CloudMessage};
use divmerge::messages::ros::{ByteOrder, Layout, RosWriter};
use divmerge::recording::{MessageHeader, RecordingWriter, WriteOptions};
use divmerge::simulate::{Drive, Scene, Sensor, SimulatedFrame};
use tempfile::TempDir;

use crate::cli::{divmerge, path as text_of, text};
use crate::recordings::{messages, run};

/// A recording of messages of a type on `/points`, with stamps as log times.
pub fn recording(
    type_name: &str,
    encoding: &str,
    of_stamps: &[(u64, Vec<u8>)],
) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("made.mcap");
    let mut writer = RecordingWriter::create(&path, &WriteOptions::default()).expect("a writer");
    let schema = writer.add_schema(type_name, "ros2msg", b"").expect("schema");
    let channel_id =
        writer.add_channel("/points", schema, encoding, &BTreeMap::new()).expect("channel");
    for (number, (stamp, message)) in (0_u32..).zip(of_stamps) {
        let (log_time, publish_time) = (*stamp, *stamp);
        let header = MessageHeader { channel_id, sequence: number, log_time, publish_time };
        writer.write_message(&header, message).expect("message");
    }
    writer.finish().expect("finished");
    (folder, path)
}

fn options(semantics: Semantics, assemble: Option<Assemble>) -> AnnotateOptions {
    let config = AnnotateConfig { semantics, assemble, ..AnnotateConfig::default() };
    AnnotateOptions { config, force: true, ..AnnotateOptions::default() }
}

/// Messages of a topic that was added to `/points`.
fn added(path: &Path, end: &str) -> Vec<(u64, Vec<u8>)> {
    let overview = divmerge::recording::Overview::read(path).expect("a recording");
    let id = overview.channels_of(&format!("/points{end}")).next().expect("the topic").id;
    let of_topic = messages(path).into_iter().filter(|(header, _)| header.channel_id == id);
    of_topic.map(|(header, data)| (header.log_time, data)).collect()
}

/// Instances, tracks and reasons of the points of the annotated clouds, message by message.
fn labels(path: &Path) -> Vec<[Vec<u32>; 3]> {
    let of = |(_, data): &(u64, Vec<u8>)| {
        let cloud = CloudFormat::Ros2.decode(data).expect("a cloud");
        ["instance", "track", "reason"].map(|name| cloud.column_u32(name).expect(name))
    };
    added(path, "/instances").iter().map(of).collect()
}

/// The frame as Livox's driver writes it.
fn custom_message(frame: &SimulatedFrame, layout: Layout) -> Vec<u8> {
    let cloud = &frame.cloud;
    let mut bytes = Vec::new();
    let mut writer = RosWriter::new(layout, &mut bytes);
    let (sec, nanosec) = (frame.stamp_ns / 1_000_000_000, frame.stamp_ns % 1_000_000_000);
    writer.header((sec as i32, nanosec as u32, "livox_frame"));
    writer.u64(frame.stamp_ns);
    writer.u32(cloud.len() as u32);
    [192, 0, 0, 0].into_iter().for_each(|byte| writer.u8(byte));
    writer.length(cloud.len());
    for point in 0..cloud.len() {
        writer.u32(frame.time_offset_ns[point]);
        [cloud.x[point], cloud.y[point], cloud.z[point]].into_iter().for_each(|m| writer.f32(m));
        writer.u8((frame.intensity[point] * 255.0) as u8);
        writer.u8(0);
        writer.u8((point % 4) as u8);
    }
    bytes
}

#[test]
fn clouds_of_livox_are_annotated_as_point_clouds() {
    let frame = Drive::new(Sensor::Mid360, Scene::Street, 2).frame(1);
    for (type_name, encoding, format, layout) in [
        (
            "livox_ros_driver2/msg/CustomMsg",
            "cdr",
            CloudFormat::LivoxRos2,
            Layout::Cdr(ByteOrder::Little),
        ),
        ("livox_ros_driver/CustomMsg", "ros1", CloudFormat::LivoxRos1, Layout::Ros1),
    ] {
        let custom = custom_message(&frame, layout);
        let mut plain = Vec::new();
        format.decode(&custom).expect("a cloud").encode(&mut plain).expect("a message");
        let written = format.written();
        let cloud = written.decode(&plain).expect("a cloud");
        assert_eq!(cloud.point_count(), frame.cloud.len());
        assert_eq!(cloud.to_cloud(None).expect("columns").x, frame.cloud.x);

        let (_folder, livox) = recording(type_name, encoding, &[(5, custom)]);
        let (_other, points) = recording(written.type_name(), encoding, &[(5, plain)]);
        let annotate =
            |input: &Path| run(input, &options(Semantics::Ground, None)).expect("annotated");
        let ((ours, report), (theirs, _)) = (annotate(&livox), annotate(&points));
        assert!(report.is_complete() && report.topics["/points"].instances > 0);
        for end in ["/instances", "/objects"] {
            assert!(added(&ours, end) == added(&theirs, end), "{type_name} {end}");
        }
        let overview = divmerge::recording::Overview::read(&ours).expect("a recording");
        let id = overview.channels_of("/points/instances").next().expect("the topic").id;
        let schema = overview.schema_of(id).expect("a schema");
        assert_eq!(schema.name, written.type_name());
        let definition = String::from_utf8_lossy(&schema.data);
        assert!(definition.contains("PointField[] fields"), "{definition}");
    }
}

/// A cloud of some of the points of a message, at a stamp.
fn part(whole: &CloudMessage, points: Range<usize>, stamp: u64) -> Vec<u8> {
    let step = whole.point_step as usize;
    let part = CloudMessage {
        stamp_sec: (stamp / 1_000_000_000) as i64,
        stamp_nanosec: (stamp % 1_000_000_000) as u32,
        width: points.len() as u32,
        row_step: (points.len() * step) as u32,
        data: whole.data[points.start * step..points.end * step].into(),
        fields: whole.fields.clone(),
        frame_id: whole.frame_id.clone(),
        ..*whole
    };
    let mut message = Vec::new();
    part.encode(&mut message).expect("a message");
    message
}

/// Turns of a spinning sensor, as whole clouds and in so many parts of each.
pub fn turns(count: usize, parts: usize) -> [Vec<(u64, Vec<u8>)>; 2] {
    let drive = Drive::new(Sensor::Vlp16, Scene::Parking, 1);
    let (mut whole, mut in_parts) = (Vec::new(), Vec::new());
    for number in 0..count {
        let frame = drive.frame(number);
        let mut message = Vec::new();
        cloud_message(&frame, &mut message).expect("a message");
        let cloud = CloudFormat::Ros2.decode(&message).expect("a cloud");
        assert_eq!(cloud.height, 1, "shot by shot");
        let ends: Vec<usize> = (0..=parts)
            .map(|part| {
                let time = 100_000_000 / parts as u64 * part as u64;
                frame.time_offset_ns.partition_point(|&offset| u64::from(offset) < time)
            })
            .collect();
        for (at, ends) in ends.windows(2).enumerate() {
            let stamp = frame.stamp_ns + 100_000_000 / parts as u64 * at as u64;
            in_parts.push((stamp, part(&cloud, ends[0]..ends[1], stamp)));
        }
        whole
            .push((frame.stamp_ns, part(&cloud, 0..*ends.last().expect("an end"), frame.stamp_ns)));
    }
    [whole, in_parts]
}

/// The labels of parts, put together again by so many.
fn whole_again(parts: &[[Vec<u32>; 3]], by: usize) -> Vec<[Vec<u32>; 3]> {
    let join = |parts: &[[Vec<u32>; 3]]| {
        [0, 1, 2].map(|column| parts.iter().flat_map(|part| part[column].clone()).collect())
    };
    parts.chunks(by).map(join).collect()
}

#[test]
fn turns_in_parts_are_clustered_as_whole_ones() {
    for (count, how) in [
        (10, Assemble::Auto),
        (90, Assemble::Auto),
        (10, Assemble::Messages(10)),
        (10, Assemble::Span(100_000_000)),
    ] {
        let [whole, parts] = turns(3, count);
        let (_folder, whole) = recording("sensor_msgs/msg/PointCloud2", "cdr", &whole);
        let (_other, parts) = recording("sensor_msgs/msg/PointCloud2", "cdr", &parts);
        let (whole, _) = run(&whole, &options(Semantics::Auto, None)).expect("annotated");
        let (made, report) = run(&parts, &options(Semantics::Auto, Some(how))).expect("annotated");
        assert!(report.is_complete() && report.warnings.is_empty(), "{:?}", report.warnings);
        assert_eq!(report.topics["/points"].frames, 3);
        let found = labels(&made);
        assert_eq!(found.len(), 3 * count);
        assert!(whole_again(&found, count) == labels(&whole), "{count} {how}");
        // The boxes stand with the last part.
        let boxes: Vec<Vec<u8>> = added(&made, "/objects").into_iter().map(|(_, b)| b).collect();
        assert_eq!(boxes.len(), 3);

        // Each part is there with its own points, on any number of threads.
        for threads in [1, 3] {
            let options = AnnotateOptions { threads, ..options(Semantics::Auto, Some(how)) };
            let first = std::fs::read(&made).expect("bytes");
            let (again, _) = run(&parts, &options).expect("annotated");
            assert!(std::fs::read(again).expect("bytes") == first, "{threads} threads");
        }
    }
}

#[test]
fn parts_of_a_turn_are_named_where_they_are_clustered_alone() {
    let [whole, parts] = turns(2, 30);
    let warned = |of_stamps: &[(u64, Vec<u8>)]| {
        let (_folder, input) = recording("sensor_msgs/msg/PointCloud2", "cdr", of_stamps);
        run(&input, &options(Semantics::Auto, None)).expect("annotated").1.warnings
    };
    let said = warned(&parts);
    let named: Vec<_> = said.iter().filter(|line| line.contains("--assemble auto")).collect();
    assert_eq!(named.len(), 1, "{said:?}");
    assert!(named[0].contains("/points: each message holds a part of a turn"), "{said:?}");
    assert!(warned(&whole).is_empty());
}

#[test]
fn commands_that_take_single_messages_name_parts_of_a_turn_once() {
    let turns = turns(2, 30);
    let folder = tempfile::tempdir().expect("a folder");
    let figure = folder.path().join("figure.svg");
    for (of_stamps, lines) in turns.iter().zip([0, 1]) {
        let (_folder, input) = recording("sensor_msgs/msg/PointCloud2", "cdr", of_stamps);
        let input = text_of(&input);
        for arguments in [
            &["explain", input, "--at", "8,0,-1", "--within", "50", "--no-what-if"][..],
            &["figure", input, "-o", text_of(&figure), "--force"],
            &["triage", input],
        ] {
            let done = divmerge(arguments);
            let said = text(&done.stderr);
            assert!(done.status.success(), "{arguments:?}: {said}");
            let named = said.lines().filter(|line| line.contains("--assemble auto"));
            assert_eq!(named.count(), lines, "{arguments:?}: {said}");
        }
    }
}

/// What a command prints about a recording of turns, each whole or in ten parts, without what names
/// the recording and the messages.
fn printed(arguments: &[&str], of_stamps: &[(u64, Vec<u8>)]) -> String {
    let (_folder, input) = recording("sensor_msgs/msg/PointCloud2", "cdr", of_stamps);
    let arguments: Vec<&str> =
        arguments.iter().map(|&word| if word == "IN" { text_of(&input) } else { word }).collect();
    let done = divmerge(&arguments);
    let (out, said) = (text(&done.stdout), text(&done.stderr));
    assert!(done.status.success() && !said.contains("warning"), "{arguments:?}: {said}");
    let is_place = |line: &&str| {
        ["\"file\"", "\"frame\"", "\"first_frame\"", "\"log_time_ns\""]
            .iter()
            .any(|name| line.trim_start().starts_with(name))
    };
    out.lines().filter(|line| !is_place(line)).map(|line| format!("{line}\n")).collect()
}

#[test]
fn turns_are_explained_and_drawn_as_whole_clouds_are() {
    let [whole, parts] = turns(3, 10);
    let at = ["--at", "8,0,-1", "--within", "50", "--no-what-if", "--json"];
    let explained = |frame| [&["explain", "IN", "--frame", frame], &at[..]].concat();
    let of_whole = printed(&explained("1"), &whole);
    // Any message of a turn names it.
    for frame in ["10", "14", "19"] {
        let arguments = [&explained(frame)[..], &["--assemble", "auto"]].concat();
        assert_eq!(printed(&arguments, &parts), of_whole, "frame {frame}");
    }

    let folder = tempfile::tempdir().expect("a folder");
    let picture = |name: &str| folder.path().join(name).display().to_string();
    let draw = |name: &str, words: &[&str], of_stamps| {
        let path = picture(name);
        printed(&[&["figure", "IN", "-o", &path], words].concat(), of_stamps);
        std::fs::read_to_string(path).expect("a figure")
    };
    let of_whole = draw("whole.svg", &["--frame", "2"], &whole);
    let of_parts = draw("parts.svg", &["--frame", "20", "--assemble", "10"], &parts);
    assert!(of_parts.contains("frames 20 to 29") && of_whole.contains("frame 2"));
    // Both are drawn alike behind the heading, which ends with the time, with the same letters.
    let below_heading = |svg: &str| {
        let (_, behind) = svg.split_once(" s\" ").expect("a heading");
        behind.split_once("</g>").expect("its letters").1.to_owned()
    };
    assert!(below_heading(&of_parts) == below_heading(&of_whole));
}

#[test]
fn turns_are_triaged_as_whole_clouds_are() {
    let sources = turns(3, 10);
    let folder = tempfile::tempdir().expect("a folder");
    let [of_whole, of_parts] = [&[][..], &["--assemble", "auto"]].map(|words| {
        let of_stamps = &sources[usize::from(!words.is_empty())];
        let (_folder, input) = recording("sensor_msgs/msg/PointCloud2", "cdr", of_stamps);
        let (table, copy) = (folder.path().join("t.csv"), folder.path().join("copy.mcap"));
        let (table, copy) = (text_of(&table), text_of(&copy));
        let base = ["triage", text_of(&input), "--csv", table, "-o", copy, "--force"];
        let done = divmerge(&[&base[..], words].concat());
        assert!(done.status.success(), "{}", text(&done.stderr));
        // Three messages more, one for each turn.
        assert_eq!(messages(copy.as_ref()).len(), of_stamps.len() + 3);
        let rows = std::fs::read_to_string(table).expect("a table");
        let cells = |row: &str| row.split(',').skip(4).take(8).map(str::to_owned).collect();
        rows.lines().map(cells).collect::<Vec<Vec<String>>>()
    });
    assert!(of_whole.len() > 5, "{of_whole:?}");
    assert_eq!(of_parts, of_whole);
}

#[test]
fn a_part_that_cannot_be_read_does_not_end_its_turn() {
    let [_, mut parts] = turns(2, 10);
    parts[3].1.truncate(40);
    let (_folder, input) = recording("sensor_msgs/msg/PointCloud2", "cdr", &parts);
    let (made, report) = run(&input, &options(Semantics::Auto, Some(Assemble::Auto))).expect("run");
    let topic = &report.topics["/points"];
    assert_eq!((topic.frames, topic.unreadable), (2, 1));
    assert_eq!(labels(&made).len(), 19);
    assert!(report.warnings[0].contains("could not be read"), "{:?}", report.warnings);
}

#[test]
fn the_command_line_assembles_and_refuses_what_does_not_fit() {
    let [_, parts] = turns(2, 10);
    let (folder, input) = recording("sensor_msgs/msg/PointCloud2", "cdr", &parts);
    let output = folder.path().join("out.mcap");
    let base = ["annotate", text_of(&input), "-o", text_of(&output), "--no-layout"];
    for (how, code) in [("auto", 0), ("10", 0), ("0.1", 0), ("1s", 0), ("0", 2), ("soon", 2)] {
        let done = divmerge(&[&base[..], &["--force", "--assemble", how]].concat());
        assert_eq!(done.status.code(), Some(code), "{how}: {}", text(&done.stderr));
    }
    let refused = divmerge(&[&base[..], &["--resume", "--assemble", "auto"]].concat());
    assert_eq!(refused.status.code(), Some(2), "{}", text(&refused.stderr));
    // A window cuts the first turn short and leaves the others.
    let done =
        divmerge(&[&base[..], &["--force", "--assemble", "auto", "--from", "0.05"]].concat());
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    assert_eq!(labels(&output).len(), 15);
}
