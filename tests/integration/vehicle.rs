//! The vehicle that carries the sensor: its own body in the clouds, and its way through a map.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use divmerge::annotate::{Clustered, cluster, remarks};
use divmerge::cloud::CloudFrames;
use divmerge::cloud::sensor_frame::SensorFrame;
use divmerge::datasets::cloud_recording::{CloudRecording, Transform};
use divmerge::datasets::drive::cloud_message;
use divmerge::frames::{EncodedClouds, recorded_transforms};
use divmerge::messages::clouds::CloudFormat;
use divmerge::nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use divmerge::range_image::Evidence;
use divmerge::recording::WriteOptions;
use divmerge::simulate::{Drive, EGO_INSTANCE, Mount, Scene, Sensor, SimulatedFrame};
use divmerge::{AnnotateConfig, Instance, Reason, Semantics};
use tempfile::TempDir;

use crate::cli::{divmerge, path as text_of, text};
use crate::shared_data::shared_data;

const TOPIC: &str = "/points";

fn create(folder: &TempDir) -> (CloudRecording, PathBuf) {
    let path = folder.path().join("made.mcap");
    let options = WriteOptions { force: true, ..WriteOptions::default() };
    (CloudRecording::create(CloudFormat::Ros2, &path, TOPIC, &options).unwrap(), path)
}

/// Every fifth sweep of a drive over a saloon.
fn driven(folder: &TempDir, mut drive: Drive) -> PathBuf {
    let (mut recording, path) = create(folder);
    (drive.sees_vehicle, drive.mount) = (true, Mount::level(1.9));
    let mut message = Vec::new();
    for number in 0..30 {
        let frame = drive.frame(5 * number);
        cloud_message(&frame, &mut message).unwrap();
        recording.write_cloud(frame.stamp_ns, &message).unwrap();
    }
    recording.finish().unwrap();
    path
}

/// Numbers of returns that are left out: of the vehicle's own, of all of those, and of others.
fn left_out(annotated: &Path) -> [usize; 3] {
    let mut counts = [0; 3];
    for cloud in EncodedClouds::open(annotated, Some("/points/instances"), ..).unwrap() {
        let cloud = cloud.unwrap();
        let wire = cloud.decode().unwrap();
        let [instance, reason] =
            ["true_instance", "reason"].map(|name| wire.column_u32(name).unwrap());
        for (instance, reason) in instance.into_iter().zip(reason) {
            let is_own = instance == u32::from(EGO_INSTANCE);
            let is_left_out = reason == u32::from(Reason::Cropped as u8);
            counts[0] += usize::from(is_own && is_left_out);
            counts[1] += usize::from(is_own);
            counts[2] += usize::from(!is_own && is_left_out);
        }
    }
    counts
}

fn annotate(input: &Path, options: &[&str]) -> (std::process::Output, PathBuf) {
    let output = input.with_extension("out.mcap");
    let usual = ["annotate", text_of(input), "-o", text_of(&output), "--semantics", "ground"];
    (divmerge(&[&usual[..], &["--force"], options].concat()), output)
}

#[test]
fn the_vehicle_itself_is_left_out_of_a_drive() {
    let folder = tempfile::tempdir().unwrap();
    let input = driven(&folder, Drive::new(Sensor::Vlp16, Scene::Street, 5));
    let (run, output) = annotate(&input, &["--ego", "auto"]);
    let said = text(&run.stderr);
    assert!(run.status.success(), "{said}");
    assert_eq!(said.matches("the vehicle's own body").count(), 2, "once for the topic: {said}");
    assert!(said.contains("30 clouds with") && said.contains("24 clouds compared"), "{said}");
    let [found, own, others] = left_out(&output);
    assert!(own > 5000 && 100 * found > 99 * own, "{found} of {own}");
    assert_eq!(others, 0);
    let (_, output) = annotate(&input, &[]);
    assert_eq!(left_out(&output)[0], 0);
    let info = divmerge(&["info", text_of(&input), "--ego", "auto"]);
    assert!(text(&info.stdout).contains("returns are the vehicle's own body"), "{info:?}");
}

#[test]
fn a_vehicle_that_stands_is_not_told_from_its_surroundings() {
    let folder = tempfile::tempdir().unwrap();
    let input = driven(&folder, Drive::new(Sensor::Vlp16, Scene::Crowd, 5).standing());
    let (run, output) = annotate(&input, &["--ego", "auto"]);
    let said = text(&run.stderr);
    assert!(run.status.success(), "{said}");
    assert_eq!(said.matches("nothing moves in the clouds' frame").count(), 1, "{said}");
    let point = ["--at", "8,0,0", "--within", "50"];
    let explained =
        divmerge(&[&["explain", text_of(&input), "--ego", "auto"], &point[..]].concat());
    let said = text(&explained.stderr);
    assert_eq!(said.matches("nothing moves in the clouds' frame").count(), 1, "{said}");
    let [found, own, others] = left_out(&output);
    assert!((found, others) == (0, 0) && own > 5000, "{found}, {own}, {others}");
}

#[test]
fn the_vehicle_cannot_be_found_in_a_stream_or_in_parts() {
    let folder = tempfile::tempdir().unwrap();
    let input = driven(&folder, Drive::new(Sensor::Vlp16, Scene::Street, 5));
    let run = Command::new(env!("CARGO_BIN_EXE_divmerge"))
        .args(["annotate", "-", "-o", text_of(&input.with_extension("out")), "--ego", "auto"])
        .stdin(Stdio::from(std::fs::File::open(&input).unwrap()))
        .output()
        .unwrap();
    assert!(
        !run.status.success() && text(&run.stderr).contains("a stream is read once"),
        "{run:?}"
    );
    let (run, _) = annotate(&input, &["--ego", "auto", "--assemble", "2"]);
    assert!(!run.status.success() && text(&run.stderr).contains("--assemble"), "{run:?}");
}

#[test]
fn a_real_drive_keeps_what_is_not_its_vehicle() {
    let Some(data) = shared_data() else { return };
    let recording = data.join("recordings/semantickitti_04_ros2.mcap");
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.mcap");
    let arguments = ["annotate", text_of(&recording), "-o", text_of(&output), "--ego", "auto"];
    let run = divmerge(&arguments);
    assert!(run.status.success(), "{run:?}");
    let (mut cropped, mut returns, mut farthest) = (0, 0, 0.0_f64);
    for cloud in EncodedClouds::open(&output, Some("/velodyne_points/instances"), ..).unwrap() {
        let cloud = cloud.unwrap();
        let wire = cloud.decode().unwrap();
        let reason = wire.column_u32("reason").unwrap();
        let points = wire.to_cloud(None).unwrap();
        for (point, _) in reason.iter().enumerate().filter(|(_, reason)| **reason == 7) {
            cropped += 1;
            farthest = farthest.max(points.squared_range(point).sqrt());
        }
        returns += points.len();
    }
    eprintln!("{cropped} of {returns} returns, up to {farthest:.1} m: {}", text(&run.stderr));
    assert!(1000 * cropped < 5 * returns && farthest < 5.5, "{cropped} of {returns}, {farthest} m");
}

/// Where the sensor sits on a vehicle that drives a bend through a map, at a time in seconds.
fn base_from_sensor() -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(1.1, 0.2, 1.8),
        UnitQuaternion::from_euler_angles(0.0, 0.0, 0.5),
    )
}

fn map_from_base(seconds: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.3 + 0.2 * seconds);
    Isometry3::from_parts(Translation3::new(900.0 + 8.0 * seconds, -40.0, 12.0), turn)
}

/// The sweep in the map's frame, `seconds` after the first.
fn in_map(frame: &SimulatedFrame, seconds: f64) -> SimulatedFrame {
    let map_from_sensor = map_from_base(seconds) * base_from_sensor();
    let mut moved = frame.clone();
    for point in (0..frame.cloud.len()).filter(|&point| frame.cloud.is_return(point)) {
        let at = map_from_sensor * Point3::from(frame.cloud.position(point).map(f64::from));
        moved.cloud.set_position(point, [at.x as f32, at.y as f32, at.z as f32]);
    }
    moved
}

/// Five sweeps in a map's frame, a tenth of a second apart, and transforms of the vehicle at some
/// tenths of a second.
fn mapped(folder: &TempDir, drive: &Drive, known: &[f64]) -> PathBuf {
    let (mut recording, path) = create(folder);
    let start = drive.frame(0).stamp_ns;
    let at = |tenths: f64| start.saturating_add_signed((tenths * 1e8).round() as i64);
    let transform = |stamp_ns, (parent, child), pose| Transform { stamp_ns, parent, child, pose };
    let mount = transform(start, ("base_link", "os_sensor"), base_from_sensor());
    recording.write_static_pose(start, &mount).unwrap();
    for &tenths in known {
        let pose = map_from_base(tenths / 10.0);
        for (child, pose) in [("base_link", pose), ("person", Isometry3::identity())] {
            let moving = transform(at(tenths), ("map", child), pose);
            recording.write_pose(at(tenths), &moving).unwrap();
        }
    }
    for number in 0..5 {
        let mut message = Vec::new();
        let frame = in_map(&drive.frame(number), number as f64 / 10.0);
        cloud_message(&frame, &mut message).unwrap();
        let mut wire = CloudFormat::Ros2.decode(&message).unwrap();
        wire.frame_id = "map".to_owned();
        let mut named = Vec::new();
        wire.encode(&mut named).unwrap();
        recording.write_cloud(frame.stamp_ns, &named).unwrap();
    }
    recording.finish().unwrap();
    path
}

fn clustered(path: &Path, frames: CloudFrames) -> Vec<Clustered> {
    let config = AnnotateConfig { semantics: Semantics::Ground, frames, ..Default::default() };
    let clouds = EncodedClouds::open(path, Some(TOPIC), ..).unwrap();
    let of = |encoded: divmerge::Result<divmerge::frames::EncodedCloud>| {
        let encoded = encoded.unwrap();
        let wire = encoded.decode().unwrap();
        cluster(&wire, &encoded.key(&wire), &config).unwrap()
    };
    clouds.map(of).collect()
}

#[test]
fn clouds_in_a_map_are_seen_from_where_the_vehicle_was() {
    for sensor in [Sensor::Hdl32e, Sensor::Hap, Sensor::Mid360] {
        let folder = tempfile::tempdir().unwrap();
        let drive = Drive::new(sensor, Scene::Street, 3);
        // Between the clouds: at none of their stamps.
        let path = mapped(&folder, &drive, &[-0.5, 1.5, 2.5, 4.25]);
        let transforms = recorded_transforms(&SensorFrame::Auto, &path).unwrap();
        let found = clustered(&path, CloudFrames { transforms, ..CloudFrames::default() });

        let (mut recording, control) = create(&folder);
        for number in 0..5 {
            let mut message = Vec::new();
            cloud_message(&drive.frame(number), &mut message).unwrap();
            recording.write_cloud(drive.frame(number).stamp_ns, &message).unwrap();
        }
        recording.finish().unwrap();
        let expected = clustered(&control, CloudFrames::default());
        let mut all_large = [0, 0];
        for (number, (found, expected)) in found.iter().zip(&expected).enumerate() {
            let what = format!("{sensor} {number}");
            assert_eq!(remarks(found), [], "{what}");
            let band = &found.stages.image.bands[0];
            assert!(matches!(band.evidence, Evidence::Beams | Evidence::Recorded), "{what}");
            let sensor = band.sensor.translation.vector;
            let place = found.cloud.recorded(sensor.into());
            let there = (map_from_base(number as f64 / 10.0) * base_from_sensor()).translation;
            let off = (Vector3::from(place) - there.vector).norm();
            assert!(off < 0.05, "{what}: {off} m");
            let reasons = found.stages.mask.reason.iter().zip(&expected.stages.mask.reason);
            let same = reasons.filter(|(found, expected)| found == expected).count();
            let count = expected.stages.mask.reason.len();
            // Groups of a few points come and go with the rounding of the map's coordinates.
            let is_large = |instance: &&Instance| instance.points >= 30;
            let large = |of: &Clustered| of.stages.instances.iter().filter(is_large).count();
            let [many, control] = [found, expected].map(large);
            eprintln!(
                "{what}: {same} of {count} reasons, {many} of {control} large instances, {off:.3}"
            );
            assert!(100 * same > 98 * count, "{what}: {same} of {count}");
            all_large = [all_large[0] + many, all_large[1] + control];
        }
        let [many, control] = all_large;
        assert!(20 * many.abs_diff(control) <= control, "{sensor}: {many} for {control}");
    }
}

#[test]
fn clouds_without_transforms_at_their_time_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = mapped(&folder, &Drive::new(Sensor::Hap, Scene::Street, 3), &[0.5, 3.5]);
    let (run, _) = annotate(&path, &[]);
    let said = text(&run.stderr);
    assert!(run.status.success(), "{said}");
    assert!(said.contains("2 clouds at a time without transforms"), "{said}");
    assert_eq!(said.matches("no transforms of /tf lead from `map`").count(), 1, "{said}");
    let origin = ["--sensor-origin", "900,-40,13.8"];
    let (run, _) = annotate(&path, &origin);
    assert!(!text(&run.stderr).contains("transforms"), "the origin is said: {run:?}");
}
