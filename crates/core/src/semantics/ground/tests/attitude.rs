//! Tilted sensors, and how sure a verdict is.

use divmerge_simulate::{self as simulate, Drive, Sensor};

use super::*;

/// The same cloud seen by a sensor that is turned about x (roll) and then y (pitch), degrees.
fn turned(cloud: &PointCloud, roll: f32, pitch: f32) -> PointCloud {
    let turn = nalgebra::Rotation3::from_euler_angles(roll.to_radians(), pitch.to_radians(), 0.0);
    let positions = (0..cloud.len()).map(|point| {
        let turned = turn.inverse() * nalgebra::Point3::from(cloud.position(point));
        [turned.x, turned.y, turned.z]
    });
    let positions: Vec<[f32; 3]> = positions.collect();
    let along = |axis: usize| positions.iter().map(|position| position[axis]).collect();
    let turned = PointCloud::new(along(0), along(1), along(2)).unwrap();
    turned.organised(cloud.height, cloud.width).unwrap()
}

#[test]
fn verdicts_do_not_depend_on_the_sensors_attitude() {
    let (cloud, over_floor) = Scene::with([CAR]).scan();
    let expected = verdicts(&cloud);
    for (roll, pitch) in [(10.0, 0.0), (-15.0, 10.0), (180.0, 0.0), (165.0, 10.0)] {
        let found = verdicts(&turned(&cloud, roll, pitch));
        let seen = (0..cloud.len()).filter(|&point| over_floor[point].is_finite());
        let moved = seen.filter(|&point| found[point] != expected[point]).count();
        // The cells that choose the plane lie elsewhere, which may move the edge of an object by a
        // pixel.
        assert!(moved * 200 < cloud.len(), "{roll} {pitch}: {moved} of {}", cloud.len());
    }
}

#[test]
fn ground_is_found_with_z_down_and_from_a_lorry() {
    const GROUND: [u16; 6] = [40, 44, 48, 49, 60, 72];
    let sensors = [Sensor::Hdl64e, Sensor::Vlp16, Sensor::Os1_128];
    let scenes = [simulate::Scene::Street, simulate::Scene::Parking];
    for (sensor, scene) in sensors.into_iter().flat_map(|s| scenes.map(|scene| (s, scene))) {
        // In the car parks of 203 and 204 the roofs of cars lie on a plane beside the sensor.
        for (seed, height, pitch, is_z_down) in [
            (201, None, 0.0, true),
            (201, None, 10.0, true),
            (203, None, 10.0, true),
            (204, None, 10.0, true),
            (201, Some(3.0), 0.0, false),
        ] {
            let mut drive = Drive::new(sensor, scene, seed);
            drive.mount.pitch = f64::to_radians(pitch);
            drive.mount.height = height.unwrap_or(drive.mount.height);
            let mut columns = drive.frame(7).cloud.into_columns();
            if is_z_down {
                columns.y.iter_mut().chain(&mut columns.z).for_each(|along| *along = -*along);
            }
            let class = columns.class.take().expect("a simulated cloud has classes");
            let (ring, height) = (columns.ring.take(), columns.height);
            let cloud = PointCloud::new(columns.x, columns.y, columns.z).unwrap();
            let cloud = cloud.organised(height, columns.width).unwrap();
            let cloud = cloud.with(|columns| columns.ring = ring).unwrap();
            let f1 = f1(&cloud, class.iter().map(|class| GROUND.contains(class)));
            assert!(f1 > 0.9, "{sensor} in {scene} {seed}, {pitch} degrees, {is_z_down}: {f1}");
        }
    }
}

#[test]
fn nothing_below_the_floor_is_ground() {
    let (mut cloud, over_floor) = Scene { rows: 64, columns: 720, ..Scene::with([CAR]) }.scan();
    let floor: Vec<usize> = (0..cloud.len()).filter(|&i| over_floor[i].abs() < 1e-6).collect();
    // One return in thirty comes back from farther along its beam, as from a mirror.
    let mut ghosts: Vec<usize> = floor.iter().copied().filter(|&i| jitter(i) > 0.933).collect();
    for &ghost in &ghosts {
        cloud.set_position(ghost, cloud.position(ghost).map(|along| along * 1.6));
    }
    let found = verdicts(&cloud);
    // From 20 m on a drop of a metre lies on a slope as gentle as a road's.
    ghosts.retain(|&ghost| cloud.squared_range(ghost) < 20.0 * 20.0);
    let taken = ghosts.iter().filter(|&&ghost| found[ghost]).count();
    let untouched: Vec<usize> = floor.into_iter().filter(|&i| jitter(i) <= 0.933).collect();
    let kept = untouched.iter().filter(|&&point| found[point]).count();
    assert!(ghosts.len() > 500 && taken * 20 < ghosts.len(), "{taken} of {}", ghosts.len());
    assert!(kept * 100 > untouched.len() * 98, "{kept} of {}", untouched.len());
}

#[test]
fn confidence_agrees_with_the_verdict_and_falls_with_height() {
    let (cloud, over_floor) = Scene::with([CAR]).scan();
    let image = RangeImage::new(&cloud, &ProjectionParams::default());
    let found = ground(&cloud, &image, &GroundParams::default());
    let mean = |above: f64, below: f64| {
        let inside = (0..cloud.len()).filter(|&i| (above..below).contains(&over_floor[i]));
        let (sum, count) =
            inside.fold((0.0, 0), |(sum, count), i| (sum + found.confidence[i], count + 1));
        assert!(count > 20, "{count} returns {above} to {below} m over the floor");
        sum / count as f32
    };
    for (point, &share) in found.confidence.iter().enumerate() {
        assert!((0.0..=1.0).contains(&share));
        assert_eq!(share >= 0.5, found.is_ground[point]);
        assert!(cloud.is_return(point) || share == 0.0);
    }
    assert!(mean(-0.01, 0.01) > 0.95);
    assert!(mean(0.5, 1.6) < 0.05);
}

#[test]
fn surface_follows_a_slope_and_leaves_out_what_stands_on_it() {
    let slope = |x: f32, y: f32| 0.1 * x - 0.05 * y - 1.7;
    let floor = (0..40).flat_map(|i| (0..40).map(move |j| [i as f32 - 19.5, j as f32 - 19.5]));
    let positions = floor.map(|[x, y]| {
        let is_box = (4.0..7.0).contains(&x) && (4.0..7.0).contains(&y);
        [x, y, slope(x, y) + if is_box { 0.4 } else { 0.0 }]
    });
    let params = GroundParams::default();
    let surface = surface::Surface::new(&HeightMap::finest(positions, &params));
    for (x, y) in [(0.3, 0.3), (5.5, 5.5), (-12.0, 9.0)] {
        let over = |above: f32| surface.over([x, y, slope(x, y) + above], true);
        assert!(over(0.0).abs() < 0.3 && over(0.4) > 1.5, "{x} {y}: {} {}", over(0.0), over(0.4));
    }
    assert!(surface.over([90.0, 0.0, -1.7], true).is_nan());
}
