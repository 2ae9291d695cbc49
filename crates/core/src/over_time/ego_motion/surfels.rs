//! The local map: voxels with the surface through their points.

use nalgebra::{Matrix3, Point3, Vector3};
use rustc_hash::FxHashMap;

use super::principal_axes::principal_axes;

/// Cells of a voxel along each axis, each of which takes one point.
const CELLS: usize = 4;

/// Points that determine a surface.
const LEAST_POINTS: u32 = 5;

/// Least standard deviation of points across a surface that is believed, metres: the noise of a
/// range.
const NOISE: f64 = 0.03;

/// Greatest standard deviation of points across a surface, metres: grass is one, a hedge is none.
const THICKNESS: f64 = 0.08;

/// Greatest standard error of a surface's slope. With 0.1 the points along two beams on the ground
/// make surfaces that lean by chance and move along with the sensor.
const SLOPE_ERROR: f64 = 0.03;

/// Least sine of the angle between a surface and the view of it. What one beam sees of a treetop
/// lies in a plane through the sensor, which moves along with it.
const GRAZING: f64 = 0.05;

/// A surface that registration holds on to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surfel {
    /// Mean of its points, metres.
    pub mean: Point3<f64>,
    /// The direction across it, of unit length.
    pub normal: Vector3<f64>,
    /// Variance of its points across it, square metres.
    variance: f64,
    /// Sum of the squared distances of its points from their mean, in the direction in which they
    /// reach least far along it, square metres.
    spread: f64,
}

impl Surfel {
    /// How much a point counts that lies this far from the mean along the surface, squared: the
    /// variance of a range over that of the distance between point and surface, 1 at most.
    #[inline]
    pub fn trust(&self, squared_aside: f64) -> f64 {
        const VARIANCE: f64 = NOISE * NOISE;
        VARIANCE / (VARIANCE + self.variance * (1.0 + squared_aside / self.spread))
    }
}

/// Points of a voxel, as sums about its lowest corner, which keep their precision anywhere.
#[derive(Debug, Clone, Default)]
struct Voxel {
    count: u32,
    sum: Vector3<f64>,
    products: Matrix3<f64>,
    /// Which cells have a point: a bit for each.
    cells: u64,
    surfel: Option<Surfel>,
}

/// Number of a voxel along each axis.
type Key = [i32; 3];

/// Voxels of one size. Each of their cells takes one point, so that a sensor that stands does not
/// fill them with the same few lines, and that their number of points is bounded.
#[derive(Debug, Clone)]
pub struct SurfelMap {
    /// Side of a voxel, metres.
    side: f64,
    voxels: FxHashMap<Key, Voxel>,
    /// Voxels that took a point since their surfel was made, some more than once.
    changed: Vec<Key>,
}

impl SurfelMap {
    /// An empty map of voxels with a side in metres.
    pub fn new(side: f64) -> Self {
        SurfelMap { side, voxels: FxHashMap::default(), changed: Vec::new() }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.voxels.clear();
    }

    /// Adds points that a sensor sees, in the map's frame, metres, and makes the surfels anew that
    /// they change.
    pub fn insert(&mut self, sensor: &Point3<f64>, points: impl Iterator<Item = Point3<f64>>) {
        for point in points {
            let key = self.key(&point);
            let corner = self.corner(key);
            let local = point - corner;
            let cell =
                local.map(|along| ((along / self.side * CELLS as f64) as usize).min(CELLS - 1));
            let bit = 1 << ((cell.z * CELLS + cell.y) * CELLS + cell.x);
            let voxel = self.voxels.entry(key).or_default();
            if voxel.cells & bit == 0 {
                voxel.cells |= bit;
                voxel.count += 1;
                voxel.sum += local;
                voxel.products += local * local.transpose();
                self.changed.push(key);
            }
        }
        self.changed.sort_unstable();
        self.changed.dedup();
        for key in std::mem::take(&mut self.changed) {
            let corner = self.corner(key);
            if let Some(voxel) = self.voxels.get_mut(&key) {
                voxel.surfel = surfel(voxel, corner, sensor);
            }
        }
    }

    /// Forgets voxels farther than `reach` metres from a position along any axis.
    pub fn keep_within(&mut self, position: &Point3<f64>, reach: f64) {
        let centre = self.key(position);
        let reach = (reach / self.side) as i32;
        self.voxels.retain(|key, _| (0..3).all(|axis| (key[axis] - centre[axis]).abs() <= reach));
    }

    /// The surfel of the voxel that a position lies in.
    #[inline]
    pub fn at(&self, position: &Point3<f64>) -> Option<&Surfel> {
        self.voxels.get(&self.key(position))?.surfel.as_ref()
    }

    #[inline]
    fn key(&self, position: &Point3<f64>) -> Key {
        [0, 1, 2].map(|axis| (position[axis] / self.side).floor() as i32)
    }

    fn corner(&self, key: Key) -> Point3<f64> {
        Point3::from(key.map(|number| f64::from(number) * self.side))
    }
}

/// The surface through the points of a voxel, if they determine one.
fn surfel(voxel: &Voxel, corner: Point3<f64>, sensor: &Point3<f64>) -> Option<Surfel> {
    if voxel.count < LEAST_POINTS {
        return None;
    }
    let count = f64::from(voxel.count);
    let mean = voxel.sum / count;
    let (values, axes) = principal_axes(voxel.products / count - mean * mean.transpose());
    let (variance, spread) = (values[0].max(0.0), count * values[1]);
    let is_thin = variance < THICKNESS * THICKNESS;
    let is_determined = variance.max(NOISE * NOISE) < SLOPE_ERROR * SLOPE_ERROR * spread;
    let (mean, normal) = (corner + mean, axes.column(0).into_owned());
    let view = mean - sensor;
    let is_seen = normal.dot(&view).abs() > GRAZING * view.norm();
    let is_surface = is_thin && is_determined && is_seen;
    is_surface.then_some(Surfel { mean, normal, variance, spread })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points all over a voxel in a level plane, and what a sensor at a height above it makes of
    /// them from 5 m away.
    fn seen_from(height: f64) -> Option<Surfel> {
        let mut map = SurfelMap::new(1.5);
        let along = |step: i32| 0.05 + 0.14 * f64::from(step);
        let points = (0..100).map(|n| Point3::new(4.5 + along(n / 10), along(n % 10), 0.7));
        map.insert(&Point3::new(0.0, 0.0, 0.7 + height), points);
        map.at(&Point3::new(5.0, 0.5, 0.7)).copied()
    }

    #[test]
    fn a_plane_is_a_surface_unless_it_leads_through_the_sensor() {
        let surfel = seen_from(1.8).expect("a plane");
        assert!((surfel.normal.z.abs() - 1.0).abs() < 1e-9 && (surfel.mean.z - 0.7).abs() < 1e-9);
        assert_eq!(seen_from(0.1), None);
    }

    #[test]
    fn a_line_of_points_is_no_surface() {
        let mut map = SurfelMap::new(1.5);
        let line = (0..50).map(|step| Point3::new(0.03 * f64::from(step), 0.7, 0.7));
        map.insert(&Point3::new(0.0, -5.0, 3.0), line);
        assert_eq!(map.at(&Point3::new(0.7, 0.7, 0.7)), None);
    }

    #[test]
    fn what_is_far_is_forgotten_and_full_cells_take_no_more() {
        let mut map = SurfelMap::new(1.5);
        let sensor = Point3::new(0.0, 0.0, 5.0);
        let patch = |z: f64| {
            (0..100)
                .map(move |n| Point3::new(0.14 * f64::from(n / 10), 0.14 * f64::from(n % 10), z))
        };
        map.insert(&sensor, patch(0.10));
        let before = map.at(&Point3::new(0.7, 0.7, 0.1)).copied();
        assert!(before.is_some());
        map.insert(&sensor, patch(0.15));
        assert_eq!(map.at(&Point3::new(0.7, 0.7, 0.1)).copied(), before);
        map.keep_within(&Point3::new(200.0, 0.0, 0.0), 100.0);
        assert_eq!(map.at(&Point3::new(0.7, 0.7, 0.1)), None);
    }
}
