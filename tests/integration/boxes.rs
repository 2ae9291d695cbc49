//! Method `boxes`: boxes from a topic and from KITTI's files, through whole recordings.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use divmerge::annotate::{AnnotateConfig, AnnotateOptions, TrackMode, TrackOptions};
use divmerge::cloud::{Detection, UprightBox};
use divmerge::comparison::methods::Boxes;
use divmerge::frames::{BoxSource, CloudKey, FrameBoxes};

use divmerge::datasets::drive::{CLOUD_TOPIC, SENSOR_FRAME};
use divmerge::messages::clouds::CloudFormat;
use divmerge::messages::definitions::MARKER_ARRAY;
use divmerge::messages::objects::{ObjectBox, ObjectEncoding, ObjectKind};
use divmerge::messages::ros::{ByteOrder, Layout};
use divmerge::pipeline::Config;
use divmerge::recording::{Overview, Record, RecordingReader, RecordingWriter, WriteOptions};
use divmerge::simulate::{Drive, Scene, Sensor};
use divmerge::{Result, Taxonomy};
use nalgebra::Translation3;

use crate::cli::{divmerge, path, text};
use crate::recordings::{drive, run};

const BOXES: &str = "/boxes";

/// Cuts by the boxes of a source.
fn by_boxes(source: &BoxSource, recording: &Path) -> Result<AnnotateOptions> {
    let boxes = FrameBoxes::open(source, recording, &Taxonomy::semantic_kitti())?;
    let other_method = Some(Arc::new(Boxes::default()) as _);
    let pipeline = Config { other_method, ..Config::best() };
    let config = AnnotateConfig { pipeline, boxes, ..AnnotateConfig::default() };
    Ok(AnnotateOptions { config, force: true, ..AnnotateOptions::default() })
}

fn of_topic(topic: &str) -> BoxSource {
    BoxSource::Topic(topic.to_owned())
}

/// A column of the clouds of a topic, cloud by cloud.
fn column(recording: &Path, topic: &str, name: &str) -> Vec<Vec<u32>> {
    let overview = Overview::read(recording).expect("a recording");
    let id = overview.channels_of(topic).next().expect("the topic").id;
    let mut reader = RecordingReader::open(recording).expect("a recording");
    let mut columns = Vec::new();
    while let Some(record) = reader.next_record().expect("readable") {
        if let Record::Message { header, data, .. } = record
            && header.channel_id == id
        {
            let cloud = CloudFormat::Ros2.decode(&data).expect("a cloud");
            columns.push(cloud.column_u32(name).expect("the field"));
        }
    }
    columns
}

/// An annotated recording with the clouds and their boxes alone, the boxes on a topic of their own.
/// `keep` says which of the arrays of boxes stay.
fn detected(annotated: &Path, keep: impl Fn(usize) -> bool) -> PathBuf {
    let output = annotated.with_file_name("detected.mcap");
    let overview = Overview::read(annotated).expect("a recording");
    let id = |end: &str| {
        let topic = format!("{CLOUD_TOPIC}/{end}");
        overview.channels_of(&topic).next().expect("the topic").id
    };
    let (instances, objects) = (id("instances"), id("objects"));
    let options = WriteOptions { force: true, ..WriteOptions::default() };
    let mut writer = RecordingWriter::create(&output, &options).expect("a writer");
    let mut reader = RecordingReader::open(annotated).expect("a recording");
    let mut arrays = 0..;
    while let Some(record) = reader.next_record().expect("readable") {
        let is_copied = match &record {
            Record::Channel(channel) => channel.id != instances,
            Record::Message { header, .. } => {
                header.channel_id != instances
                    && (header.channel_id != objects || arrays.next().is_some_and(&keep))
            }
            Record::Metadata(_) => false,
            _ => true,
        };
        let record = match record {
            Record::Channel(mut channel) if channel.id == objects => {
                channel.topic = BOXES.to_owned();
                Record::Channel(channel)
            }
            other => other,
        };
        if is_copied {
            writer.copy(&record).expect("copied");
        }
    }
    writer.finish().expect("finished");
    output
}

/// Of the points with a reference instance the share that is in the instance which most of its
/// points are in, where no two reference instances may claim the same.
fn agreement(reference: &[u32], found: &[u32]) -> f64 {
    let mut shared: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    for (&reference, &found) in reference.iter().zip(found).filter(|&(&r, &f)| r != 0 && f != 0) {
        *shared.entry((reference, found)).or_default() += 1;
    }
    let mut pairs: Vec<_> = shared.into_iter().collect();
    pairs.sort_by_key(|&(pair, points)| (std::cmp::Reverse(points), pair));
    let (mut taken, mut given) = (BTreeMap::new(), BTreeMap::new());
    let mut agreeing = 0;
    for ((reference, found), points) in pairs {
        if !taken.contains_key(&found) && !given.contains_key(&reference) {
            taken.insert(found, reference);
            given.insert(reference, found);
            agreeing += points;
        }
    }
    agreeing as f64 / reference.iter().filter(|&&instance| instance != 0).count() as f64
}

#[test]
fn points_get_the_instance_of_their_box() {
    let (_folder, input) = drive(3);
    // Of each cloud alone: the box of a track has the size of all that was seen of it.
    let tracks = TrackOptions { mode: TrackMode::Off, ..TrackOptions::default() };
    let alone = AnnotateOptions { tracks, ..AnnotateOptions::default() };
    let (annotated, _) = run(&input, &alone).expect("annotated");
    let recording = detected(&annotated, |_| true);
    let options = by_boxes(&of_topic(BOXES), &recording).expect("boxes");
    let (output, report) = run(&recording, &options).expect("annotated");
    assert!(report.is_complete() && report.warnings.is_empty(), "{:?}", report.warnings);
    let topic = format!("{CLOUD_TOPIC}/instances");
    let reference = column(&annotated, &topic, "instance");
    let found = column(&output, &topic, "instance");
    assert_eq!(reference.len(), 3);
    for (reference, found) in reference.iter().zip(&found) {
        let agreement = agreement(reference, found);
        assert!(agreement > 0.98, "{agreement}");
    }
    // The boxes of one cloud are not those of the next: the drive moves on.
    assert!(agreement(&reference[0], &found[2]) < 0.98);
}

#[test]
fn a_cloud_without_boxes_is_told_once_and_counted() {
    let (_folder, input) = drive(4);
    let (annotated, _) = run(&input, &AnnotateOptions::default()).expect("annotated");
    let recording = detected(&annotated, |number| number == 2);
    let options = by_boxes(&of_topic(BOXES), &recording).expect("boxes");
    let (output, report) = run(&recording, &options).expect("annotated");
    let topic = &report.topics[CLOUD_TOPIC];
    assert_eq!((topic.frames, topic.unreadable, report.warnings.len()), (4, 0, 1));
    for words in ["3 clouds without boxes; the first: ", "no boxes on /boxes"] {
        assert!(report.warnings[0].contains(words), "{:?}", report.warnings);
    }
    let found = column(&output, &format!("{CLOUD_TOPIC}/instances"), "instance");
    let counts = found.iter().map(|of| of.iter().filter(|&&instance| instance != 0).count());
    let counts: Vec<usize> = counts.collect();
    assert!(counts[2] > 100 && [0, 1, 3].iter().all(|&frame| counts[frame] == 0), "{counts:?}");
}

#[test]
fn boxes_in_another_frame_end_the_run() {
    let (folder, input) = drive(1);
    let recording = folder.path().join("foreign.mcap");
    let mut writer = RecordingWriter::create(&recording, &WriteOptions::default()).expect("writer");
    let mut reader = RecordingReader::open(&input).expect("a recording");
    writer.reserve(&Overview::read(&input).expect("a recording"));
    let mut stamp = None;
    while let Some(record) = reader.next_record().expect("readable") {
        if let Record::Message { header, data, .. } = &record
            && let Ok(cloud) = CloudFormat::Ros2.decode(data)
        {
            stamp = Some((*header, cloud.stamp_sec, cloud.stamp_nanosec));
        }
        writer.copy(&record).expect("copied");
    }
    let (cloud, seconds, nanoseconds) = stamp.expect("a cloud");
    let schema = MARKER_ARRAY.add_to(&mut writer).expect("schema");
    let channel_id = writer.add_channel(BOXES, schema, "cdr", &BTreeMap::new()).expect("channel");
    let boxed = ObjectBox {
        id: 1,
        is_track: false,
        velocity: None,
        pose: Translation3::from([5.0; 3]).into(),
        size: [1.0; 3],
        class: 10,
        name: "car".into(),
        probability: 1.0,
        title: "1 car".into(),
        points: 1,
        is_object: true,
    };
    let mut message = Vec::new();
    let encoding = ObjectEncoding::Ros(Layout::Cdr(ByteOrder::Little));
    let header = (seconds as i32, nanoseconds, "base_link");
    ObjectKind::Markers.write(encoding, header, &[boxed], &mut message).expect("markers");
    let header = divmerge::recording::MessageHeader { channel_id, ..cloud };
    writer.write_message(&header, &message).expect("written");
    writer.finish().expect("finished");

    let options = by_boxes(&of_topic(BOXES), &recording).expect("boxes");
    let error = run(&recording, &options).expect_err("another frame").to_string();
    assert!(error.contains("`base_link`") && error.contains(SENSOR_FRAME), "{error}");
    assert!(!recording.with_extension("annotated.mcap").exists());

    let unknown = by_boxes(&of_topic("/none"), &recording).expect_err("no such topic").to_string();
    assert!(unknown.contains("/none") && unknown.contains(BOXES), "{unknown}");
    let clouds = by_boxes(&of_topic(CLOUD_TOPIC), &recording).expect_err("clouds").to_string();
    assert!(clouds.contains("PointCloud2"), "{clouds}");
}

/// KITTI's names of the classes that the simulator has, as far as there are some.
const TYPES: [(u16, &str); 4] = [(10, "Car"), (18, "Truck"), (30, "Pedestrian"), (31, "Cyclist")];

/// Angle by which the rectification of [`calibration`] turns about the camera's y, radians.
const RECTIFIED_BY: f64 = 0.02;

/// A calibration file of the object benchmark: a camera 0.27 m ahead of the LiDAR, 0.08 m below and
/// 0.06 m right.
fn calibration() -> String {
    let (sin, cos) = RECTIFIED_BY.sin_cos();
    format!(
        "P0: 1 0 0 0 0 1 0 0 0 0 1 0\nR0_rect: {cos} 0 {sin} 0 1 0 {} 0 {cos}\n\
         Tr_velo_to_cam: 0 -1 0 -0.06 0 0 -1 -0.08 1 0 0 -0.27\n",
        -sin
    )
}

/// A box of the LiDAR as a line of a label file under [`calibration`].
fn label_line(name: &str, bounds: &UprightBox) -> String {
    let [x, y, z] = bounds.centre;
    let [length, width, height] = bounds.size;
    // Camera x is right, y down, z ahead; the place is that of the bottom.
    let (right, down, ahead) = (-y - 0.06, -z - 0.08 + height / 2.0, x - 0.27);
    let (sin, cos) = RECTIFIED_BY.sin_cos();
    let (right, ahead) = (right * cos + ahead * sin, ahead * cos - right * sin);
    let rotation_y = RECTIFIED_BY - bounds.yaw - std::f64::consts::FRAC_PI_2;
    format!(
        "{name} 0.00 0 0.00 0 0 50 50 {height:.6} {width:.6} {length:.6} {right:.6} {down:.6} \
         {ahead:.6} {rotation_y:.6}\n"
    )
}

#[test]
fn kitti_files_round_trip() {
    let frame = Drive::new(Sensor::Vlp16, Scene::Parking, 1).frame(0); // as in `drive`
    let class = frame.cloud.class.as_ref().expect("classes");
    let taxonomy = Taxonomy::semantic_kitti();
    let mut objects: BTreeMap<u16, Vec<u32>> = BTreeMap::new();
    for (point, &instance) in (0..).zip(&frame.true_instance).filter(|&(_, &id)| id != 0) {
        objects.entry(instance).or_default().push(point);
    }
    let mut expected = Vec::new();
    let mut lines = String::new();
    for points in objects.values() {
        let raw = class[points[0] as usize];
        let Some((_, name)) = TYPES.iter().find(|(id, _)| *id == raw) else { continue };
        let bounds = UprightBox::around(&frame.cloud, points).expect("points");
        if bounds.size.iter().all(|&side| side > 0.01) {
            let class = taxonomy.class_of(raw);
            expected.push(Detection { bounds, class, score: 1.0 });
            lines += &label_line(name, &bounds);
        }
    }
    assert!(expected.len() > 10, "{}", expected.len());

    let (folder, input) = drive(1);
    let labels = folder.path().join("label_2");
    std::fs::create_dir(&labels).expect("a folder");
    std::fs::write(labels.join("000000.txt"), lines).expect("written");
    let file = folder.path().join("calib.txt");
    std::fs::write(&file, calibration()).expect("written");
    let source = BoxSource::Kitti { labels, calibration: file };
    let boxes = FrameBoxes::open(&source, &input, &taxonomy).expect("boxes");
    let key = CloudKey { topic: CLOUD_TOPIC, number: 0, stamp_ns: 0, frame_id: SENSOR_FRAME };
    let read = boxes.of(&key).expect("boxes").detections;
    assert_eq!(read.len(), expected.len());
    for (read, expected) in read.iter().zip(&expected) {
        assert_eq!((read.class, read.score), (expected.class, expected.score));
        assert_near(&read.bounds, &expected.bounds);
    }

    let options = by_boxes(&source, &input).expect("boxes");
    let (output, _) = run(&input, &options).expect("annotated");
    let found = column(&output, &format!("{CLOUD_TOPIC}/instances"), "instance");
    let is_boxed = |raw: u16| TYPES.iter().any(|(id, _)| *id == raw);
    let truth = class.iter().zip(&frame.true_instance);
    let truth: Vec<u32> =
        truth.map(|(&raw, &id)| if is_boxed(raw) { u32::from(id) } else { 0 }).collect();
    let agreement = agreement(&truth, &found[0]);
    assert!(agreement > 0.98, "{agreement}");
}

/// Equal within what six decimals leave; a box as wide as long may be turned by a quarter.
fn assert_near(read: &UprightBox, expected: &UprightBox) {
    let corners = |of: &UprightBox| {
        let (sin, cos) = of.yaw.sin_cos();
        let [length, width, height] = of.size;
        let mut corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(a, b)| {
            let (u, v) = (a * length / 2.0, b * width / 2.0);
            [of.centre[0] + u * cos - v * sin, of.centre[1] + u * sin + v * cos]
        });
        corners.sort_by(|a, b| (a[0] + 1e-3 * a[1]).total_cmp(&(b[0] + 1e-3 * b[1])));
        (corners, [of.centre[2], height])
    };
    let ((a, upright_a), (b, upright_b)) = (corners(read), corners(expected));
    let plane = a.iter().flatten().zip(b.iter().flatten());
    let all = plane.chain(upright_a.iter().zip(&upright_b));
    assert!(all.map(|(a, b)| (a - b).abs()).all(|off| off < 1e-4), "{read:?} {expected:?}");
}

#[test]
fn wrong_usage_and_a_figure_by_the_boxes_of_an_annotation() {
    let (folder, input) = drive(1);
    let output = folder.path().join("out.mcap");
    let annotate = ["annotate", path(&input), "-o", path(&output)];
    for (arguments, words) in [
        (&["--method", "boxes"][..], &["--boxes topic:NAME", "--boxes kitti:DIR"][..]),
        (&["--method", "euclidean", "--boxes", "topic:/a"], &["--method boxes"]),
        (&["--boxes", "topic:/a"], &["--method boxes"]),
        (&["--method", "boxes", "--boxes", "kitti:labels"], &["--boxes-calibration"]),
        (&["--method", "boxes", "--boxes", "labels"], &["topic:NAME or kitti:DIR"]),
        (&["--boxes-margin", "0.2"], &["--boxes"]),
    ] {
        let done = divmerge(&[&annotate[..], arguments].concat());
        let said = text(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(words.iter().all(|word| said.contains(word)), "{arguments:?}: {said}");
        assert!(!output.exists());
    }
    let with =
        |topic: &str| divmerge(&[&annotate[..], &["--method", "boxes", "--boxes", topic]].concat());
    let unknown = with("topic:/none");
    assert_eq!(unknown.status.code(), Some(1));
    assert!(text(&unknown.stderr).contains("/none"), "{}", text(&unknown.stderr));

    assert_eq!(divmerge(&annotate).status.code(), Some(0));
    let picture = folder.path().join("boxes.png");
    let objects = format!("topic:{CLOUD_TOPIC}/objects");
    let figure = ["figure", path(&output), "-o", path(&picture), "--panels", "instances"];
    let small = ["--dpi", "30", "--method", "boxes", "--boxes", &objects, "--topic", CLOUD_TOPIC];
    let done = divmerge(&[&figure[..], &small].concat());
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    assert!(picture.exists() && text(&done.stderr).is_empty(), "{}", text(&done.stderr));
}
