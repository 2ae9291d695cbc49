//! The plane that the ground near the sensor lies on.

use super::climb::{Limits, climb};
use super::level::BEYOND;
use super::params::{CLEARANCE, GroundParams};
use super::profile::{Profile, Return};
use crate::geometry::plane_fit::plane_through;
use crate::range_image::NOWHERE;

/// Height over the level frame's horizontal plane: `[z at the origin, dz/dx, dz/dy]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plane([f32; 3]);

impl Plane {
    /// One column in this many is looked at: the plane has three unknowns.
    const COLUMN_STRIDE: usize = 4;
    /// Shares of the low flat returns under the heights that fits begin at: low ones, since tables
    /// and car roofs are flat as well but stand on the ground; several, since tilt or a bank puts
    /// any one of them off the ground that most lies on.
    const STARTS: [f64; 4] = [0.1, 0.2, 0.35, 0.5];
    /// Metres from the plane within which returns count, fit by fit. The first leaves room for a
    /// few degrees of tilt, the last for a kerb.
    const BANDS: [f32; 4] = [0.5, 0.5, 0.3, 0.2];
    /// Farthest that a column's start is moved along the plane in metres: where ground within sight
    /// follows a plane at all.
    const REACH: f32 = 10.0;

    /// Trimmed least squares through flat returns below the sensor, begun at several heights of
    /// their lower half; the plane that most of them lie on and fewest below (ties: the lower
    /// start). `None` if there is no such return, or if the plane passes through the sensor.
    pub fn of_low_flat_returns(profile: &Profile, params: &GroundParams) -> Option<Plane> {
        let mut low = low_flat_returns(profile, params);
        low.sort_unstable_by(|a, b| a[2].total_cmp(&b[2]));
        let starts = Self::STARTS.iter().filter_map(|share| {
            let rank = (share * low.len() as f64) as usize;
            Plane::refined(low.get(rank)?[2], &low)
        });
        let support = |plane: &Plane| low.iter().map(|&p| plane.support_of(p)).sum::<i32>();
        let best = starts.rev().max_by_key(support)?;
        (best.0[0] < -CLEARANCE).then_some(best)
    }

    /// The plane that trimmed least squares reach from a height.
    fn refined(height: f32, low: &[[f32; 3]]) -> Option<Plane> {
        Self::BANDS.iter().try_fold(Plane([height, 0.0, 0.0]), |plane, band| {
            fit(low.iter().filter(|&&p| plane.height_over(p).abs() < *band))
        })
    }

    /// What a position says of the plane: 1 within the last band, -1 far below, since nothing is
    /// seen through the ground (car roofs of one height are flat as well), and 0 elsewhere.
    fn support_of(&self, position: [f32; 3]) -> i32 {
        let [.., band] = Self::BANDS;
        let height = self.height_over(position);
        i32::from(height.abs() < band) - i32::from(height < -BEYOND)
    }

    /// Height of a position over the plane in metres.
    fn height_over(&self, [x, y, z]: [f32; 3]) -> f32 {
        let [base, along_x, along_y] = self.0;
        z - base - along_x * x - along_y * y
    }

    /// Whether ground may start to spread from a flat return: near the sensor and, but for a kerb
    /// and 3 % of bend, on the plane.
    pub fn is_start(&self, position: [f32; 3], params: &GroundParams) -> bool {
        let distance = (position[0] * position[0] + position[1] * position[1]).sqrt();
        distance < params.start_distance as f32
            && self.height_over(position).abs() < params.step as f32 + 0.03 * distance
    }

    /// The plane below or above a position, or nearer the sensor if that is far off.
    pub fn below(&self, position: [f32; 3]) -> Return {
        let distance = (position[0] * position[0] + position[1] * position[1]).sqrt();
        let share = (Self::REACH / distance).min(1.0);
        let [x, y, _] = position.map(|along| along * share);
        Return {
            place: [x, y],
            distance: distance * share,
            height: -self.height_over([x, y, 0.0]),
            point: NOWHERE,
        }
    }
}

/// Flat returns below the sensor and near it, the lowest of each cell of a grid around the sensor.
///
/// By cells, since the sensor's own vehicle or a table under it fills much of the image but little
/// of the floor. A column starts at its first return, which counts for nothing by itself: one
/// return has no slope.
fn low_flat_returns(profile: &Profile, params: &GroundParams) -> Vec<[f32; 3]> {
    let limits = Limits::new(params);
    let mut lowest = Cells::new(params);
    let mut slopes = vec![f32::NAN; profile.rows];
    for column in (0..profile.columns).step_by(Plane::COLUMN_STRIDE) {
        let column = &profile.returns[column * profile.rows..][..profile.rows];
        let Some(&first) = column.iter().find(|seen| seen.exists()) else {
            continue;
        };
        climb(column, first, &limits, &mut slopes);
        for (seen, slope) in column.iter().zip(&slopes) {
            let is_confirmed = seen.exists() && seen.point != first.point;
            if is_confirmed && seen.height < -CLEARANCE && slope.abs() <= limits.max_slope {
                lowest.keep(seen.position());
            }
        }
    }
    lowest.positions.into_iter().flatten().collect()
}

/// The lowest position in each cell of a square around the sensor.
struct Cells {
    cell: f32,
    reach: f32,
    side: usize,
    positions: Vec<Option<[f32; 3]>>,
}

impl Cells {
    /// Most cells from the sensor to the square's edge.
    const MOST: f32 = 64.0;

    fn new(params: &GroundParams) -> Self {
        let cell = params.cell as f32;
        let reach = (params.start_distance as f32).min(Self::MOST * cell);
        let side = 2 * (reach / cell) as usize + 1;
        Cells { cell, reach, side, positions: vec![None; side * side] }
    }

    fn keep(&mut self, position: [f32; 3]) {
        let [x, y, z] = position;
        if x.abs() < self.reach && y.abs() < self.reach {
            let [row, column] = [x, y].map(|along| ((along + self.reach) / self.cell) as usize);
            let lowest = self.positions.get_mut(row * self.side + column);
            if let Some(lowest) = lowest.filter(|lowest| lowest.is_none_or(|low| z < low[2])) {
                *lowest = Some(position);
            }
        }
    }
}

/// Least squares with a weak pull to the horizontal.
fn fit<'a>(positions: impl Iterator<Item = &'a [f32; 3]>) -> Option<Plane> {
    let plane = plane_through(positions.map(|at| at.map(f64::from)), [1e-6, 1.0, 1.0])?;
    Some(Plane(plane.map(|along| along as f32).into()))
}
