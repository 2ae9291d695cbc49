//! Small scenes, ray-cast: a sloped floor, boxes on it, and whether each return is of the floor.

mod attitude;
mod rooms;

use nalgebra::{Rotation3, Vector3};

use super::*;
use crate::cloud::PointCloud;
use crate::geometry::grid::Grid;
use crate::range_image::{Projection, ProjectionParams};

/// An axis-aligned box, lower and upper corner in metres, z over the floor under the sensor.
type Solid = [[f64; 3]; 2];

/// A scanner over a floor.
#[derive(Clone)]
struct Scene {
    rows: usize,
    columns: usize,
    /// Highest and lowest beam in degrees.
    beams: (f64, f64),
    /// Azimuths from first to last column in degrees.
    azimuths: (f64, f64),
    /// Height of the sensor over the floor in metres.
    sensor: f64,
    /// Roll and pitch of the sensor in degrees.
    attitude: (f64, f64),
    /// dz/dx of the floor.
    incline: f64,
    /// Amplitude of the range noise in metres.
    noise: f64,
    solids: Vec<Solid>,
}

impl Default for Scene {
    fn default() -> Self {
        Scene {
            rows: 32,
            columns: 360,
            beams: (5.0, -25.0),
            azimuths: (-180.0, 180.0),
            sensor: 1.7,
            attitude: (0.0, 0.0),
            incline: 0.0,
            noise: 0.0,
            solids: Vec::new(),
        }
    }
}

/// A box like a car, in front of the sensor.
const CAR: Solid = [[6.0, -1.0, 0.0], [10.0, 1.0, 1.5]];

impl Scene {
    fn with(solids: impl Into<Vec<Solid>>) -> Self {
        Scene { solids: solids.into(), ..Scene::default() }
    }

    /// The cloud, top row first, and N: height of each return over the floor, NaN without one.
    fn scan(&self) -> (PointCloud, Vec<f64>) {
        let (mut x, mut y, mut z) = (Vec::new(), Vec::new(), Vec::new());
        let mut over_floor = Vec::new();
        let (roll, pitch) = self.attitude;
        let turn = Rotation3::from_euler_angles(roll.to_radians(), pitch.to_radians(), 0.0);
        for pixel in 0..self.rows * self.columns {
            let beam = self.direction(pixel / self.columns, pixel % self.columns);
            let direction: [f64; 3] = (turn * Vector3::from(beam)).into();
            let range = self.cast(direction) + self.noise * jitter(pixel);
            let [seen, at] = [beam, direction].map(|unit| unit.map(|along| along * range));
            let is_return = range < 80.0;
            x.push(if is_return { seen[0] as f32 } else { f32::NAN });
            y.push(if is_return { seen[1] as f32 } else { f32::NAN });
            z.push(if is_return { seen[2] as f32 } else { f32::NAN });
            let height = at[2] + self.sensor - self.incline * at[0];
            over_floor.push(if is_return { height } else { f64::NAN });
        }
        let cloud = PointCloud::new(x, y, z).unwrap();
        (cloud.organised(self.rows, self.columns).unwrap(), over_floor)
    }

    fn direction(&self, row: usize, column: usize) -> [f64; 3] {
        let share = |index: usize, of: usize| index as f64 / of.max(1) as f64;
        let (top, bottom) = self.beams;
        let (first, last) = self.azimuths;
        let elevation = (top + (bottom - top) * share(row, self.rows - 1)).to_radians();
        let azimuth = (first + (last - first) * share(column, self.columns)).to_radians();
        let across = elevation.cos();
        [across * azimuth.cos(), across * azimuth.sin(), elevation.sin()]
    }

    /// Distance along a ray to the floor or the nearest solid.
    fn cast(&self, ray: [f64; 3]) -> f64 {
        let sinking = self.incline * ray[0] - ray[2];
        let floor = if sinking > 0.0 { self.sensor / sinking } else { f64::INFINITY };
        let hits = self.solids.iter().filter_map(|solid| self.hit(ray, solid));
        hits.fold(floor, f64::min)
    }

    fn hit(&self, ray: [f64; 3], [low, high]: &Solid) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let shift = if axis == 2 { self.sensor } else { 0.0 };
            let a = (low[axis] - shift) / ray[axis];
            let b = (high[axis] - shift) / ray[axis];
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter < leave).then_some(enter)
    }
}

/// A number in -1..1 that looks random.
fn jitter(seed: usize) -> f64 {
    let mixed = (seed as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mixed = (mixed ^ (mixed >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    (mixed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

fn verdicts(cloud: &PointCloud) -> Vec<bool> {
    let image = RangeImage::new(cloud, &ProjectionParams::default());
    ground(cloud, &image, &GroundParams::default()).is_ground
}

/// F1 of what is found against what is ground.
fn f1(cloud: &PointCloud, truth: impl Iterator<Item = bool>) -> f64 {
    let (mut both, mut all) = (0, 0);
    for (is_found, is_ground) in verdicts(cloud).into_iter().zip(truth) {
        both += 2 * u32::from(is_ground && is_found);
        all += u32::from(is_ground) + u32::from(is_found);
    }
    f64::from(both) / f64::from(all)
}

/// Share of ground among the returns `above` to `below` metres over the floor.
fn share_of_ground(scene: &Scene, above: f64, below: f64) -> f64 {
    let (cloud, over_floor) = scene.scan();
    let is_ground = verdicts(&cloud);
    let heights = over_floor.iter().zip(&is_ground);
    let inside = heights.filter(|(height, _)| (above..below).contains(*height));
    let (count, found) = inside.fold((0, 0), |(count, found), (_, &is_ground)| {
        (count + 1, found + usize::from(is_ground))
    });
    assert!(count > 50, "{count} returns {above} to {below} m over the floor");
    found as f64 / f64::from(count)
}

/// All but a few of the floor's returns are ground, and what stands on it is not. Rows far off are
/// metres apart, so that a box's first row there may pass for ground.
fn assert_separated(scene: &Scene) {
    let floor = share_of_ground(scene, -0.15, 0.01);
    let objects = share_of_ground(scene, 0.25, 50.0);
    assert!(floor > 0.98, "{floor} of the floor found");
    assert!(objects < 0.02, "{objects} of the objects taken for ground");
}

#[test]
fn box_on_a_plane_is_not_ground() {
    assert_separated(&Scene::with([CAR]));
}

#[test]
fn box_on_a_slope_is_not_ground() {
    let tilted =
        |incline| Scene { incline, ..Scene::with([[[6.0, -1.0, -2.0], [10.0, 1.0, 2.5]]]) };
    assert_separated(&tilted(0.1));
    assert_separated(&tilted(-0.1));
}

#[test]
fn sidewalk_behind_a_kerb_is_ground() {
    let scene = Scene::with([[[-60.0, 4.0, 0.0], [60.0, 9.0, 0.15]], CAR]);
    assert_separated(&scene);
    assert!(share_of_ground(&scene, 0.1499, 0.1501) > 0.97);
}

#[test]
fn walls_are_not_ground() {
    let wall = |height| Scene::with([[[-60.0, 5.0, 0.0], [60.0, 5.3, height]], CAR]);
    assert_separated(&wall(0.6));
    assert_separated(&wall(4.0));
}

#[test]
fn wall_is_rejected_down_to_its_foot() {
    let scene =
        Scene { rows: 128, columns: 90, ..Scene::with([[[5.0, -60.0, 0.0], [5.3, 60.0, 3.0]]]) };
    let foot = share_of_ground(&scene, 0.09, 0.2);
    assert!(foot < 0.05, "{foot} of the wall's foot taken for ground");
}

#[test]
fn height_map_knows_heights_where_ground_is_near() {
    let positions = [[10.2, 0.5, -1.75], [10.4, 0.5, -1.7], [10.6, 0.5, -1.65]];
    let heights = HeightMap::new(positions.into_iter(), &GroundParams::default());
    let near = |x, z| heights.is_near([x, 0.5, z]);
    assert!(near(10.9, -1.65) && !near(10.9, -1.55), "its own cell");
    assert!(near(11.5, -1.6) && !near(11.5, -1.5), "a coarser one, of a wider band");
    assert!(!near(30.0, -1.7) && !near(1e30, -1.7) && !near(f32::NAN, -1.7));
}

#[test]
fn ground_hidden_from_the_rest_is_found_by_its_height() {
    let (cloud, _) = Scene::default().scan();
    let image = RangeImage::new(&cloud, &ProjectionParams::default());
    let profile = Profile::new(&cloud, &image, &Level::IDENTITY);
    let params = GroundParams::default();
    let level = |seen: &profile::Return| if seen.exists() { 0.0 } else { f32::NAN };
    let mut slopes: Vec<f32> = profile.returns.iter().map(level).collect();
    // A ring that is not flat parts the near floor from the floor behind it.
    let parted = (0..slopes.len()).filter(|index| index % profile.rows == 4);
    parted.for_each(|index| slopes[index] = f32::NAN);
    let mut spread = FloodFill::new(&profile, &slopes, &params);
    spread.start(|[x, y, z]| x * x + y * y + z * z < 17.0);
    assert!(!spread.is_ground(5));
    let heights = HeightMap::new(spread.positions(), &params);
    spread.start(|position| heights.is_near(position));
    assert!(spread.is_ground(5));
}

#[test]
fn car_beside_the_sensor_is_not_where_ground_starts() {
    assert_separated(&Scene::with([[[-2.0, 1.2, 0.0], [2.0, 3.0, 1.4]], CAR]));
}

#[test]
fn sensors_low_and_high() {
    for (sensor, rows) in [(0.5, 16), (3.0, 128), (3.0, 16)] {
        assert_separated(&Scene { sensor, rows, ..Scene::with([CAR]) });
    }
}

#[test]
fn noise_of_three_centimetres() {
    let noise = 0.03 * 3.0_f64.sqrt();
    assert_separated(&Scene { noise, ..Scene::with([CAR]) });
}

#[test]
fn table_under_the_sensor_is_not_ground() {
    let scene = Scene {
        sensor: 1.1,
        beams: (5.0, -45.0),
        ..Scene::with([[[-0.8, -0.8, 0.0], [0.8, 0.8, 0.85]], CAR])
    };
    assert_separated(&scene);
}

#[test]
fn surface_at_the_sensors_height_is_not_ground() {
    let scene = Scene { sensor: 1.1, ..Scene::with([[[-30.0, -30.0, 0.0], [30.0, 30.0, 1.05]]]) };
    assert!(!verdicts(&scene.scan().0).contains(&true));
}

#[test]
fn ground_is_found_from_a_low_robot_and_from_a_mast() {
    const LORRY: Solid = [[28.0, -6.0, 0.0], [34.0, 6.0, 4.0]];
    let low = [(0.12, (10.0, -20.0)), (0.3, (15.0, -15.0))].map(|of| (of, CAR));
    let high = [(6.0, (15.0, -15.0)), (15.0, (10.0, -35.0))].map(|of| (of, LORRY));
    for ((sensor, beams), solid) in low.into_iter().chain(high) {
        assert_separated(&Scene { sensor, beams, ..Scene::with([solid]) });
    }
}

#[test]
fn ground_behind_a_wall_is_found() {
    let scene = Scene { sensor: 3.0, ..Scene::with([[[8.0, -60.0, 0.0], [8.5, 60.0, 1.2]]]) };
    assert_separated(&scene);
}

#[test]
fn bottom_row_first_gives_the_same() {
    let (cloud, _) = Scene::with([CAR]).scan();
    let columns = cloud.width;
    let upside_down = |values: &[f32]| values.chunks(columns).rev().flatten().copied().collect();
    let turned =
        PointCloud::new(upside_down(&cloud.x), upside_down(&cloud.y), upside_down(&cloud.z));
    let turned = turned.unwrap().organised(cloud.height, columns).unwrap();
    let image = RangeImage::new(&turned, &ProjectionParams::default());
    assert!(!image.top_row_first);
    let expected = verdicts(&cloud);
    let found = verdicts(&turned);
    let found: Vec<bool> = found.chunks(columns).rev().flatten().copied().collect();
    assert_eq!(found, expected);
    assert!(expected.contains(&true));
}

#[test]
fn spread_crosses_the_seam_only_where_the_image_wraps() {
    let (cloud, _) = Scene::default().scan();
    let mut image = RangeImage::new(&cloud, &ProjectionParams::default());
    for wraps in [true, false] {
        image.wraps = wraps;
        let profile = Profile::new(&cloud, &image, &Level::IDENTITY);
        let mut slopes = vec![f32::NAN; profile.returns.len()];
        let (first, last) = (0, (profile.columns - 1) * profile.rows);
        (slopes[first], slopes[last]) = (0.0, 0.0);
        let mut spread = FloodFill::new(&profile, &slopes, &GroundParams::default());
        let seed = profile.returns[first].position();
        spread.start(|position| position == seed);
        assert_eq!(spread.is_ground(last), wraps);
    }
}

#[test]
fn limited_field_of_view() {
    let scene = Scene { azimuths: (-60.0, 60.0), ..Scene::with([CAR]) };
    let (cloud, _) = scene.scan();
    assert!(!RangeImage::new(&cloud, &ProjectionParams::default()).wraps);
    assert_separated(&scene);
}

#[test]
fn shadowed_points_get_their_own_verdict() {
    let (cloud, over_floor) = Scene::with([CAR]).scan();
    let mut image = RangeImage::new(&cloud, &ProjectionParams::default());
    let floor = (0..cloud.len()).find(|&point| over_floor[point].abs() < 1e-6).unwrap();
    let face = (0..cloud.len()).find(|&point| over_floor[point] > 1.0).unwrap();
    // Each falls into the other's pixel.
    image.pixel_of_point.swap(floor, face);
    let is_ground = ground(&cloud, &image, &GroundParams::default()).is_ground;
    assert!(is_ground[floor] && !is_ground[face]);
}

#[test]
fn degenerate_images() {
    let empty = PointCloud::new(vec![], vec![], vec![]).unwrap();
    assert_eq!(verdicts(&empty), [] as [bool; 0]);
    let nothing = PointCloud::new(vec![0.0; 6], vec![0.0; 6], vec![0.0; 6]).unwrap();
    assert_eq!(verdicts(&nothing.organised(2, 3).unwrap()), [false; 6]);
    for (rows, columns) in [(1, 360), (32, 1), (1, 1), (2, 2)] {
        let scene = Scene { rows, columns, ..Scene::with([CAR]) };
        let (cloud, _) = scene.scan();
        assert_eq!(verdicts(&cloud).len(), rows * columns);
    }
    let far = PointCloud::new(vec![1e30, -1e38], vec![1e30, 3e38], vec![-1e38, -1.0]).unwrap();
    assert_eq!(verdicts(&far), [false; 2]);
}

#[test]
fn one_row_shows_no_slope_and_no_ground() {
    let scene = Scene { rows: 1, beams: (-10.0, -10.0), ..Scene::default() };
    let (cloud, _) = scene.scan();
    let every = 0..cloud.len() as u32;
    let image = RangeImage {
        projection: Projection::Organised,
        bands: RangeImage::new(&cloud, &ProjectionParams::default()).bands,
        stagger: 0,
        wraps: true,
        top_row_first: true,
        point_of_pixel: Grid::from_rows(1, cloud.len(), every.clone().collect()),
        pixel_of_point: every.collect(),
    };
    let found = ground(&cloud, &image, &GroundParams::default());
    assert_eq!(found.is_ground, vec![false; cloud.len()]);
    assert_eq!(found.confidence, vec![0.0; cloud.len()]);
}
