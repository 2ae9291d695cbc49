//! Points that are no returns though they have a position: what drivers and nodes put where a beam
//! came back with nothing.
//!
//! Zeros are moved along when a cloud is transformed to another frame, so that thousands of points
//! have one position. Other drivers fill in the maximum range, so that points stand on a sphere
//! around the sensor. Both are told by what no surface does, whatever the frame.

use super::extent::{middle, sample, squared_distance};
use super::point_cloud::PointCloud;

/// Share of the points, and their number, from which on a crowd of points may be fill values. A
/// patch of 1 cm half a metre away, in coordinates that are rounded to centimetres, fills less than
/// a thousandth of any sensor's view.
const LEAST_SHARE: f64 = 0.005;
const FEWEST_POINTS: usize = 64;

impl PointCloud {
    /// The same cloud with NaN for the positions that are fill values: one that a crowd of points
    /// has to the bit; and the farthest range, where a crowd has exactly that in many directions,
    /// or lies beyond a gap that leaves out half of all ranges, farther than sensors reach (of
    /// clouds in metres). O(N).
    pub fn without_fill_values(mut self) -> Self {
        let crowd = FEWEST_POINTS.max((LEAST_SHARE * self.len() as f64) as usize);
        for position in repeated_positions(&self, crowd) {
            drop_points(&mut self, |at| bits(at) == position);
        }
        if let Some(least) = filled_range(&self, [0.0; 3], crowd, same_range) {
            drop_points(&mut self, |at| squared_distance(at, [0.0; 3]) >= least);
        }
        let middle = middle(&self);
        if let Some(least) = filled_range(&self, middle, crowd, beyond_a_gap) {
            let whole = self.clone();
            drop_points(&mut self, |at| squared_distance(at, middle) >= least);
            if self.immense_extent().is_some() {
                // What is left is no sweep in metres: the unit is another, not the far points odd.
                return whole;
            }
        }
        self
    }
}

fn drop_points(cloud: &mut PointCloud, is_fill: impl Fn([f32; 3]) -> bool) {
    for point in 0..cloud.len() {
        if cloud.is_return(point) && is_fill(cloud.position(point)) {
            cloud.set_position(point, [f32::NAN; 3]);
        }
    }
}

fn bits(position: [f32; 3]) -> [u32; 3] {
    position.map(f32::to_bits)
}

/// The positions that at least a crowd of returns have. A look at some thousand points finds those
/// that may be, which all points are then counted for.
fn repeated_positions(cloud: &PointCloud, crowd: usize) -> Vec<[u32; 3]> {
    /// Of a crowd, the look finds twenty on average.
    const SUSPICIOUS: usize = 3;
    let seen = sample(cloud).filter(|&point| cloud.is_return(point));
    let mut seen: Vec<[u32; 3]> = seen.map(|point| bits(cloud.position(point))).collect();
    seen.sort_unstable();
    let suspects = seen.chunk_by(|a, b| a == b).filter(|same| same.len() >= SUSPICIOUS);
    let is_crowd = |position: &[u32; 3]| {
        (0..cloud.len()).filter(|&p| bits(cloud.position(p)) == *position).count() >= crowd
    };
    suspects.map(|same| same[0]).filter(is_crowd).collect()
}

/// Given the farthest range and the ranges of some returns: the range from which on they may be
/// fill values.
type Shell = fn(f64, &[f64]) -> Option<f64>;

/// One range, but for rounding.
fn same_range(farthest: f64, _: &[f64]) -> Option<f64> {
    const ROUNDING: f64 = 1e-5;
    Some(farthest * (1.0 - ROUNDING))
}

/// Ranges that nothing but the farthest points reaches, beyond half of which there is nothing else.
fn beyond_a_gap(farthest: f64, some: &[f64]) -> Option<f64> {
    /// No sensor that drives reaches farther, metres.
    const REACH: f64 = 500.0;
    /// Seen from the middle of the returns in place of the sensor, a sphere is this thick at most.
    const THICKNESS: f64 = 0.1;
    let least = farthest * (1.0 - THICKNESS);
    let is_in_gap = |range: &&f64| (farthest / 2.0..least).contains(*range);
    let stray = some.iter().filter(is_in_gap).count();
    (farthest > REACH && stray * 1000 <= some.len()).then_some(least)
}

/// The squared distance from a place from which on returns are fill values.
fn filled_range(cloud: &PointCloud, from: [f64; 3], crowd: usize, shell: Shell) -> Option<f64> {
    let returns = || (0..cloud.len()).filter(|&point| cloud.is_return(point));
    let squared = |point: usize| squared_distance(cloud.position(point), from);
    let farthest = returns().map(squared).fold(0.0, f64::max).sqrt();
    let some = sample(cloud).filter(|&point| cloud.is_return(point));
    let some: Vec<f64> = some.map(|point| squared(point).sqrt()).collect();
    let least = shell(farthest, &some)?;
    let beyond: Vec<usize> = returns().filter(|&point| squared(point) >= least * least).collect();
    (farthest > 0.0 && beyond.len() >= crowd && are_all_around(cloud, &beyond, farthest))
        .then_some(least * least)
}

/// Whether points stand in as many directions as no surface has at one range.
fn are_all_around(cloud: &PointCloud, points: &[usize], range: f64) -> bool {
    const WIDTH: f64 = 0.3;
    let extent = |axis: &[f32]| {
        let along = points.iter().map(|&point| f64::from(axis[point]));
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    };
    extent(&cloud.x).max(extent(&cloud.y)) > WIDTH * range
}
