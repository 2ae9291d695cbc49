//! The surface of the ground: a plane for each tile around the sensor, through the ground of the
//! tiles about it.
//!
//! Slopes along a column cannot tell the foot of an object from rising ground where rows lie metres
//! apart; the ground on all sides can.

use nalgebra::{Matrix3, Vector3};

use super::height_map::{HeightMap, place};
use crate::geometry::grid::Grid;

/// The surface around the sensor.
#[derive(Debug)]
pub(super) struct Surface {
    /// Tiles to a metre.
    per_metre: f32,
    planes: Grid<Plane>,
}

/// The surface over a tile; all NaN where no ground is near.
#[derive(Debug, Clone, Copy)]
struct Plane {
    /// Height at the sensor's place, metres.
    base: f32,
    along_x: f32,
    along_y: f32,
    /// Root mean square of the residuals of the ground around, metres.
    spread: f32,
    /// One over the heights from which on a return is no ground where rows are dense and sparse.
    per_limit: [f32; 2],
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
    /// Metres over the plane of the fit before from which on cells no longer count, fit by fit:
    /// objects stand on the ground, so that what lies higher is dropped and what lies lower is
    /// kept.
    const BANDS: [f32; 4] = [f32::INFINITY, 0.3, 0.2, 0.15];
    /// The same in spreads of the fit before, where that is less.
    const SPREADS: f32 = 2.0;
    /// Metres below the plane from which on cells no longer count: ditches, and returns that wet
    /// ground mirrors.
    const DEPTH: f32 = 1.0;
    /// Pull of the slopes towards the level, as so many square metres of ground: settles what a
    /// single ring leaves open.
    const PULL: f64 = 8.0;

    /// Height over the surface from which on a return is no ground where rows are dense: at least
    /// so many metres and so many spreads of the ground around.
    const DENSE: [f32; 2] = [0.3, 3.0];
    /// The same where rows are sparse.
    const SPARSE: [f32; 2] = [0.1, 2.0];

    /// The planes through the finest heights of a map.
    pub fn new(map: &HeightMap) -> Self {
        let side = HeightMap::SIDE / Self::CELLS;
        let tile = map.cell * Self::CELLS as f32;
        let mut surface =
            Surface { per_metre: tile.recip(), planes: Grid::filled(side, side, Plane::NOWHERE) };
        let cells = known_cells(map);
        for (round, band) in Self::BANDS.into_iter().enumerate() {
            let mut moments = Grid::filled(side, side, Moments::default());
            for &at in &cells {
                let Some(tile) = surface.tile_at(at) else { continue };
                let plane = &surface.planes[tile];
                let over = plane.height_under(at);
                let highest = (Self::SPREADS * plane.spread).clamp(Self::SPARSE[0], band);
                if round == 0 || (over < highest && over > -Self::DEPTH) {
                    moments[tile].add(at);
                }
            }
            surface.fit(&moments, tile);
        }
        surface
    }

    /// Height of a position over the ground as a share of the height from which on it is no ground;
    /// NaN where no ground is known.
    ///
    /// Where rows are dense, a face is steep and seen to be; where they are sparse, only its height
    /// tells, and it is held to less.
    pub fn over(&self, at: [f32; 3], is_sparse: bool) -> f32 {
        self.tile_at(at).map_or(f32::NAN, |tile| {
            let plane = &self.planes[tile];
            plane.height_under(at) * plane.per_limit[usize::from(is_sparse)]
        })
    }

    /// Planes for the tiles with ground in or beside them.
    fn fit(&mut self, moments: &Grid<Moments>, tile: f32) {
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
                let half = (side / 2) as f32;
                let centre = [row, column].map(|along| (along as f32 - half + 0.5) * tile);
                self.planes[(row, column)] = sum.plane(centre);
            }
        }
    }

    fn tile_at(&self, [x, y, _]: [f32; 3]) -> Option<(usize, usize)> {
        place([x, y], self.per_metre, self.planes.rows())
    }
}

impl Plane {
    const NOWHERE: Plane = Plane {
        base: f32::NAN,
        along_x: f32::NAN,
        along_y: f32::NAN,
        spread: f32::NAN,
        per_limit: [f32::NAN; 2],
    };

    fn new(base: f64, along_x: f64, along_y: f64, spread: f64) -> Self {
        let [base, along_x, along_y, spread] = [base, along_x, along_y, spread].map(|v| v as f32);
        let per_limit = [Surface::DENSE, Surface::SPARSE]
            .map(|[least, spreads]| (spreads * spread).max(least).recip());
        Plane { base, along_x, along_y, spread, per_limit }
    }

    /// Height of a position over the plane in metres.
    fn height_under(&self, [x, y, z]: [f32; 3]) -> f32 {
        z - self.base - self.along_x * x - self.along_y * y
    }
}

fn known_cells(map: &HeightMap) -> Vec<[f32; 3]> {
    let finest = &map.levels[0];
    let half = (HeightMap::SIDE / 2) as f32;
    let middle = |cell: usize| (cell as f32 - half + 0.5) * map.cell;
    let mut cells = Vec::new();
    for row in 0..finest.rows() {
        for (column, &z) in finest.row(row).iter().enumerate() {
            if !z.is_nan() {
                cells.push([middle(row), middle(column), z]);
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

    /// The plane about a centre, metres.
    fn plane(&self, centre: [f32; 2]) -> Plane {
        let [n, x, y, xx, xy, yy, z, xz, yz, zz] = self.sums;
        let [cx, cy] = centre.map(f64::from);
        let (dx, dy) = (x - n * cx, y - n * cy);
        let dxx = xx - 2.0 * cx * x + n * cx * cx + Surface::PULL;
        let dyy = yy - 2.0 * cy * y + n * cy * cy + Surface::PULL;
        let dxy = xy - cx * y - cy * x + n * cx * cy;
        let normal = Matrix3::new(n, dx, dy, dx, dxx, dxy, dy, dxy, dyy);
        let right = Vector3::new(z, xz - cx * z, yz - cy * z);
        let Some(plane) = normal.cholesky().map(|solve| solve.solve(&right)) else {
            return Plane::NOWHERE;
        };
        let squares = (zz - plane.dot(&right)).max(0.0);
        let base = plane.x - plane.y * cx - plane.z * cy;
        Plane::new(base, plane.y, plane.z, (squares / n).sqrt())
    }
}
