//! Coordinates that are no returns, in other units, or left out on purpose.

use divmerge::annotate::{Annotated, Clustered, MessageTypes, annotate_message, remarks};
use divmerge::cloud::{Crop, LengthUnit};
use divmerge::datasets::drive::cloud_message;
use divmerge::frames::EncodedCloud;
use divmerge::messages::clouds::CloudFormat;
use divmerge::simulate::{Drive, Scene, Sensor, SimulatedFrame};
use divmerge::{AnnotateConfig, PointCloud, Reason, Semantics};

fn sweep(sensor: Sensor, scene: Scene) -> SimulatedFrame {
    Drive::new(sensor, scene, 8).frame(1)
}

/// The cloud with each position changed.
fn changed(cloud: &PointCloud, change: impl Fn([f32; 3]) -> [f32; 3]) -> PointCloud {
    let mut changed = cloud.clone();
    for point in 0..cloud.len() {
        changed.set_position(point, change(cloud.position(point)));
    }
    changed
}

fn returns(cloud: &PointCloud) -> Vec<bool> {
    (0..cloud.len()).map(|point| cloud.is_return(point)).collect()
}

fn annotated(frame: &SimulatedFrame, method: &AnnotateConfig) -> (Clustered, Annotated) {
    let mut message = Vec::new();
    cloud_message(frame, &mut message).unwrap();
    let mut annotated = Annotated::default();
    let encoded = EncodedCloud::of_message(CloudFormat::Ros2, message);
    let types = MessageTypes::default();
    let clustered = annotate_message(&encoded, method, &types, &mut annotated).unwrap();
    (clustered, annotated)
}

fn ground() -> AnnotateConfig {
    AnnotateConfig { semantics: Semantics::Ground, ..AnnotateConfig::default() }
}

#[test]
fn real_returns_are_kept_however_they_are_rounded() {
    for sensor in Sensor::ALL {
        for scene in Scene::ALL {
            let cloud = sweep(sensor, scene).cloud;
            let expected = returns(&cloud);
            let rounded =
                |step: f32| changed(&cloud, |at| at.map(|along| (along / step).round() * step));
            let scaled = |by: f32| changed(&cloud, |at| at.map(|along| along * by));
            // Beams that look down meet a plane.
            let flat = changed(&cloud, |[x, y, z]| {
                let steep = z / (x * x + y * y).sqrt();
                let down = if steep < -0.01 { -1.8 / z } else { 1.0 };
                if z.is_finite() { [x, y, z].map(|along| along * down) } else { [x, y, z] }
            });
            let moved = changed(&cloud, |[x, y, z]| [x + 3000.0, y - 200.0, z + 40.0]);
            for (what, cloud) in [
                ("as it is", cloud.clone()),
                ("in whole millimetres", rounded(0.001)),
                ("in whole centimetres", rounded(0.01)),
                ("in millimetres", scaled(1000.0)),
                ("in centimetres", scaled(100.0)),
                ("in a map", moved),
                ("without noise on level ground", flat.clone()),
            ] {
                let found = returns(&cloud.without_fill_values());
                assert!(found == expected, "{sensor} in {scene} {what}");
            }
        }
    }
}

#[test]
fn fill_values_are_no_returns_in_any_frame() {
    for sensor in [Sensor::Os1_128, Sensor::Os1_64Staggered] {
        let cloud = sweep(sensor, Scene::Street).cloud;
        let expected = returns(&cloud);
        assert!(expected.iter().filter(|is_return| !**is_return).count() > 1000, "{sensor}");
        let moved = changed(&cloud, |[x, y, z]| [x + 0.9, y - 0.05, z + 2.0]);
        assert_eq!(returns(&moved.without_fill_values()), expected, "{sensor} moved zeros");

        let direction = |point: usize| {
            let [row, column] = [point / cloud.width, point % cloud.width];
            let [azimuth, elevation] = sensor.direction(row, column);
            let (up, out) = elevation.sin_cos();
            [out * azimuth.cos(), out * azimuth.sin(), up]
        };
        for (range, by) in
            [(1000.0, 0.0), (1000.0, 2.0), (100_000.0, 2.0), (130.0, 0.0), (130.0, 2.0)]
        {
            let mut filled = cloud.clone();
            for point in (0..cloud.len()).filter(|&point| !cloud.is_return(point)) {
                filled.set_position(point, direction(point).map(|along| (along * range) as f32));
            }
            let filled = changed(&filled, |[x, y, z]| [x + by, y, z + by]);
            assert_eq!(returns(&filled.without_fill_values()), expected, "{sensor}: {range} m");
        }
    }
}

#[test]
fn units_are_read_and_written_or_remarked_on() {
    let mut frame = sweep(Sensor::Vlp16, Scene::Street);
    let (expected, in_metres) = annotated(&frame, &ground());
    assert_eq!(remarks(&expected), []);
    frame.cloud = changed(&frame.cloud, |at| at.map(|along| along * 1000.0));
    let (unread, _) = annotated(&frame, &ground());
    let kinds: Vec<&str> = remarks(&unread).into_iter().map(|(kind, _)| kind).collect();
    assert!(kinds.contains(&"in another unit than metres"), "{kinds:?}");

    let unit = Some(LengthUnit::Millimetre);
    let (found, written) = annotated(&frame, &AnnotateConfig { unit, ..ground() });
    assert_eq!(remarks(&found), []);
    assert_eq!(found.stages.instances.len(), expected.stages.instances.len());
    assert_eq!(found.stages.labels.counts(), expected.stages.labels.counts());
    assert_eq!(found.cloud.recorded([1.0, 2.0, 3.0]), [1000.0, 2000.0, 3000.0]);
    assert_eq!(found.cloud.from_recorded([1000.0, 2000.0, 3000.0]), [1.0, 2.0, 3.0]);
    // The boxes lie on the points of the recording: a thousand times as far and as large.
    assert_eq!(written.objects.len(), in_metres.objects.len());
    let numbers = |bytes: &[u8]| -> f64 {
        let eight = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap()));
        eight.filter(|value| value.is_finite() && value.abs() < 1e6).map(f64::abs).sum()
    };
    assert!(numbers(&written.objects[4..]) > 100.0 * numbers(&in_metres.objects[4..]));
}

#[test]
fn what_is_left_out_has_a_reason_of_its_own() {
    let frame = sweep(Sensor::Os1_128, Scene::Parking);
    let crop = Crop {
        min_range: Some(4.0),
        max_range: Some(30.0),
        region: Some("-20..20,..,..".parse().unwrap()),
        ego: Some("-6..6,-2..2,..".parse().unwrap()),
    };
    for semantics in [Semantics::Ground, Semantics::Auto, Semantics::All] {
        let method = AnnotateConfig { crop, semantics, ..AnnotateConfig::default() };
        let (found, _) = annotated(&frame, &method);
        for point in 0..frame.cloud.len() {
            let position = frame.cloud.position(point).map(f64::from);
            let reason = found.stages.labels.reason[point];
            let expected = match (frame.cloud.is_return(point), crop.keeps(position)) {
                (false, _) => reason == Reason::NoReturn,
                (true, false) => reason == Reason::Cropped,
                (true, true) => !matches!(reason, Reason::NoReturn | Reason::Cropped),
            };
            assert!(expected, "{reason:?} at {position:?}");
        }
        let counts = found.stages.labels.counts();
        assert!(counts[Reason::Cropped as usize] > 1000 && counts[0] > 1000, "{counts:?}");
    }
}
