//! Geometry that is found without a parameter, on simulated sensors of every kind.

use std::f64::consts::PI;

use divmerge::annotate::{
    AnnotateConfig, Annotated, MessageTypes, Semantics, annotate_message, remarks,
};
use divmerge::cloud::CloudFrames;
use divmerge::cloud::sensor_frame::SensorFrame;
use divmerge::datasets::cloud_recording::{CloudRecording, Transform};
use divmerge::datasets::drive::cloud_message;
use divmerge::frames::{EncodedCloud, transforms};
use divmerge::messages::clouds::CloudFormat;
use divmerge::pipeline::{self, Config};
use divmerge::range_image::{Geometry, NO_NEIGHBOUR, Projection, ProjectionParams, RangeImage};
use divmerge::recording::WriteOptions;
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Rig, Scene, Sensor, SimulatedFrame};
use divmerge::{PointCloud, PointColumns, Taxonomy};

fn frame(sensor: Sensor) -> SimulatedFrame {
    Drive::new(sensor, Scene::Street, 2).frame(5)
}

fn look(cloud: &PointCloud) -> (RangeImage, Geometry) {
    let image = RangeImage::new(cloud, &ProjectionParams::default());
    let geometry = Geometry::new(cloud, &image);
    (image, geometry)
}

#[test]
fn beams_and_columns_of_every_sensor_are_found() {
    use Projection::{Organised, Ring, UniformElevation};
    for sensor in Sensor::ALL {
        let (image, geometry) = look(&frame(sensor).cloud);
        let expected = match sensor {
            _ if sensor.is_organised() => Organised,
            Sensor::M1 | Sensor::Hap | Sensor::Mid360 => UniformElevation,
            _ => Ring,
        };
        assert_eq!(image.projection, expected, "{sensor}");
        let found = &geometry.sensors[0];
        assert_eq!(found.closes, sensor.closes(), "{sensor}: {found:?}");
        assert_eq!(image.wraps, sensor.closes(), "{sensor}");
        assert_eq!(found.stands, None, "{sensor}");
        if expected != UniformElevation {
            assert_eq!(image.rows(), sensor.beams(), "{sensor}");
            let off = image.columns().abs_diff(sensor.columns());
            assert!(off * 100 <= sensor.columns(), "{sensor}: {} columns", image.columns());
        }
        if !sensor.closes() {
            let [start, width] = found.azimuth_degrees;
            assert!((start + 60.0).abs() < 3.0 && (width - 120.0).abs() < 3.0, "{found:?}");
        }
    }
}

fn without_ring(cloud: PointCloud) -> PointCloud {
    cloud.with(|columns| columns.ring = None).expect("fewer columns")
}

#[test]
fn uneven_beams_without_a_ring_are_found_in_the_elevations() {
    for sensor in [Sensor::Hdl32e, Sensor::Vlp32c, Sensor::Vls128, Sensor::Helios] {
        let cloud = without_ring(frame(sensor).cloud);
        let (image, _) = look(&cloud);
        assert_eq!((image.projection, image.rows()), (Projection::Elevations, sensor.beams()));
    }
}

#[test]
fn a_module_number_is_no_beam() {
    let with = frame(Sensor::M1).cloud;
    let rings = with.ring.clone().expect("modules");
    assert!(rings.iter().all(|ring| (1..=5).contains(ring)));
    let without = without_ring(with.clone());
    assert_eq!(look(&with).0, look(&without).0);
}

#[test]
fn both_returns_of_a_beam_are_kept_and_the_nearest_leads() {
    let adjacent = frame(Sensor::Pandar40pDual);
    let halves = in_halves(&adjacent.cloud);
    for cloud in [&adjacent.cloud, &halves] {
        let (image, geometry) = look(cloud);
        assert!((1780..=1820).contains(&image.columns()), "{}", image.columns());
        assert!(geometry.multiple_returns > 0.05, "{}", geometry.multiple_returns);
        for point in (0..cloud.len()).filter(|&point| image.is_shadowed(point)) {
            let pixel = image.pixel_of(point).expect("a pixel");
            let leader = image.point_at(pixel).expect("a leader");
            assert!(cloud.squared_range(leader) <= cloud.squared_range(point));
        }
        let taxonomy = Taxonomy::semantic_kitti();
        let stages = pipeline::run(cloud, MaskSource::Classes(&taxonomy), &Config::best());
        let objects = (0..cloud.len()).filter(|&point| stages.mask.is_object[point]);
        let (farther, nearer): (Vec<usize>, Vec<usize>) =
            objects.partition(|&point| stages.image.is_shadowed(point));
        let labelled = |points: &[usize]| {
            points.iter().filter(|&&p| stages.labels.instance[p] != 0).count() as f64
        };
        assert_eq!(labelled(&nearer), nearer.len() as f64);
        assert!(farther.len() > 100, "{}", farther.len());
        assert!(labelled(&farther) > 0.98 * farther.len() as f64, "of {}", farther.len());
    }
    let single = look(&frame(Sensor::Vlp16).cloud).1;
    assert!(single.multiple_returns < 0.01, "{}", single.multiple_returns);
}

/// All farther returns behind all others.
fn in_halves(cloud: &PointCloud) -> PointCloud {
    let unit = |point: usize| {
        let at = cloud.position(point).map(f64::from);
        at.map(|along| along / cloud.squared_range(point).sqrt())
    };
    let is_farther = |point: usize| {
        point + 1 < cloud.len()
            && (0..3).all(|i| (unit(point)[i] - unit(point + 1)[i]).abs() < 1e-6)
    };
    let (farther, nearer): (Vec<usize>, Vec<usize>) =
        (0..cloud.len()).partition(|&p| is_farther(p));
    assert!(farther.len() * 40 > cloud.len(), "{} second returns", farther.len());
    let order: Vec<usize> = nearer.into_iter().chain(farther).collect();
    let floats = |column: &[f32]| order.iter().map(|&p| column[p]).collect();
    let words = |column: &Vec<u16>| order.iter().map(|&p| column[p]).collect();
    let columns = PointColumns {
        x: floats(&cloud.x),
        y: floats(&cloud.y),
        z: floats(&cloud.z),
        ring: cloud.ring.as_ref().map(words),
        class: cloud.class.as_ref().map(words),
        ..cloud.clone().into_columns()
    };
    columns.checked().expect("as many of each")
}

#[test]
fn staggered_rows_are_brought_into_line() {
    let (staggered, geometry) = look(&frame(Sensor::Os1_64Staggered).cloud);
    // 4.2 degrees are 12 columns of 1024.
    assert_eq!((geometry.stagger, staggered.rows()), (12, 64));
    let (plain, geometry) = look(&frame(Sensor::Os1_64Gradient).cloud);
    assert_eq!(geometry.stagger, 0);
    for (image, cloud) in [
        (&staggered, frame(Sensor::Os1_64Staggered).cloud),
        (&plain, frame(Sensor::Os1_64Gradient).cloud),
    ] {
        let azimuth = |point: usize| f64::from(cloud.y[point]).atan2(f64::from(cloud.x[point]));
        for column in (0..1024).step_by(37) {
            let seen = (0..64).filter_map(|row| image.point_at(row * 1024 + column));
            let around: Vec<f64> = seen.map(azimuth).collect();
            let apart = around.windows(2).map(|pair| (pair[0] - pair[1]).abs() % (2.0 * PI));
            let most = apart.map(|apart| apart.min(2.0 * PI - apart)).fold(0.0, f64::max);
            assert!(most.to_degrees() < 0.6, "column {column}: {}", most.to_degrees());
        }
    }
}

#[test]
fn rows_that_are_no_sweeps_are_not_taken_for_beams() {
    // Two rows: all first returns, and all of them once more.
    let cloud = frame(Sensor::Vlp16).cloud;
    let twice = |column: &[f32]| [column, column].concat();
    let (x, y, z) = (twice(&cloud.x), twice(&cloud.y), twice(&cloud.z));
    let ring = cloud.ring.as_ref().map(|ring| [&ring[..], &ring[..]].concat());
    let stacked = PointCloud::new(x, y, z).unwrap().organised(2, cloud.len()).unwrap();
    let stacked = stacked.with_ring(ring.expect("rings")).unwrap();
    let (image, _) = look(&stacked);
    assert_eq!((image.projection, image.rows()), (Projection::Ring, 16));
    assert_eq!(image.columns(), look(&cloud).0.columns());
}

#[test]
fn merged_sensors_have_an_image_each() {
    let merged = Rig::robotaxi(Scene::Street, 2).frame(5);
    let taxonomy = Taxonomy::semantic_kitti();
    let stages = pipeline::run(&merged.cloud, MaskSource::Classes(&taxonomy), &Config::best());
    let image = &stages.image;
    assert_eq!(image.projection, Projection::Sources);
    let rows: Vec<usize> = image.bands.iter().map(|band| band.rows.len()).collect();
    assert_eq!(rows, [32, 16, 16]);
    let expected = [[0.3, 0.0, 2.0], [2.0, 0.9, 1.0], [2.0, -0.9, 1.0]];
    for (band, expected) in image.bands.iter().zip(expected) {
        let found = band.sensor.translation.vector;
        assert!((found - nalgebra::Vector3::from(expected)).norm() < 0.05, "{found}");
    }
    let band =
        |object: usize| image.band_of_row(stages.objects.pixel[object] as usize / image.columns());
    for (object, neighbours) in stages.objects.neighbours.iter().enumerate() {
        for &neighbour in neighbours.iter().filter(|&&n| n != NO_NEIGHBOUR) {
            assert_eq!(band(object), band(neighbour as usize));
        }
    }
    // Most things that two sensors see well are one instance.
    let source = merged.cloud.source.as_ref().expect("sources");
    let (mut one, mut all) = (0, 0);
    for id in 1..=*merged.true_instance.iter().max().unwrap() {
        let of = |sensor: u16| {
            let points = (0..merged.cloud.len())
                .filter(|&p| merged.true_instance[p] == id && source[p] == sensor);
            let mut ids: Vec<u32> = points.map(|p| stages.labels.instance[p]).collect();
            ids.sort_unstable();
            (ids.len() >= 50).then(|| ids[ids.len() / 2])
        };
        if let (Some(a), Some(b)) = (of(0), of(1).or(of(2))) {
            all += 1;
            one += usize::from(a == b);
        }
    }
    assert!(all >= 5 && one * 10 >= all * 9, "{one} of {all}");
}

#[test]
fn a_source_of_one_value_is_no_source() {
    let plain = frame(Sensor::Vlp16).cloud;
    let sources = Some(vec![3; plain.len()]);
    let one = plain.clone().with(|columns| columns.source = sources).expect("one for each");
    assert_eq!(look(&one).0, look(&plain).0);
}

/// Share of the ground points that ground removal finds, and of what it finds that is ground.
fn ground_shares(cloud: &PointCloud) -> [f64; 2] {
    let ground = GroundParams::default();
    let stages = pipeline::run(cloud, MaskSource::NotGround(&ground), &Config::best());
    let is_ground = |p: usize| [40, 44, 48, 49, 60, 72].contains(&cloud.class.as_ref().unwrap()[p]);
    let found = |p: usize| stages.labels.reason[p] == divmerge::cloud::Reason::Ground;
    let count = |of: &dyn Fn(usize) -> bool| (0..cloud.len()).filter(|&p| of(p)).count() as f64;
    let both = count(&|p| is_ground(p) && found(p));
    [both / count(&is_ground), both / count(&found)]
}

#[test]
fn the_ground_is_found_in_the_frame_of_the_vehicle() {
    let lift = |columns: &mut PointColumns| columns.z.iter_mut().for_each(|z| *z += 1.8);
    let lifted = frame(Sensor::Hdl32e).cloud.with(lift).expect("as many of each");
    let rig = Rig::robotaxi(Scene::Street, 2);
    for cloud in [lifted, rig.frame(5).cloud, rig.anonymous(5).cloud] {
        let shares = ground_shares(&cloud);
        assert!(shares.iter().all(|&share| share > 0.95), "{shares:?}");
    }
}

/// The clouds of the street seen by a sensor that hangs upside down, in its own frame.
fn hanging() -> SimulatedFrame {
    let mut drive = Drive::new(Sensor::Hdl32e, Scene::Street, 2);
    drive.mount.roll = PI;
    drive.frame(5)
}

fn annotated(
    frame: &SimulatedFrame,
    method: &AnnotateConfig,
) -> (Vec<u8>, Annotated, divmerge::annotate::Clustered) {
    let mut message = Vec::new();
    cloud_message(frame, &mut message).unwrap();
    let mut annotated = Annotated::default();
    let encoded = EncodedCloud::of_message(CloudFormat::Ros2, message.clone());
    let types = MessageTypes::default();
    let clustered = annotate_message(&encoded, method, &types, &mut annotated).unwrap();
    (message, annotated, clustered)
}

#[test]
fn an_upside_down_sensor_is_warned_of_and_turned() {
    let hanging = hanging();
    let mut method = AnnotateConfig { semantics: Semantics::Ground, ..AnnotateConfig::default() };
    let (_, _, clustered) = annotated(&hanging, &method);
    let warnings = remarks(&clustered);
    let warning = warnings.iter().find(|(kind, _)| *kind == "with the ground overhead");
    assert!(warning.is_some_and(|(_, text)| text.contains("--sensor-frame")), "{warnings:?}");

    method.frames.sensor_frame = "180,0,0".parse().unwrap();
    let (message, written, turned) = annotated(&hanging, &method);
    assert!(remarks(&turned).is_empty());
    let (before, after) = (
        CloudFormat::Ros2.decode(&message).unwrap(),
        CloudFormat::Ros2.decode(&written.cloud).unwrap(),
    );
    for (before, after) in before.points().zip(after.points()) {
        assert_eq!(before, &after[..before.len()]);
    }
    // The box of each instance, written in the recording's frame, holds its points as they were
    // recorded.
    let recorded = &hanging.cloud;
    for instance in turned.stages.instances.iter().filter(|i| i.points >= 50) {
        let pose = turned.cloud.turned.inverse() * instance.bounds.pose();
        for point in
            (0..recorded.len()).filter(|&p| turned.stages.labels.instance[p] == instance.id)
        {
            let at = nalgebra::Point3::from(recorded.position(point).map(f64::from));
            let inside = pose.inverse_transform_point(&at);
            for (along, side) in inside.iter().zip(instance.bounds.size) {
                assert!(along.abs() <= side / 2.0 + 1e-3, "{instance:?}: {inside}");
            }
        }
    }
}

#[test]
fn axes_are_turned_and_turned_back() {
    let plain = frame(Sensor::Vlp16);
    let mut method = AnnotateConfig { semantics: Semantics::Ground, ..AnnotateConfig::default() };
    let (_, _, expected) = annotated(&plain, &method);
    // x to the right, y down, z ahead, as cameras have it.
    let mut camera = plain.clone();
    let PointColumns { x, y, z, .. } = &*plain.cloud;
    let negative = |column: &[f32]| column.iter().map(|along| -along).collect::<Vec<f32>>();
    let axes = (negative(y), negative(z), x.clone());
    let camera_cloud = plain.cloud.clone();
    let turned = camera_cloud.with(|columns| (columns.x, columns.y, columns.z) = axes);
    camera.cloud = turned.expect("as many of each");
    method.frames.sensor_frame = "rdf".parse().unwrap();
    let (_, _, found) = annotated(&camera, &method);
    assert_eq!(found.stages.labels, expected.stages.labels);
    let ahead = [10.0, 2.0, -1.0];
    assert_eq!(found.cloud.recorded(ahead).map(|x| (x * 1e9).round() / 1e9), [-2.0, 1.0, 10.0]);
}

#[test]
fn recorded_transforms_say_which_way_is_up() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hanging.mcap");
    let mut recording =
        CloudRecording::create(CloudFormat::Ros2, &path, "/points", &WriteOptions::default())
            .unwrap();
    let pose = nalgebra::Isometry3::from_parts(
        nalgebra::Translation3::new(0.0, 0.0, 2.0),
        nalgebra::UnitQuaternion::from_euler_angles(PI, 0.0, 0.3),
    );
    let transform = Transform { stamp_ns: 1, parent: "base_link", child: "lidar", pose };
    recording.write_static_pose(1, &transform).unwrap();
    let mut message = Vec::new();
    cloud_message(&hanging(), &mut message).unwrap();
    recording.write_cloud(2, &message).unwrap();
    recording.finish().unwrap();

    let frames = CloudFrames { transforms: transforms(&path).unwrap(), ..CloudFrames::default() };
    let method =
        AnnotateConfig { frames, semantics: Semantics::Ground, ..AnnotateConfig::default() };
    assert_eq!(method.frames.sensor_frame, SensorFrame::Auto);
    let (_, _, clustered) = annotated(&hanging(), &method);
    assert!(remarks(&clustered).is_empty());
    assert!((clustered.cloud.turned.angle() - PI).abs() < 1e-9);
}

#[test]
fn sizes_that_are_asked_for_are_what_comes_out() {
    let cloud = frame(Sensor::Hdl32e).cloud;
    let params = ProjectionParams {
        rows: Some(20),
        columns: Some(900),
        field_of_view: Some((0.1, -0.4)),
        ..ProjectionParams::default()
    };
    let image = RangeImage::new(&cloud, &params);
    assert_eq!(image.projection, Projection::UniformElevation);
    assert_eq!((image.rows(), image.columns()), (20, 900));
    let columns_alone = ProjectionParams { columns: Some(900), ..ProjectionParams::default() };
    let image = RangeImage::new(&cloud, &columns_alone);
    assert_eq!((image.projection, image.rows(), image.columns()), (Projection::Ring, 32, 900));
}

#[test]
fn a_cloud_in_the_order_of_firing_is_no_image_whatever_its_shape_says() {
    let upright = frame(Sensor::Os1_64Gradient).cloud;
    let (rows, columns) = (upright.height, upright.width);
    // Shot by shot, all beams of one after the other, under the shape of the image.
    let order: Vec<usize> =
        (0..columns).flat_map(|c| (0..rows).map(move |r| r * columns + c)).collect();
    let taken = |column: &[f32]| order.iter().map(|&point| column[point]).collect::<Vec<f32>>();
    let ring: Vec<u16> = order.iter().map(|&point| (point / columns) as u16).collect();
    let fired = PointCloud::new(taken(&upright.x), taken(&upright.y), taken(&upright.z)).unwrap();
    let fired = fired.organised(rows, columns).unwrap().with_ring(ring).unwrap();
    let (image, geometry) = look(&fired);
    assert_eq!((image.projection, image.rows()), (Projection::Ring, rows));
    assert!(geometry.sensors[0].closes);
    assert!(image.columns().abs_diff(columns) * 50 <= columns, "{} columns", image.columns());
    // What is declared shot by shot is an image with a beam in each column.
    let declared = fired.organised(columns, rows).unwrap();
    let (image, _) = look(&declared);
    assert_eq!((image.projection, image.rows()), (Projection::OrganisedTransposed, rows));
}
