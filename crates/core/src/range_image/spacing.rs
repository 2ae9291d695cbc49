//! A spherical image for clouds without beams: as fine as the points lie.
//!
//! Scanners that never repeat a curve, and merged clouds that do not say whose a point is, have
//! neither rows nor columns. What is left is how densely the returns cover the sphere around the
//! sensor: a pixel has half the area that one return has for itself, so that few returns share one
//! (a fifth, if they fall at random) and the next one is at most a pixel or two away.

use std::f64::consts::{PI, TAU};

use super::angles::elevation;
use super::sweep::Sweep;

/// Area of a pixel as a share of that of a return.
const SHARE: f64 = 0.5;

/// Rows and columns of the full circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Resolution {
    pub rows: usize,
    pub columns: usize,
}

/// The resolution between two elevations (radians, upper and lower); `None` of too few returns to
/// tell.
pub(super) fn resolution(sweep: &Sweep, (upper, lower): (f64, f64)) -> Option<Resolution> {
    const FEWEST_RETURNS: usize = 256;
    const ROWS: (f64, f64) = (16.0, 512.0);
    const COLUMNS: (f64, f64) = (256.0, 4096.0);
    let count = sweep.azimuth.iter().filter(|azimuth| !azimuth.is_nan()).count();
    if count < FEWEST_RETURNS {
        return None;
    }
    let side = (SHARE * covered(sweep) / count as f64).sqrt();
    let of = |angle: f64, (least, most): (f64, f64)| (angle / side).round().clamp(least, most);
    Some(Resolution { rows: of(upper - lower, ROWS) as usize, columns: of(TAU, COLUMNS) as usize })
}

/// Solid angle of the patches of two degrees that have a return, steradians.
fn covered(sweep: &Sweep) -> f64 {
    const PATCH: f64 = 2.0 * PI / 180.0;
    let (rows, columns) = ((PI / PATCH) as usize + 1, (TAU / PATCH) as usize + 1);
    let mut is_covered = vec![false; rows * columns];
    for (point, azimuth) in sweep.azimuth.iter().enumerate().filter(|(_, a)| !a.is_nan()) {
        let row = (elevation(sweep.cloud, point) + PI / 2.0) / PATCH;
        let column = (f64::from(*azimuth) + PI) / PATCH;
        is_covered[row as usize * columns + (column as usize).min(columns - 1)] = true;
    }
    let of_row = |row: usize| {
        let count = is_covered[row * columns..(row + 1) * columns].iter().filter(|&&c| c).count();
        let middle = (row as f64 + 0.5) * PATCH - PI / 2.0;
        count as f64 * PATCH * PATCH * middle.cos().max(0.0)
    };
    (0..rows).map(of_row).sum()
}
