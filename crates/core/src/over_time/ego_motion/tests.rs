//! Known motions through rooms of planes.

use nalgebra::{Isometry3, Vector3};

use super::*;
use crate::cloud::PointCloud;

/// Points of a room with a floor, and walls, as a sensor at a pose sees them, farther
/// than 30 m not. No two frames have the same points of a surface.
fn room(world_from_sensor: &Isometry3<f64>, frame: usize, size: [f64; 2]) -> PointCloud {
    let phase = (frame * 7 % 10) as f64 * 0.02;
    let steps = |from: f64, to: f64| {
        (0..).map(move |step| from + phase + 0.2 * f64::from(step)).take_while(move |&at| at < to)
    };
    let [x_end, y_end] = size.map(|whole| whole / 2.0);
    let mut points = Vec::new();
    for x in steps(-x_end, x_end) {
        points.extend(steps(-y_end, y_end).map(|y| [x, y, -1.5]));
        points.extend(steps(-1.5, 2.5).flat_map(|z| [[x, -y_end, z], [x, y_end, z]]));
    }
    for z in steps(-1.5, 2.5) {
        points.extend(steps(-y_end, y_end).flat_map(|y| [[-x_end, y, z], [x_end, y, z]]));
    }
    let sensor_from_world = world_from_sensor.inverse();
    let seen = points.iter().map(|&point| sensor_from_world * nalgebra::Point3::from(point));
    let seen: Vec<_> = seen.filter(|point| point.coords.norm() < 30.0).collect();
    let axis = |axis: usize| seen.iter().map(|point| point[axis] as f32).collect::<Vec<f32>>();
    PointCloud::new(axis(0), axis(1), axis(2)).unwrap()
}

const HALL: [f64; 2] = [24.3, 16.7];

fn scan(cloud: &PointCloud) -> RegistrationScan {
    RegistrationScan::from_points(cloud, &ScanParams::default(), |_| false)
}

/// A pose on an arc that begins at rest.
fn arc(frame: usize) -> Isometry3<f64> {
    let way = 0.02 * (frame * frame) as f64;
    Isometry3::new(Vector3::new(way, 0.1 * way, 0.0), Vector3::new(0.0, 0.0, 0.1 * way))
}

/// The estimates along poses, ten a second.
fn estimates(poses: &[Isometry3<f64>], size: [f64; 2]) -> Vec<MotionEstimate> {
    let mut estimator = EgoMotion::new(EgoMotionParams::default());
    let scans = (0..).zip(poses).map(|(frame, pose)| scan(&room(pose, frame, size)));
    scans.map(|scan| estimator.push(&scan, 0.1)).collect()
}

#[test]
fn known_steps_through_a_hall_are_found() {
    let poses: Vec<_> = (0..14).map(arc).collect();
    let found = estimates(&poses, HALL);
    assert!(found[0].began_anew && found[0].is_tracked());
    for (pose, found) in poses.iter().zip(&found) {
        let error = pose.inv_mul(&found.world_from_sensor);
        assert!(found.is_tracked(), "{found:?}");
        assert!(error.translation.vector.norm() < 0.02, "{error:?}");
        assert!(error.rotation.angle() < 0.002, "{error:?}");
    }
    for pair in found.windows(2) {
        let step = pair[0].world_from_sensor.inv_mul(&pair[1].world_from_sensor);
        assert!(
            (step.translation.vector - pair[1].previous_from_current.translation.vector).norm()
                < 1e-9
        );
        assert!(!pair[1].began_anew && pair[1].step_seconds == 0.1);
    }
}

#[test]
fn the_first_step_may_be_long() {
    let step = Isometry3::new(Vector3::new(2.6, 0.3, 0.0), Vector3::new(0.0, 0.0, 0.03));
    let found = estimates(&[Isometry3::identity(), step], HALL);
    let error = step.inv_mul(&found[1].world_from_sensor);
    assert!(found[1].is_tracked() && error.translation.vector.norm() < 0.02, "{found:?}");
}

#[test]
fn a_sensor_at_rest_stays_where_it_is() {
    let found = estimates(&[Isometry3::identity(); 40], HALL);
    let last = found.last().unwrap();
    assert!(last.is_tracked() && last.world_from_sensor.translation.vector.norm() < 1e-2);
}

#[test]
fn along_a_corridor_without_ends_the_prediction_holds() {
    let poses: Vec<_> =
        (0..8).map(|frame| Isometry3::translation(0.1 * frame as f64, 0.0, 0.0)).collect();
    let long = [200.0, 6.3];
    let found = estimates(&poses, long);
    let hall = estimates(&poses, HALL);
    for (corridor, hall) in found.iter().zip(&hall).skip(1) {
        assert!(corridor.is_tracked() && corridor.fit.weakest_direction < 0.01, "{corridor:?}");
        assert!(hall.fit.weakest_direction > 0.05, "{hall:?}");
        let [_, y, z] = corridor.world_from_sensor.translation.vector.into();
        assert!(y.abs() < 0.02 && z.abs() < 0.02, "{corridor:?}");
    }
}

#[test]
fn what_has_no_points_is_lost_and_bridged() {
    let mut estimator = EgoMotion::new(EgoMotionParams::default());
    let empty = RegistrationScan::default();
    let lost = estimator.push(&empty, 0.1);
    assert_eq!(lost.lost, Some(LostReason::TooFewPoints));
    let at = |frame: usize| {
        scan(&room(&Isometry3::translation(0.1 * frame as f64, 0.0, 0.0), frame, HALL))
    };
    assert!(estimator.push(&at(0), 0.1).began_anew);
    estimator.push(&at(1), 0.1);
    assert_eq!(estimator.push(&empty, 0.1).lost, Some(LostReason::TooFewPoints));
    let after = estimator.push(&at(3), 0.1);
    assert!(after.is_tracked() && !after.began_anew && after.step_seconds == 0.2, "{after:?}");
    assert!((after.previous_from_current.translation.x - 0.2).abs() < 0.02, "{after:?}");
}

#[test]
fn another_place_is_lost_and_then_begins_anew() {
    let mut estimator = EgoMotion::new(EgoMotionParams::default());
    for frame in 0..3 {
        estimator.push(&scan(&room(&Isometry3::identity(), frame, HALL)), 0.1);
    }
    let elsewhere = Isometry3::new(Vector3::new(0.0, 0.0, 12.0), Vector3::new(0.0, 0.0, 0.7));
    let place = |frame: usize| scan(&room(&elsewhere, frame, [9.1, 7.7]));
    let lost = estimator.push(&place(3), 0.1);
    assert!(!lost.is_tracked() && !lost.began_anew, "{lost:?}");
    let anew = estimator.push(&place(4), 0.1);
    assert!(anew.is_tracked() && anew.began_anew, "{anew:?}");
    let next = estimator.push(&place(5), 0.1);
    assert!(next.is_tracked() && !next.began_anew, "{next:?}");
}

#[test]
fn odd_times_never_bridge_and_never_panic() {
    let mut estimator = EgoMotion::new(EgoMotionParams::default());
    let here = |frame: usize| scan(&room(&Isometry3::identity(), frame, HALL));
    estimator.push(&here(0), 0.0);
    assert_eq!(estimator.push(&here(1), 0.0).lost, Some(LostReason::RepeatedStamp));
    assert!(!estimator.push(&here(2), 0.1).began_anew);
    for dt in [-0.1, 600.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1e300, 1e300] {
        let found = estimator.push(&here(3), dt);
        assert!(
            found.began_anew && found.world_from_sensor.translation.vector.norm() < 0.1,
            "{dt}"
        );
        assert!(!estimator.push(&here(4), 0.1).began_anew, "{dt}");
        let empty = estimator.push(&RegistrationScan::default(), dt);
        assert!(!empty.is_tracked() && empty.world_from_sensor.translation.vector.norm() < 0.1);
        assert!(estimator.push(&here(5), 0.1).began_anew, "{dt}");
    }
}

#[test]
fn the_same_scans_give_the_same_bits() {
    let poses: Vec<_> = (0..6).map(arc).collect();
    assert_eq!(estimates(&poses, HALL), estimates(&poses, HALL));
}

#[test]
fn instances_of_objects_are_left_out() {
    use crate::cloud::taxonomy::Taxonomy;
    use crate::pipeline::{Config, run};
    use crate::semantics::MaskSource;

    let hall = room(&Isometry3::identity(), 0, HALL);
    let (car, building) = (10, 50);
    let is_car = |point: usize| hall.x[point] > 11.0;
    let class = (0..hall.len()).map(|point| if is_car(point) { car } else { building }).collect();
    let cloud = hall.clone().with_class(class).unwrap();
    let taxonomy = Taxonomy::semantic_kitti();
    let stages = run(&cloud, MaskSource::Classes(&taxonomy), &Config::best());
    let params = ScanParams::default();
    let found = RegistrationScan::new(&cloud, &stages, &params);
    assert_eq!(found, RegistrationScan::from_points(&cloud, &params, is_car));
    let reach = |scan: &RegistrationScan| scan.positions().map(|[x, ..]| x).fold(0.0, f64::max);
    assert!(reach(&found) < 11.01 && reach(&scan(&hall)) > 12.0);
}

proptest::proptest! {
    #[test]
    fn scans_of_any_bytes_are_read_back_and_registered(
        bytes in proptest::collection::vec(proptest::prelude::any::<u8>(), 0..3000),
    ) {
        match RegistrationScan::from_bytes(&bytes) {
            None => proptest::prop_assert!(bytes.len() % 6 != 0),
            Some(scan) => {
                proptest::prop_assert_eq!(scan.to_bytes(), bytes);
                let mut estimator = EgoMotion::new(EgoMotionParams::default());
                for dt in [0.1, 0.1, 0.3] {
                    let pose = estimator.push(&scan, dt).world_from_sensor;
                    proptest::prop_assert!(pose.translation.vector.norm() < 100.0);
                }
            }
        }
    }

    #[test]
    fn points_of_a_scan_are_points_of_the_cloud(
        picks in proptest::collection::vec((0..12_usize, 0..12_usize, 0..12_usize), 0..300),
    ) {
        let odd = [
            0.0, 1.0, -3.0, 1e-40, 1e38, -3e38, f32::NAN, f32::INFINITY, 79.999, -80.0, 25.0, 0.25,
        ];
        let axis = |of: fn(&(usize, usize, usize)) -> usize| {
            picks.iter().map(|pick| odd[of(pick)]).collect::<Vec<f32>>()
        };
        let cloud = PointCloud::new(axis(|p| p.0), axis(|p| p.1), axis(|p| p.2)).unwrap();
        let scan = scan(&cloud);
        for position in scan.positions() {
            let is_near = |point: usize| {
                let at = crate::cloud::wide(cloud.position(point));
                (0..3).all(|axis| (at[axis] - position[axis]).abs() < 0.006)
            };
            proptest::prop_assert!((0..cloud.len()).any(is_near));
        }
        let all = RegistrationScan::from_points(&cloud, &ScanParams::default(), |_| true);
        proptest::prop_assert!(all.is_empty());
    }
}
