//! Where a cloud lies, and how far it reaches.

use super::point_cloud::{PointCloud, wide};
use crate::geometry::statistics::{median, median_by};

impl PointCloud {
    /// Half of the returns are farther than this from their middle, in metres, where that is
    /// farther than in the sweep of any sensor: then the coordinates are in a smaller unit.
    pub fn immense_extent(&self) -> Option<f64> {
        /// Half of a sweep's returns lie within 5 to 40 m, where the view is widest within 100 m.
        const FARTHEST: f64 = 250.0;
        let middle = middle(self);
        let returns = sample(self).filter(|&point| self.is_return(point));
        let distances = returns.map(|point| squared_distance(self.position(point), middle).sqrt());
        median(&mut distances.collect::<Vec<f64>>()).filter(|&extent| extent > FARTHEST)
    }
}

/// Some thousand points, spread over the cloud without a pattern; all of a small one.
pub(super) fn sample(cloud: &PointCloud) -> impl Iterator<Item = usize> {
    const MOST: usize = 4096;
    const GOLDEN: u32 = 0x9E37_79B9;
    let count = cloud.len();
    let spread = move |i: usize| {
        let turn = u64::from((i as u32).wrapping_mul(GOLDEN));
        ((turn * count as u64) >> 32) as usize
    };
    (0..count.min(MOST)).map(move |i| if count <= MOST { i } else { spread(i) })
}

/// The median of the returns along each axis, from some of them; the origin without a return.
pub(super) fn middle(cloud: &PointCloud) -> [f64; 3] {
    let returns: Vec<usize> = sample(cloud).filter(|&point| cloud.is_return(point)).collect();
    let along = |axis: &[f32]| {
        let mut values: Vec<f32> = returns.iter().map(|&point| axis[point]).collect();
        f64::from(median_by(&mut values, f32::total_cmp).unwrap_or(0.0))
    };
    [along(&cloud.x), along(&cloud.y), along(&cloud.z)]
}

/// Squared distance of a position from a place, square metres.
pub(super) fn squared_distance(at: [f32; 3], from: [f64; 3]) -> f64 {
    let at = wide(at);
    (0..3).map(|axis| (at[axis] - from[axis]).powi(2)).sum()
}
