//! The surface of the ground: a plane for each tile around the sensor, through the ground of the tiles
//! about it.
//!
//! Slopes along a column cannot tell the foot of an object from rising ground where rows lie metres apart;
//! the ground on all sides can.

use nalgebra::{Matrix3, Vector3};

use super::height_map::HeightMap;
use crate::grid::Grid;

/// A plane per tile: `[height at the tile's centre, dz/dx, dz/dy, spread]`, NaN where no ground is near.
#[derive(Debug)]
pub(super) struct Surface {
    tile: f32,
    planes: Grid<[f32; 4]>,
}

/// Sums of least squares.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    /// 1, x, y, xx, xy, yy, z, xz, yz, zz.
    sums: [f64; 10],
}

impl Surface {
    /// Cells along each side of a tile.
    const CELLS: usize = 4;
    /// Metres over the plane of the fit before from which on cells no longer count, fit by fit: objects stand on the
    /// ground, so that what lies higher is dropped and what lies lower is kept.
    const BANDS: [f32; 4] = [f32::INFINITY, 0.3, 0.2, 0.15];
    /// Metres below the plane from which on cells no longer count: ditches, and returns that wet ground mirrors.
    const DEPTH: f32 = 1.0;
    /// Pull of the slopes towards the level, as so many square metres of ground: settles what a single
    /// ring leaves open.
    const PULL: f64 = 8.0;

    /// Height over the surface from which on a return is no ground where rows are dense: at least so many
    /// metres and so many spreads of the ground around.
    const DENSE: [f32; 2] = [0.3, 3.0];
    /// The same where rows are sparse.
    const SPARSE: [f32; 2] = [0.1, 2.0];

    /// The planes through the finest heights of a map.
    pub fn new(map: &HeightMap) -> Self {
        let side = HeightMap::SIDE / Self::CELLS;
        let tile = map.cell * Self::CELLS as f32;
        let nowhere = [f32::NAN; 4];
        let mut surface = Surface { tile, planes: Grid::filled(side, side, nowhere) };
        let cells = known_cells(map);
        for (round, band) in Self::BANDS.into_iter().enumerate() {
            let mut moments = Grid::filled(side, side, Moments::default());
            for &at in &cells {
                let (over, spread) = surface.height_and_spread(at);
                let is_near = over < (2.0 * spread).clamp(0.1, band) && over > -Self::DEPTH;
                if round == 0 || is_near {
                    let tile = surface.tile_at(at[0], at[1]).map(|tile| &mut moments[tile]);
                    tile.into_iter().for_each(|tile| tile.add(at));
                }
            }
            surface.fit(&moments);
        }
        surface
    }

    /// Height of a position over the ground as a share of the height from which on it is no ground; NaN
    /// where no ground is known.
    ///
    /// Where rows are dense, a face is steep and seen to be; where they are sparse, only its height tells,
    /// and it is held to less.
    pub fn over(&self, at: [f32; 3], is_sparse: bool) -> f32 {
        let (height, spread) = self.height_and_spread(at);
        let [least, spreads] = if is_sparse { Self::SPARSE } else { Self::DENSE };
        height / (spreads * spread).max(least)
    }

    /// Height of a position over the ground, and the spread of the ground around it, in metres; NaN where
    /// no ground is known.
    fn height_and_spread(&self, [x, y, z]: [f32; 3]) -> (f32, f32) {
        let Some(tile) = self.tile_at(x, y) else { return (f32::NAN, f32::NAN) };
        let [cx, cy] = self.centre(tile);
        let [height, along_x, along_y, spread] = self.planes[tile];
        (z - height - along_x * (x - cx) - along_y * (y - cy), spread)
    }

    /// Planes for the tiles with ground in or beside them.
    fn fit(&mut self, moments: &Grid<Moments>) {
        let side = moments.rows();
        let around = |along: usize| along.saturating_sub(1)..(along + 2).min(side);
        for row in 0..side {
            let has_ground =
                |column: usize| around(row).any(|r| moments[(r, column)].count() > 0.0);
            let known: Vec<bool> = (0..side).map(has_ground).collect();
            for column in (0..side).filter(|&column| around(column).any(|c| known[c])) {
                let mut sum = Moments::default();
                for r in around(row) {
                    around(column).for_each(|c| sum.join(&moments[(r, c)]));
                }
                self.planes[(row, column)] = sum.plane(self.centre((row, column)));
            }
        }
    }

    fn tile_at(&self, x: f32, y: f32) -> Option<(usize, usize)> {
        let side = self.planes.rows();
        let along = |metres: f32| {
            let tiles = metres / self.tile + (side / 2) as f32;
            (tiles >= 0.0 && tiles < side as f32).then_some(tiles as usize)
        };
        Some((along(x)?, along(y)?))
    }

    fn centre(&self, (row, column): (usize, usize)) -> [f32; 2] {
        let half = (self.planes.rows() / 2) as f32;
        [row, column].map(|along| (along as f32 - half + 0.5) * self.tile)
    }
}

fn known_cells(map: &HeightMap) -> Vec<[f32; 3]> {
    let finest = &map.levels[0];
    let half = (HeightMap::SIDE / 2) as f32;
    let place = |cell: usize| (cell as f32 - half + 0.5) * map.cell;
    let mut cells = Vec::new();
    for row in 0..finest.rows() {
        for (column, &z) in finest.row(row).iter().enumerate() {
            if !z.is_nan() {
                cells.push([place(row), place(column), z]);
            }
        }
    }
    cells
}

impl Moments {
    fn count(&self) -> f64 {
        self.sums[0]
    }

    fn add(&mut self, at: [f32; 3]) {
        let [x, y, z] = at.map(f64::from);
        let terms = [1.0, x, y, x * x, x * y, y * y, z, x * z, y * z, z * z];
        self.sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }

    fn join(&mut self, other: &Moments) {
        self.sums.iter_mut().zip(other.sums).for_each(|(sum, other)| *sum += other);
    }

    /// The plane about a centre.
    fn plane(&self, centre: [f32; 2]) -> [f32; 4] {
        let [n, x, y, xx, xy, yy, z, xz, yz, zz] = self.sums;
        let [cx, cy] = centre.map(f64::from);
        let (dx, dy) = (x - n * cx, y - n * cy);
        let dxx = xx - 2.0 * cx * x + n * cx * cx + Surface::PULL;
        let dyy = yy - 2.0 * cy * y + n * cy * cy + Surface::PULL;
        let dxy = xy - cx * y - cy * x + n * cx * cy;
        let normal = Matrix3::new(n, dx, dy, dx, dxx, dxy, dy, dxy, dyy);
        let right = Vector3::new(z, xz - cx * z, yz - cy * z);
        let Some(plane) = normal.cholesky().map(|solve| solve.solve(&right)) else {
            return [f32::NAN; 4];
        };
        let squares = zz - plane.dot(&right);
        let spread = (squares.max(0.0) / n).sqrt();
        [plane.x, plane.y, plane.z, spread].map(|value| value as f32)
    }
}
