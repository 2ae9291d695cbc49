use divmerge_simulate::{Drive, Mount, Scene, Sensor};
use nalgebra::{Isometry3, Point3, Translation3, Vector3};

use super::*;
use crate::range_image::ProjectionParams;
use crate::range_image::one_sensor::from_origin;

/// The third sweep of a drive, brought into another frame.
fn swept(
    sensor: Sensor,
    scene: Scene,
    mount: Mount,
    frame_from_sensor: &Isometry3<f64>,
) -> PointCloud {
    let mut drive = Drive::new(sensor, scene, 4);
    drive.mount = mount;
    let cloud = drive.frame(2).cloud;
    let moved = |point: usize| {
        let here = Point3::from(cloud.position(point).map(f64::from));
        if cloud.is_return(point) { frame_from_sensor * here } else { here }
    };
    let moved: Vec<Point3<f64>> = (0..cloud.len()).map(moved).collect();
    let column = |axis: usize| moved.iter().map(|at| at[axis] as f32).collect();
    let moved = PointCloud::new(column(0), column(1), column(2)).unwrap();
    let moved = moved.with(|columns| columns.ring = cloud.ring.clone()).unwrap();
    moved.organised(cloud.height, cloud.width).unwrap()
}

fn found(cloud: &PointCloud) -> Option<Viewpoint> {
    let image = from_origin(cloud, &ProjectionParams::default());
    if is_origin(cloud, &image) { None } else { find(cloud, &image) }
}

fn without_ring(cloud: PointCloud) -> PointCloud {
    cloud.with(|columns| columns.ring = None).unwrap()
}

#[track_caller]
fn assert_found(cloud: &PointCloud, expected: &Isometry3<f64>, what: &str) {
    let found = found(cloud).unwrap_or_else(|| panic!("{what}: nothing found"));
    assert_eq!(found.evidence, Evidence::Beams, "{what}");
    let off = (found.sensor.translation.vector - expected.translation.vector).norm();
    let leaning = (found.sensor * Vector3::z()).angle(&(expected * Vector3::z()));
    assert!(off < 0.05 && leaning < 0.005, "{what}: {off} m, {leaning} rad");
}

/// On the roof, level.
fn roof() -> Mount {
    Mount { ahead: 0.3, ..Mount::level(2.0) }
}

#[test]
fn finds_a_sensor_by_its_rings() {
    let corner =
        Mount { ahead: 2.0, left: 0.9, yaw: 0.8, pitch: 0.05, roll: -0.1, ..Mount::level(1.0) };
    for sensor in [Sensor::Vlp16, Sensor::Hdl32e, Sensor::Vls128, Sensor::Os1_128] {
        for mount in [roof(), corner] {
            let vehicle_from_sensor = mount.vehicle_from_sensor();
            let cloud = swept(sensor, Scene::Street, mount, &vehicle_from_sensor);
            assert_found(&cloud, &vehicle_from_sensor, &sensor.to_string());
        }
    }
}

/// From the origin, a fit runs away to where all rows look alike.
#[test]
fn finds_a_sensor_by_its_rings_wherever_the_cloud_lies() {
    for sensor in [Sensor::Hdl32e, Sensor::Os1_128] {
        for distance in [35.0, 400.0, 1200.0, 6000.0] {
            let map_from_sensor = Isometry3::translation(distance, -distance / 3.0, 12.0);
            let cloud = swept(sensor, Scene::Street, roof(), &map_from_sensor);
            assert_found(&cloud, &map_from_sensor, &format!("{sensor} at {distance} m"));
        }
    }
}

/// On level ground rings are circles from any height, which must not be taken for the sensor's.
#[test]
fn level_ground_does_not_hide_the_height() {
    for sensor in [Sensor::Vlp16, Sensor::Hdl32e] {
        let vehicle_from_sensor = roof().vehicle_from_sensor();
        let cloud = swept(sensor, Scene::Parking, roof(), &vehicle_from_sensor);
        assert_found(&cloud, &vehicle_from_sensor, &sensor.to_string());
    }
}

#[test]
fn finds_a_sensor_without_rings_wherever_the_cloud_lies() {
    let places = [(0.3, 0.0, 2.0), (20.0, 10.0, 2.0), (-150.0, 75.0, -3.0), (3000.0, 1500.0, 40.0)];
    for sensor in [Sensor::Vlp16, Sensor::Hdl32e, Sensor::Helios] {
        for (x, y, z) in places {
            let map_from_sensor = Isometry3::from(Translation3::new(x, y, z));
            let cloud = swept(sensor, Scene::Street, roof(), &map_from_sensor);
            assert_found(&without_ring(cloud), &map_from_sensor, &format!("{sensor} at {x} m"));
        }
    }
}

#[test]
fn the_origin_of_a_sensors_own_frame_is_believed() {
    for sensor in Sensor::ALL {
        let cloud = swept(sensor, Scene::Street, roof(), &Isometry3::identity());
        assert_eq!(found(&cloud), None, "{sensor}");
    }
}

#[test]
fn without_beams_a_frame_on_the_ground_is_seen_from_a_roof() {
    for sensor in [Sensor::M1, Sensor::Mid360] {
        let vehicle_from_sensor = roof().vehicle_from_sensor();
        let mut cloud = swept(sensor, Scene::Street, roof(), &vehicle_from_sensor);
        let place = found(&cloud).map(|found| (found.evidence, found.sensor.translation.z));
        let assumed = (sensor == Sensor::M1).then_some((Evidence::Assumed, 1.8));
        assert_eq!(place, assumed, "{sensor}: the other sees no ground near the origin");
        cloud.set_frame(true, &[Vector3::new(0.3, 0.0, 2.0)], true);
        let place = found(&cloud).map(|found| (found.evidence, found.sensor.translation.z));
        assert_eq!(place, Some((Evidence::Recorded, 2.0)), "{sensor}");
    }
}
