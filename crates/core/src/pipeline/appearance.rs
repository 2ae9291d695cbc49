//! The shapes of instances without a class, measured on the run.

use rustc_hash::FxHashMap;

use crate::cloud::point_cloud::{PointCloud, wide};
use crate::cloud::shape::{Shape, ShapeMeasures, classify_shape};
use crate::cloud::{Reason, UprightBox};
use crate::cluster::{MethodInput, ObjectPixels};
use crate::range_image::{NO_NEIGHBOUR, RangeImage};

/// What [`ShapeMeasures`] need beyond an instance's own points.
pub(super) struct Appearance {
    ground: GroundHeights,
    /// Departures of ranges, metres; those of instance k at k - 1.
    departures: Vec<Vec<f32>>,
}

impl Appearance {
    /// Of a cloud of N points with a reason each, and M object pixels with one of `count` instances
    /// each. An instance need not have a pixel: all its points may be shadowed.
    pub fn new(input: &MethodInput, reason: &[Reason], (instance, count): (&[u32], usize)) -> Self {
        let MethodInput { cloud, image, objects, .. } = *input;
        let mut departures = vec![Vec::new(); count];
        for (object, &own) in instance.iter().enumerate().filter(|&(_, &own)| own != 0) {
            departures[own as usize - 1].extend(departure(image, objects, instance, object));
        }
        Appearance { ground: GroundHeights::new(cloud, reason), departures }
    }

    /// The shape of an instance, given its points and its box.
    pub fn shape(
        &mut self,
        cloud: &PointCloud,
        id: u32,
        points: &[u32],
        bounds: &UprightBox,
    ) -> Shape {
        let positions: Vec<[f64; 3]> =
            points.iter().map(|&point| wide(cloud.position(point as usize))).collect();
        let ground = self.ground.at(bounds.centre);
        let departures = &mut self.departures[id as usize - 1];
        classify_shape(ShapeMeasures::new(&positions, bounds, ground, departures))
    }
}

/// By how much the range of an object pixel departs from the mean of those to its left and right,
/// metres, if both are of its instance and as many columns away.
fn departure(
    image: &RangeImage,
    objects: &ObjectPixels,
    instance: &[u32],
    object: usize,
) -> Option<f32> {
    let [left, right, ..] = objects.neighbours[object];
    if left == NO_NEIGHBOUR || right == NO_NEIGHBOUR {
        return None;
    }
    let [left, right] = [left, right].map(|neighbour| neighbour as usize);
    let columns = image.columns();
    let column = |object: usize| objects.pixel[object] as usize % columns;
    let apart = |from: usize, to: usize| (column(to) + columns - column(from)) % columns;
    let is_even = apart(left, object) == apart(object, right);
    if !is_even || [left, right].iter().any(|&n| instance[n] != instance[object]) {
        return None;
    }
    let range = |object: usize| {
        objects.position[object].iter().map(|&x| f64::from(x).powi(2)).sum::<f64>().sqrt()
    };
    Some(((range(left) + range(right)) / 2.0 - range(object)).abs() as f32)
}

/// The height of the ground by cells of the plane.
struct GroundHeights {
    /// Sum of heights and number of points.
    cells: FxHashMap<[i32; 2], (f64, u32)>,
}

/// Side of a cell of ground, metres.
const CELL: f64 = 2.0;
/// How many cells away ground may be.
const FARTHEST: i32 = 3;

impl GroundHeights {
    fn new(cloud: &PointCloud, reason: &[Reason]) -> Self {
        let mut cells: FxHashMap<[i32; 2], (f64, u32)> = FxHashMap::default();
        for point in (0..cloud.len()).filter(|&point| reason[point] == Reason::Ground) {
            let [x, y, z] = wide(cloud.position(point));
            let cell = cells.entry(place(x, y)).or_default();
            *cell = (cell.0 + z, cell.1 + 1);
        }
        GroundHeights { cells }
    }

    /// The mean height of the nearest ground, metres in the sensor's frame.
    fn at(&self, [x, y, _]: [f64; 3]) -> Option<f64> {
        let [column, row] = place(x, y);
        (0..=FARTHEST).find_map(|ring| {
            let step = |from: i32, by: i32| from.saturating_add(by);
            let steps = move |i: i32| (-ring..=ring).map(move |j| [step(column, i), step(row, j)]);
            let around = (-ring..=ring).flat_map(steps).filter_map(|cell| self.cells.get(&cell));
            let (sum, count) = around.fold((0.0, 0), |all, cell| (all.0 + cell.0, all.1 + cell.1));
            (count > 0).then(|| sum / f64::from(count))
        })
    }
}

fn place(x: f64, y: f64) -> [i32; 2] {
    [x, y].map(|x| (x / CELL).floor() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_ground_is_beyond_the_last_cell() {
        let cloud = PointCloud::new(vec![1.0], vec![1.0], vec![-2.0]).unwrap();
        let heights = GroundHeights::new(&cloud, &[Reason::Ground]);
        for far in [1e30, 4_294_967_296.0, -1e30] {
            assert_eq!(heights.at([far, far, 0.0]), None);
        }
    }

    #[test]
    fn ground_is_that_of_the_nearest_cells() {
        let cloud =
            PointCloud::new(vec![1.0, 1.5, 9.0, 1.0], vec![1.0; 4], vec![-2.0, -1.0, 4.0, 9.0]);
        let reason = [Reason::Ground, Reason::Ground, Reason::Ground, Reason::None];
        let heights = GroundHeights::new(&cloud.unwrap(), &reason);
        assert_eq!(heights.at([0.5, 0.5, 0.0]), Some(-1.5));
        assert_eq!(heights.at([7.0, 1.0, 0.0]), Some(4.0));
        assert_eq!(heights.at([30.0, 1.0, 0.0]), None);
    }
}
