//! How high the ground lies at a place.

use rustc_hash::FxHashMap;

use crate::cloud::Reason;
use crate::cloud::point_cloud::{PointCloud, wide};
use crate::geometry::grid::Grid;

/// The height of the ground by cells of the plane.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundHeights {
    /// Of each cell the sum of heights and the number of points: those around the sensor.
    near: Grid<(f64, u32)>,
    /// The others.
    far: FxHashMap<[i32; 2], (f64, u32)>,
    /// Where cell (0, 0) begins on the plane: where the sensor stands, so that the same sweep has
    /// the same cells in any frame.
    origin: [f64; 2],
}

/// Side of a cell of ground, metres.
const CELL: f64 = 2.0;
/// How many cells away ground may be.
const FARTHEST: i32 = 3;
/// Cells from the sensor to the edge of the near ones.
const NEAR: i32 = 64;

impl GroundHeights {
    /// Of a cloud of N points with a reason each, in cells around a sensor's place, metres.
    pub fn new(cloud: &PointCloud, reason: &[Reason], sensor: [f64; 3]) -> Self {
        let side = 2 * NEAR as usize;
        let mut heights = GroundHeights {
            near: Grid::filled(side, side, (0.0, 0)),
            far: FxHashMap::default(),
            origin: [sensor[0], sensor[1]],
        };
        for point in (0..cloud.len()).filter(|&point| reason[point] == Reason::Ground) {
            let [x, y, z] = wide(cloud.position(point));
            let cell = heights.place(x, y);
            let (sum, count) = match near(cell) {
                Some(cell) => &mut heights.near[cell],
                None => heights.far.entry(cell).or_default(),
            };
            (*sum, *count) = (*sum + z, *count + 1);
        }
        heights
    }

    /// The mean height of the nearest ground, metres in the sensor's frame.
    pub fn at(&self, [x, y, _]: [f64; 3]) -> Option<f64> {
        let [column, row] = self.place(x, y);
        (0..=FARTHEST).find_map(|ring| {
            let step = |from: i32, by: i32| from.saturating_add(by);
            let steps = move |i: i32| (-ring..=ring).map(move |j| [step(column, i), step(row, j)]);
            let around = (-ring..=ring).flat_map(steps).filter_map(|cell| self.cell(cell));
            let (sum, count) = around.fold((0.0, 0), |all, cell| (all.0 + cell.0, all.1 + cell.1));
            (count > 0).then(|| sum / f64::from(count))
        })
    }

    fn cell(&self, cell: [i32; 2]) -> Option<(f64, u32)> {
        match near(cell) {
            Some(cell) => Some(self.near[cell]),
            None => self.far.get(&cell).copied(),
        }
    }

    fn place(&self, x: f64, y: f64) -> [i32; 2] {
        // Casting truncates towards 0; a call of `floor` costs more than all the rest.
        [x - self.origin[0], y - self.origin[1]].map(|along| {
            let cell = along / CELL;
            let truncated = cell as i32;
            truncated.saturating_sub(i32::from(cell < f64::from(truncated)))
        })
    }
}

/// The place of a cell among the near ones.
fn near(cell: [i32; 2]) -> Option<(usize, usize)> {
    let [row, column] = cell.map(|along| along.saturating_add(NEAR) as u32);
    let side = 2 * NEAR as u32;
    (row < side && column < side).then_some((row as usize, column as usize))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_ground_is_beyond_the_last_cell() {
        let cloud = PointCloud::new(vec![1.0], vec![1.0], vec![-2.0]).unwrap();
        let heights = GroundHeights::new(&cloud, &[Reason::Ground], [0.0; 3]);
        for far in [1e30, 4_294_967_296.0, -1e30] {
            assert_eq!(heights.at([far, far, 0.0]), None);
        }
    }

    #[test]
    fn ground_is_that_of_the_nearest_cells() {
        let cloud =
            PointCloud::new(vec![1.0, 1.5, 9.0, 1.0], vec![1.0; 4], vec![-2.0, -1.0, 4.0, 9.0]);
        let reason = [Reason::Ground, Reason::Ground, Reason::Ground, Reason::None];
        let heights = GroundHeights::new(&cloud.unwrap(), &reason, [0.0; 3]);
        assert_eq!(heights.at([0.5, 0.5, 0.0]), Some(-1.5));
        assert_eq!(heights.at([7.0, 1.0, 0.0]), Some(4.0));
        assert_eq!(heights.at([30.0, 1.0, 0.0]), None);
    }
}
