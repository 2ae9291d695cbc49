//! Ring numbers that are no beams, and rows in the order of a sensor's channels.

use divmerge::PointCloud;
use divmerge::pipeline::{self, Config};
use divmerge::range_image::{Geometry, Projection, ProjectionParams, RangeImage, RingFlaw};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, Sensor};

fn sweep(sensor: Sensor, scene: Scene) -> PointCloud {
    Drive::new(sensor, scene, 6).frame(2).cloud
}

fn look(cloud: &PointCloud) -> (RangeImage, Geometry) {
    let image = RangeImage::new(cloud, &ProjectionParams::default());
    let geometry = Geometry::new(cloud, &image);
    (image, geometry)
}

fn with_rings(cloud: &PointCloud, ring: impl Fn(usize) -> u16) -> PointCloud {
    cloud.clone().with_ring((0..cloud.len()).map(ring).collect()).unwrap()
}

/// The cloud moved, as into the frame of a vehicle.
fn moved(cloud: &PointCloud, by: [f32; 3]) -> PointCloud {
    let change = |columns: &mut divmerge::PointColumns| {
        columns.x.iter_mut().for_each(|x| *x += by[0]);
        columns.y.iter_mut().for_each(|y| *y += by[1]);
        columns.z.iter_mut().for_each(|z| *z += by[2]);
    };
    cloud.clone().with(change).unwrap()
}

/// A number without pattern below 64.
fn noise(point: usize) -> u16 {
    ((point as u32).wrapping_mul(0x9E37_79B9) >> 26) as u16
}

const SPINNING: [Sensor; 5] =
    [Sensor::Vlp16, Sensor::Hdl32e, Sensor::Vlp32c, Sensor::Hdl64e, Sensor::Vls128];

#[test]
fn numbers_that_are_no_beams_change_nothing() {
    for sensor in SPINNING {
        for scene in [Scene::Street, Scene::Yard] {
            let cloud = sweep(sensor, scene);
            let rings = cloud.ring.as_ref().unwrap();
            // Two beams far from each other share a number.
            let shared = (sensor.beams() / 2) as u16;
            let without = cloud.clone().with(|columns| columns.ring = None).unwrap();
            let expected = look(&without).0;
            for (flaw, rings) in [
                (RingFlaw::Constant, with_rings(&cloud, |_| 0)),
                (RingFlaw::Constant, with_rings(&cloud, |_| 31)),
                (RingFlaw::Constant, with_rings(&cloud, |point| u16::from(point % 50 == 0))),
                (RingFlaw::Scattered, with_rings(&cloud, |point| noise(point) % 2)),
                (RingFlaw::Scattered, with_rings(&cloud, |point| noise(point) % 32)),
                (RingFlaw::Scattered, with_rings(&cloud, noise)),
                (RingFlaw::Repeated, with_rings(&cloud, |p| 2 * rings[p] + noise(p) % 2)),
                (RingFlaw::Scattered, with_rings(&cloud, |p| rings[p] % shared)),
                (RingFlaw::TooHigh, with_rings(&cloud, |point| point as u16)),
            ] {
                let (image, geometry) = look(&rings);
                assert_eq!(geometry.ring_flaw, Some(flaw), "{sensor} {scene}");
                assert_eq!(image, expected, "{sensor} {scene}: {flaw:?}");
            }
        }
    }
}

#[test]
fn beams_are_believed_wherever_the_sensor_stands() {
    for sensor in SPINNING {
        for scene in Scene::ALL {
            let cloud = sweep(sensor, scene);
            for by in [[0.0; 3], [1.0, 0.0, 1.8], [-0.4, 0.9, 0.6]] {
                let (image, geometry) = look(&moved(&cloud, by));
                assert_eq!(geometry.ring_flaw, None, "{sensor} {scene} {by:?}");
                assert_eq!(image.projection, Projection::Ring, "{sensor} {scene} {by:?}");
            }
        }
    }
}

/// An organised cloud with its rows in another order.
fn reordered(cloud: &PointCloud, order: &[usize], is_transposed: bool) -> PointCloud {
    let (rows, columns) = (cloud.height, cloud.width);
    let from = |at: usize| match is_transposed {
        true => order[at % rows] * columns + at / rows,
        false => order[at / columns] * columns + at % columns,
    };
    let pick = |column: &[f32]| (0..cloud.len()).map(|at| column[from(at)]).collect();
    let moved = PointCloud::new(pick(&cloud.x), pick(&cloud.y), pick(&cloud.z)).unwrap();
    let (height, width) = if is_transposed { (columns, rows) } else { (rows, columns) };
    moved.organised(height, width).unwrap()
}

/// The rows of a board that fires four groups of lasers, one after the other.
fn interleaved(rows: usize) -> Vec<usize> {
    (0..4).flat_map(|group| (group..rows).step_by(4)).collect()
}

#[test]
fn rows_in_the_order_of_channels_are_sorted() {
    for sensor in [Sensor::Os1_128, Sensor::Os1_64Gradient] {
        let cloud = sweep(sensor, Scene::Street);
        let sorted: Vec<usize> = (0..cloud.height).collect();
        let falling: Vec<usize> = sorted.iter().rev().copied().collect();
        let mut swapped = sorted.clone();
        swapped.swap(9, 12);
        let expected = look(&reordered(&cloud, &sorted, false)).0;
        for order in [interleaved(cloud.height), swapped] {
            for is_transposed in [false, true] {
                let shuffled = reordered(&cloud, &order, is_transposed);
                let image = look(&shuffled).0;
                assert_eq!(image.rows(), expected.rows());
                for (row, column) in [(0, 0), (7, 100), (20, 333), (image.rows() - 1, 512)] {
                    let seen = [(&image, &shuffled), (&expected, &cloud)].map(|(image, cloud)| {
                        let point = image.point_of_pixel[(row, column)];
                        (point != divmerge::range_image::NOWHERE)
                            .then(|| cloud.position(point as usize))
                    });
                    assert_eq!(seen[0], seen[1], "{sensor} row {row}, column {column}");
                }
                for point in (0..shuffled.len()).filter(|&point| shuffled.is_return(point)) {
                    let pixel = image.pixel_of(point).unwrap();
                    assert_eq!(image.point_of_pixel.values()[pixel] as usize, point);
                }
            }
        }
        let image = look(&reordered(&cloud, &falling, false)).0;
        assert!(!image.top_row_first, "{sensor}: rows from the lowest up stay as they stand");
    }
}

#[test]
fn rows_in_the_order_of_channels_are_clustered_as_sorted_ones() {
    let ground = GroundParams::default();
    let cloud = sweep(Sensor::Os1_128, Scene::Parking);
    let sorted: Vec<usize> = (0..cloud.height).collect();
    let [expected, found] = [sorted, interleaved(cloud.height)].map(|order| {
        let cloud = reordered(&cloud, &order, false);
        pipeline::run(&cloud, MaskSource::NotGround(&ground), &Config::best()).labels.counts()
    });
    assert_eq!(found, expected);
}
