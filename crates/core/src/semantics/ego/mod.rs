//! The body of the vehicle that carries the sensor, by what stays put while all else moves.
//!
//! A vehicle's own roof, bonnet or mirrors return the same beams from the same places in every
//! cloud. So do three other things, which are told apart:
//!
//! - *Everything*, where the vehicle stands. Then much of what stands farther away stays put as
//!   well, and nothing can be known.
//! - *Level ground*, whose rings keep their places. A body stands above the plane of the ground.
//! - *Walls and rails* along a straight way. They go on beyond what is near, and a body ends.
//!
//! Places are cubes of the clouds' own frame, so that it makes no difference where the sensor
//! stands in it.

use std::collections::{HashMap, HashSet};

use super::{GroundParams, ground_of};
use crate::cloud::ego_body::{Cell, EgoBody};
use crate::cloud::{PointCloud, wide};
use crate::geometry::plane_fit::plane_through;
use crate::geometry::statistics::median;
use crate::range_image::{ProjectionParams, RangeImage};
use nalgebra::Vector3;

/// Distance from the sensor within which a body ends, metres.
const REACH: f64 = 5.0;
/// Distance up to which what stays put is followed, metres: what goes on beyond `REACH` is no body.
const FOLLOWED: f64 = 8.0;
/// Distance up to which surroundings are looked at for whether they move, metres, and the edge of
/// the cubes that they are compared by.
const SURROUNDINGS: f64 = 40.0;
const COARSE: f64 = 0.5;
/// Cubes of the surroundings with fewer returns in a cloud are empty in others by chance.
const DENSE: u64 = 4;
/// Where a body is, nearly all clouds have a return; the rest is lost to noise.
const NEARLY_ALL: f64 = 0.9;
/// What has returns in fewer of the clouds is no part of a piece that stays put.
const MOST: f64 = 0.5;
/// Share of the returns of the surroundings that cubes with enough of them must have.
const COMPARABLE: f64 = 0.01;
/// The surroundings stand still where this share of their returns lies where nearly all clouds have
/// one. On simulated drives of a sensor that moves it is 0.65 at most, in a narrow yard within 2 s;
/// of one that stands 0.8 at least (the tests print it).
const STILL: f64 = 0.7;

/// What the clouds of a topic say of the vehicle's own body.
#[derive(Debug, Clone, PartialEq)]
pub struct EgoFinding {
    /// Clouds that were compared.
    pub clouds: usize,
    /// The body, without a cube where nothing stays put; or why it cannot be known.
    pub body: Result<EgoBody, EgoUnknown>,
}

/// Why the body of a vehicle cannot be told from what is around it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EgoUnknown {
    /// There are too few clouds with a return.
    FewClouds,
    /// Too few of the clouds have a ground that a body would stand above.
    NoGround,
    /// The surroundings have too few returns to be compared.
    Sparse,
    /// Nothing moves in the clouds' frame.
    NothingMoves,
}

/// Compares clouds of one topic.
#[derive(Debug, Clone, Default)]
pub struct EgoSearch {
    /// Clouds, and those with ground, which alone are compared.
    clouds: usize,
    compared: usize,
    near: HashMap<Cell, Near>,
    around: HashMap<Cell, Around>,
}

/// A cube near the sensor.
#[derive(Debug, Clone, Default)]
struct Near {
    /// A bit for each cloud that has a return in it.
    clouds: u64,
    /// Greatest distance of a return from the sensor, metres.
    distance: f64,
}

/// A cube farther away.
#[derive(Debug, Clone, Default)]
struct Around {
    /// A bit for each cloud that has a return in it.
    clouds: u64,
    returns: u64,
}

impl EgoSearch {
    /// As many clouds are compared at most.
    pub const CLOUDS: usize = 24;
    /// With fewer nothing is said.
    pub const FEWEST: usize = 8;

    /// Takes one more cloud, upright; those beyond [`CLOUDS`](Self::CLOUDS) are left out.
    pub fn take(&mut self, cloud: &PointCloud, projection: &ProjectionParams) {
        if self.clouds == EgoSearch::CLOUDS || (0..cloud.len()).all(|at| !cloud.is_return(at)) {
            return;
        }
        self.clouds += 1;
        let image = RangeImage::new(cloud, projection);
        let sensors: Vec<Vector3<f64>> =
            image.bands.iter().map(|band| band.sensor.translation.vector).collect();
        let Some(ground) = GroundPlane::of(cloud, &image, sensors[0]) else { return };
        let bit = 1 << self.compared;
        self.compared += 1;
        for point in (0..cloud.len()).filter(|&point| cloud.is_return(point)) {
            let at = Vector3::from(wide(cloud.position(point)));
            if ground.height_over(&at) < ground.clearance {
                continue;
            }
            let distances = sensors.iter().map(|sensor| (at - sensor).norm());
            let distance = distances.fold(f64::INFINITY, f64::min);
            let recorded = cloud.recorded_metres(at.into());
            if distance < FOLLOWED {
                let near = self.near.entry(EgoBody::cell_of(recorded, EgoBody::EDGE)).or_default();
                near.clouds |= bit;
                near.distance = near.distance.max(distance);
            } else if distance < SURROUNDINGS {
                let around = self.around.entry(EgoBody::cell_of(recorded, COARSE)).or_default();
                around.clouds |= bit;
                around.returns += 1;
            }
        }
    }

    /// What the clouds say.
    pub fn finding(&self) -> EgoFinding {
        let body = match self {
            _ if self.clouds < EgoSearch::FEWEST => Err(EgoUnknown::FewClouds),
            _ if self.compared < EgoSearch::FEWEST => Err(EgoUnknown::NoGround),
            _ => match self.share_at_rest() {
                None => Err(EgoUnknown::Sparse),
                Some(share) if share > STILL => Err(EgoUnknown::NothingMoves),
                Some(_) => Ok(self.body()),
            },
        };
        EgoFinding { clouds: self.clouds, body }
    }

    /// Whether nearly all clouds, by their bits, have a return.
    fn is_steady(&self, clouds: u64) -> bool {
        f64::from(clouds.count_ones()) >= NEARLY_ALL * self.compared as f64
    }

    /// The share of the returns of the surroundings that lie where nearly all clouds have some;
    /// `None` where too few returns can be compared.
    fn share_at_rest(&self) -> Option<f64> {
        let (mut all, mut dense, mut at_rest) = (0, 0, 0);
        for &Around { clouds, returns } in self.around.values() {
            all += returns;
            if returns >= DENSE * u64::from(clouds.count_ones()) {
                dense += returns;
                at_rest += if self.is_steady(clouds) { returns } else { 0 };
            }
        }
        let is_comparable = dense as f64 > COMPARABLE * all as f64;
        is_comparable.then(|| at_rest as f64 / dense as f64)
    }

    /// What stays put near the sensor and ends there, with the cubes that touch it.
    ///
    /// Pieces are made of cubes that have a return in most clouds, and with those around them in
    /// nearly all. Half of the cubes of a body have one in nearly all clouds by themselves, as the
    /// same beams meet it at the same place: rows of parked cars are no bodies.
    fn body(&self) -> EgoBody {
        let clouds_at = |cell: &Cell| self.near.get(cell).map_or(0, |near| near.clouds);
        let is_put = |cell: &Cell| {
            let own = f64::from(clouds_at(cell).count_ones());
            let around = touching(*cell).map(|next| clouds_at(&next));
            own >= MOST * self.compared as f64
                && self.is_steady(around.fold(0, |all, clouds| all | clouds))
        };
        let mut left: HashSet<Cell> = self.near.keys().copied().filter(is_put).collect();
        let mut body = HashSet::new();
        while let Some(&start) = left.iter().next() {
            let piece = connected(start, &mut left);
            let steady = piece.iter().filter(|cell| self.is_steady(clouds_at(cell))).count();
            let ends = piece.iter().all(|cell| self.near[cell].distance < REACH);
            if ends && 2 * steady >= piece.len() {
                body.extend(piece);
            }
        }
        let edges = body.iter().copied().flat_map(touching);
        let edges: Vec<Cell> = edges.filter(|cell| clouds_at(cell).count_ones() > 1).collect();
        body.extend(edges);
        EgoBody::of_cells(body)
    }
}

/// A cube and the 26 that touch it.
fn touching([x, y, z]: Cell) -> impl Iterator<Item = Cell> {
    let steps = || -1..=1;
    steps()
        .flat_map(move |i| steps().flat_map(move |j| steps().map(move |k| [x + i, y + j, z + k])))
}

/// Takes the cubes that touch each other, beginning with one, out of those that are left.
fn connected(start: Cell, left: &mut HashSet<Cell>) -> Vec<Cell> {
    left.remove(&start);
    let mut piece = vec![start];
    let mut seen = 0;
    while let Some(&cell) = piece.get(seen) {
        piece.extend(touching(cell).filter(|next| left.remove(next)));
        seen += 1;
    }
    piece
}

/// The plane of the ground around a sensor.
struct GroundPlane {
    /// Height at the origin, and its increase along x and y.
    plane: Vector3<f64>,
    /// How far above it a return is no ground for certain, metres.
    clearance: f64,
}

impl GroundPlane {
    /// `None` where no ground is found below the sensor.
    fn of(cloud: &PointCloud, image: &RangeImage, sensor: Vector3<f64>) -> Option<Self> {
        /// Distance across the ground within which the plane is fitted, metres.
        const AROUND: f64 = 15.0;
        /// Square metres with ground, of which half must lie within the last band of the plane.
        const FEWEST: usize = 16;
        const BANDS: [f64; 3] = [0.5, 0.3, 0.2];
        /// As a share of the height of the sensor, and the limits of that, metres: a kerb and the
        /// pitch of a car, less of a small robot.
        const CLEARANCE: f64 = 0.15;
        const LIMITS: [f64; 2] = [0.08, 0.25];
        let found = ground_of(cloud, image, &GroundParams::default());
        if found.is_missing || found.is_overhead {
            return None;
        }
        let mut lowest: HashMap<[i32; 2], [f64; 3]> = HashMap::new();
        for point in (0..cloud.len()).filter(|&point| found.is_ground[point]) {
            let at = Vector3::from(wide(cloud.position(point))) - sensor;
            if at.xy().norm() < AROUND {
                let square = [at.x.floor() as i32, at.y.floor() as i32];
                let lowest = lowest.entry(square).or_insert_with(|| at.into());
                if at.z < lowest[2] {
                    *lowest = at.into();
                }
            }
        }
        let mut cells: Vec<[f64; 3]> = lowest.into_values().collect();
        let count = cells.len();
        let mut heights: Vec<f64> = cells.iter().map(|at| at[2]).collect();
        let mut plane = Vector3::new(median(&mut heights)?, 0.0, 0.0);
        cells.sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
        for band in BANDS {
            cells.retain(|&[x, y, z]| (z - plane.dot(&Vector3::new(1.0, x, y))).abs() < band);
            plane = plane_through(cells.iter().copied(), [1e-6; 3])?;
        }
        let height = -plane.x;
        if count < FEWEST || 2 * cells.len() < count || height <= LIMITS[0] {
            return None;
        }
        let clearance = (CLEARANCE * height).clamp(LIMITS[0], LIMITS[1]);
        plane.x += sensor.z - plane.y * sensor.x - plane.z * sensor.y;
        Some(GroundPlane { plane, clearance })
    }

    /// How far a position lies over the plane, metres.
    fn height_over(&self, at: &Vector3<f64>) -> f64 {
        at.z - self.plane.dot(&Vector3::new(1.0, at.x, at.y))
    }
}

#[cfg(test)]
mod tests;
