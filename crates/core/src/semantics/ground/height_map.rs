//! The height of the ground seen from above: a grid around the sensor, and coarser grids for where
//! it has gaps.

use super::params::GroundParams;
use crate::geometry::grid::Grid;

/// Mean heights of the ground on square grids around the sensor, each twice as coarse as the one
/// before.
#[derive(Debug)]
pub(super) struct HeightMap {
    pub cell: f32,
    per_metre: f32,
    band: f32,
    /// NaN where there is no ground.
    pub levels: Vec<Grid<f32>>,
}

impl HeightMap {
    /// Cells along each side of the finest grid: 128 m to either side in cells of 1 m, beyond which
    /// rings of ground are too far apart to say anything about their surroundings.
    pub const SIDE: usize = 256;
    /// Grids, the coarsest of cells four times as wide as the finest: as far as ground can be
    /// guessed to a third of a metre on a 10 % road.
    const LEVELS: usize = 3;
    /// How much the band widens with the side of coarser cells, m/m: a 10 % road over half of it.
    const BAND_GROWTH: f32 = 0.05;

    /// The heights of some positions, and the coarser grids.
    pub fn new(positions: impl Iterator<Item = [f32; 3]>, params: &GroundParams) -> Self {
        let mut map = Self::finest(positions, params);
        for level in 1..Self::LEVELS {
            map.levels.push(halved(&map.levels[level - 1]));
        }
        map
    }

    /// The heights of some positions on the finest grid alone.
    pub fn finest(positions: impl Iterator<Item = [f32; 3]>, params: &GroundParams) -> Self {
        let mut map = HeightMap {
            cell: params.cell as f32,
            per_metre: params.cell.recip() as f32,
            band: params.height_band as f32,
            levels: Vec::with_capacity(Self::LEVELS),
        };
        let mut sums = Grid::filled(Self::SIDE, Self::SIDE, (0.0_f32, 0_u32));
        for [x, y, z] in positions {
            if let Some(cell) = map.cell_at(x, y) {
                let (sum, count) = &mut sums[cell];
                (*sum, *count) = (*sum + z, *count + 1);
            }
        }
        let means = sums.values().iter().map(|&(sum, count)| sum / count as f32);
        let finest = Grid::from_rows(Self::SIDE, Self::SIDE, means.collect());
        map.levels.push(finest);
        map
    }

    /// Whether a position is as high as the ground around it, by the finest grid that knows any.
    pub fn is_near(&self, [x, y, z]: [f32; 3]) -> bool {
        let Some((row, column)) = self.cell_at(x, y) else {
            return false;
        };
        let heights = self.levels.iter().enumerate();
        let mut known = heights
            .map(|(level, heights)| (level, heights[(row >> level, column >> level)]))
            .filter(|(_, height)| !height.is_nan());
        known.next().is_some_and(|(level, height)| {
            let side = self.cell * ((1 << level) - 1) as f32;
            (z - height).abs() <= self.band + Self::BAND_GROWTH * side
        })
    }

    /// Whether a position is as high as the ground in its own cell of the finest grid.
    pub fn is_on(&self, [x, y, z]: [f32; 3]) -> bool {
        let height = self.cell_at(x, y).map(|cell| self.levels[0][cell]);
        height.is_some_and(|height| (z - height).abs() <= self.band)
    }

    fn cell_at(&self, x: f32, y: f32) -> Option<(usize, usize)> {
        place([x, y], self.per_metre, Self::SIDE)
    }
}

/// Row and column of a place (metres) in a square grid of `side` cells a side around the sensor.
pub(super) fn place([x, y]: [f32; 2], per_metre: f32, side: usize) -> Option<(usize, usize)> {
    let middle = (side / 2) as f32;
    // Casting truncates towards 0, so that what lies just outside must be told apart before.
    let [row, column] = [x, y].map(|along| along * per_metre + middle);
    let is_inside = row >= 0.0 && column >= 0.0 && row < side as f32 && column < side as f32;
    is_inside.then_some((row as i32 as usize, column as i32 as usize))
}

/// A grid of half as many cells a side, each the mean of those of its four that are known.
fn halved(fine: &Grid<f32>) -> Grid<f32> {
    let side = fine.rows() / 2;
    let mut coarse = Grid::filled(side, side, f32::NAN);
    for row in 0..side {
        for column in 0..side {
            let four = [(0, 0), (0, 1), (1, 0), (1, 1)]
                .map(|(down, right)| fine[(2 * row + down, 2 * column + right)]);
            let known = four.iter().filter(|height| !height.is_nan());
            let (sum, count) = known.fold((0.0, 0), |(sum, count), &z| (sum + z, count + 1));
            coarse[(row, column)] = sum / count as f32;
        }
    }
    coarse
}
