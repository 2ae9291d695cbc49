//! The motion of the sensor: recorded, compared with the clouds, or estimated.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use divmerge::annotate::slices::{plan, recordings};
use divmerge::annotate::{
    AnnotateOptions, EgoMotionSource, JoinOptions, MotionReport, SliceFile, TrackOptions, annotate,
    by_recording, follow_drive, join,
};
use divmerge::datasets::drive::{CLOUD_TOPIC, cloud_message};
use divmerge::messages::clouds::CloudFormat;
use divmerge::messages::ros::{ByteOrder, Layout, RosWriter};
use divmerge::recording::{MessageHeader, RecordingWriter, WriteOptions};
use divmerge::simulate::{Drive, Scene, Sensor};
use foxglove::Encode;
use foxglove::messages::{LocationFix, Timestamp};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use tempfile::TempDir;

const FRAMES: usize = 16;

/// Where something says that the sensor is in a frame of the drive, given where it is.
type Says = fn(usize, Isometry3<f64>) -> Option<Isometry3<f64>>;

/// A topic that says poses, and what it says.
type Poses = (&'static str, Says);

fn true_pose(_: usize, pose: Isometry3<f64>) -> Option<Isometry3<f64>> {
    Some(pose)
}

fn half_as_far(_: usize, mut pose: Isometry3<f64>) -> Option<Isometry3<f64>> {
    pose.translation.vector *= 0.5;
    Some(pose)
}

fn late(number: usize, pose: Isometry3<f64>) -> Option<Isometry3<f64>> {
    (number >= 6).then_some(pose)
}

fn jumping(number: usize, mut pose: Isometry3<f64>) -> Option<Isometry3<f64>> {
    pose.translation.vector.y += if number >= 11 { 4.0 } else { 0.0 };
    Some(pose)
}

/// A drive with poses on some topics: `/tf` has them as transforms, `/fix` as places on the earth,
/// `/location` as those of Foxglove, the others as odometry. They are logged behind the clouds, as
/// those who compute them do.
fn recorded(topics: &[Poses]) -> (TempDir, PathBuf) {
    let drive = Drive::new(Sensor::Vlp16, Scene::Street, 5);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("drive.mcap");
    let mut writer = RecordingWriter::create(&path, &WriteOptions::default()).expect("begun");
    let mut channel = |topic: &str, definition: (&str, &str, &[u8])| {
        let none = BTreeMap::new();
        let encoding = if definition.1 == "protobuf" { "protobuf" } else { "cdr" };
        writer.declare_channel(topic, definition, encoding, &none).expect("declared")
    };
    let schema = CloudFormat::Ros2.schema();
    let clouds = channel(CLOUD_TOPIC, (schema.name, schema.encoding, &*schema.data));
    let channels: Vec<u16> = topics
        .iter()
        .map(|(topic, _)| match *topic {
            "/tf" => channel(topic, ("tf2_msgs/msg/TFMessage", "ros2msg", b"")),
            "/fix" => channel(topic, ("sensor_msgs/msg/NavSatFix", "ros2msg", b"")),
            "/location" => channel(topic, ("foxglove.LocationFix", "protobuf", b"")),
            _ => channel(topic, ("nav_msgs/msg/Odometry", "ros2msg", b"")),
        })
        .collect();
    for number in 0..FRAMES {
        let frame = drive.frame(number);
        let mut write = |channel_id, log_time, message: &[u8]| {
            let header =
                MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
            writer.write_message(&header, message).expect("written");
        };
        let mut message = Vec::new();
        cloud_message(&frame, &mut message).expect("encoded");
        write(clouds, frame.stamp_ns, &message);
        for (&id, (topic, says)) in channels.iter().zip(topics) {
            if let Some(pose) = says(number, frame.pose) {
                match *topic {
                    "/fix" => fix_message(frame.stamp_ns, &pose, &mut message),
                    "/location" => location_message(frame.stamp_ns, &pose, &mut message),
                    _ => pose_message(*topic == "/tf", frame.stamp_ns, &pose, &mut message),
                }
                write(id, frame.stamp_ns + 50_000_000, &message);
            }
        }
    }
    writer.finish().expect("complete");
    (folder, path)
}

fn pose_message(is_tf: bool, stamp_ns: u64, pose: &Isometry3<f64>, out: &mut Vec<u8>) {
    let mut writer = RosWriter::new(Layout::Cdr(ByteOrder::Little), out);
    if is_tf {
        writer.length(1);
    }
    writer.header(((stamp_ns / 1_000_000_000) as i32, (stamp_ns % 1_000_000_000) as u32, "odom"));
    writer.string("lidar");
    let Isometry3 { rotation, translation } = pose;
    writer.f64s(translation.vector.iter().chain(rotation.coords.iter()).copied());
}

/// Latitude, longitude and altitude of a pose, degrees and metres: the world of the drive lies at
/// 48 degrees north and 9 degrees east, its x axis 0.7 rad north of east.
fn on_the_earth(pose: &Isometry3<f64>) -> [f64; 3] {
    /// Radii of the ellipsoid there, metres: along a meridian, and across.
    const RADII: [f64; 2] = [6_370_944.0, 6_389_944.0];
    let world = Vector3::z_axis();
    let place = UnitQuaternion::from_axis_angle(&world, 0.7) * pose.translation.vector;
    let north = (place.y / RADII[0]).to_degrees();
    let east = (place.x / (RADII[1] * 48.0_f64.to_radians().cos())).to_degrees();
    [48.0 + north, 9.0 + east, 300.0 + place.z]
}

fn fix_message(stamp_ns: u64, pose: &Isometry3<f64>, out: &mut Vec<u8>) {
    let mut writer = RosWriter::new(Layout::Cdr(ByteOrder::Little), out);
    writer.header(((stamp_ns / 1_000_000_000) as i32, (stamp_ns % 1_000_000_000) as u32, "gps"));
    writer.i8(2);
    writer.u16(1);
    writer.f64s(on_the_earth(pose));
    writer.f64s([1e-4, 0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 1e-3]);
    writer.u8(2);
}

fn location_message(stamp_ns: u64, pose: &Isometry3<f64>, out: &mut Vec<u8>) {
    let [latitude, longitude, altitude] = on_the_earth(pose);
    let seconds = (stamp_ns / 1_000_000_000) as u32;
    let timestamp = Some(Timestamp::new(seconds, (stamp_ns % 1_000_000_000) as u32));
    let frame_id = "gps".to_owned();
    let fix = LocationFix {
        timestamp,
        frame_id,
        latitude,
        longitude,
        altitude,
        ..LocationFix::default()
    };
    out.clear();
    fix.encode(out).expect("encoded");
}

fn options(ego_motion: EgoMotionSource) -> AnnotateOptions {
    let tracks = TrackOptions { ego_motion, ..TrackOptions::default() };
    AnnotateOptions { tracks, force: true, ..AnnotateOptions::default() }
}

/// Where the motion came from, and the warnings.
fn motion(input: &Path, source: EgoMotionSource) -> (MotionReport, Vec<String>) {
    let output = input.with_extension("out.mcap");
    let report = annotate(input, &output, &options(source), &mut |_| ControlFlow::Continue(()));
    let mut report = report.expect("annotated");
    let topic = report.topics.remove(CLOUD_TOPIC).expect("the topic");
    (topic.ego_motion, report.warnings)
}

fn from(report: &MotionReport, source: &str) -> u64 {
    let is_from = |(name, count): (&String, &u64)| name.starts_with(source).then_some(*count);
    report.sources.iter().filter_map(is_from).sum()
}

#[test]
fn transforms_that_agree_with_the_clouds_are_used() {
    let (_folder, input) = recorded(&[("/tf", true_pose)]);
    let (report, warnings) = motion(&input, EgoMotionSource::Auto);
    assert!(from(&report, "/tf (in odom)") >= 4, "{report:?}");
    assert_eq!(from(&report, "/tf") + from(&report, "the clouds"), FRAMES as u64);
    let [compared] = report.comparisons.as_slice() else { panic!("{report:?}") };
    assert!(compared.contains("agrees with the clouds"), "{compared}");
    assert!(warnings.is_empty() && report.breaks.is_empty(), "{warnings:?}");
}

#[test]
fn a_motion_that_contradicts_the_clouds_is_not_used() {
    let (_folder, input) = recorded(&[("/tf", half_as_far), ("/odom", true_pose)]);
    let (report, warnings) = motion(&input, EgoMotionSource::Auto);
    assert_eq!(from(&report, "/tf"), 0, "{report:?}");
    assert!(from(&report, "/odom (lidar in odom)") >= 4, "{report:?}");
    let [warning] = warnings.as_slice() else { panic!("{warnings:?}") };
    assert!(warning.contains("/tf (in odom) contradicts the clouds"), "{warning}");
}

#[test]
fn what_is_asked_for_is_taken_and_nothing_else() {
    let (_folder, input) = recorded(&[("/tf", half_as_far), ("/odom", late)]);
    let (report, _) = motion(&input, EgoMotionSource::Transforms);
    assert_eq!(from(&report, "/tf"), FRAMES as u64);
    let (report, _) = motion(&input, EgoMotionSource::Topic("/odom".into()));
    assert_eq!((from(&report, "nothing"), from(&report, "/odom")), (6, FRAMES as u64 - 6));
    let (report, _) = motion(&input, EgoMotionSource::Estimate);
    assert_eq!(from(&report, "the clouds"), FRAMES as u64);
    let wrong = options(EgoMotionSource::Topic("/odon".into()));
    let output = input.with_extension("wrong.mcap");
    let error = annotate(&input, &output, &wrong, &mut |_| ControlFlow::Continue(()));
    let error = error.expect_err("there is no such topic").to_string();
    assert!(error.contains("did you mean `/odom`?"), "{error}");
    assert!(!output.exists());
    let (config, tracks) = (&wrong.config, &wrong.tracks);
    let followed = follow_drive(&input, (None, ..), (config, tracks), &mut |_| Ok(()));
    assert_eq!(followed.expect_err("there is no such topic").to_string(), error);
}

/// Places on the earth come last, and head where they lead.
#[test]
fn places_on_the_earth_are_used_where_nothing_better_is_recorded() {
    for topic in ["/fix", "/location"] {
        let (_folder, input) = recorded(&[(topic, true_pose)]);
        let (report, warnings) = motion(&input, EgoMotionSource::Auto);
        assert!(from(&report, topic) >= 4, "{report:?}");
        assert!(warnings.is_empty() && report.breaks.is_empty(), "{warnings:?}");
        let source = EgoMotionSource::Topic(topic.to_owned());
        let (report, warnings) = motion(&input, source);
        // Before the first two metres nothing says where it heads.
        let said = from(&report, topic);
        assert!((10..FRAMES as u64).contains(&said), "{report:?}");
        assert_eq!(from(&report, "nothing"), FRAMES as u64 - said);
        assert!(warnings.is_empty(), "{warnings:?}");
    }
    let (_folder, input) = recorded(&[("/fix", true_pose), ("/odom", true_pose)]);
    let (report, _) = motion(&input, EgoMotionSource::Auto);
    assert!(from(&report, "/odom") >= 4 && from(&report, "/fix") == 0, "{report:?}");
    let (_folder, input) = recorded(&[("/fix", half_as_far)]);
    let (report, warnings) = motion(&input, EgoMotionSource::Auto);
    assert_eq!(from(&report, "the clouds"), FRAMES as u64, "{report:?}");
    assert!(warnings.iter().any(|warning| warning.contains("/fix")), "{warnings:?}");
}

#[test]
fn a_pose_that_jumps_ends_all_tracks() {
    let (_folder, input) = recorded(&[("/tf", jumping)]);
    for source in [EgoMotionSource::Auto, EgoMotionSource::Transforms] {
        let (report, warnings) = motion(&input, source);
        assert_eq!(report.breaks.values().sum::<u64>(), 1, "{report:?}");
        assert!(warnings.iter().any(|warning| warning.contains("jumps")), "{warnings:?}");
    }
}

/// What is recorded behind a cloud is the same however the work is cut up.
#[test]
fn the_bytes_are_the_same_with_any_threads_and_from_slices() {
    let (folder, input) = recorded(&[("/tf", true_pose)]);
    let annotated = |threads, name: &str| {
        let output = folder.path().join(name);
        let options = AnnotateOptions { threads, ..options(EgoMotionSource::Auto) };
        annotate(&input, &output, &options, &mut |_| ControlFlow::Continue(())).expect("annotated");
        std::fs::read(output).expect("an output")
    };
    let one = annotated(1, "one.mcap");
    assert!(one == annotated(4, "four.mcap"), "four threads");
    let planned = recordings(std::slice::from_ref(&input)).expect("a recording");
    let slices = plan(&planned, 3, &[]).expect("a plan");
    let made: Vec<_> = slices
        .into_iter()
        .enumerate()
        .map(|(number, slice)| {
            let output = folder.path().join(format!("slice{number}.mcap"));
            let options = AnnotateOptions { slice: Some(slice), ..options(EgoMotionSource::Auto) };
            annotate(&input, &output, &options, &mut |_| ControlFlow::Continue(()))
                .expect("a slice");
            output
        })
        .collect();
    let files = made.iter().map(|file| SliceFile::open(file).expect("a slice")).collect();
    let files = by_recording(files, None).expect("all of them").remove(0);
    let output = folder.path().join("joined.mcap");
    let options = JoinOptions::default();
    join(&files, &output, &options, &mut |_| ControlFlow::Continue(())).expect("joined");
    assert!(one == std::fs::read(output).expect("an output"), "slices");
}
