//! What a message covers of a turn.

use std::f64::consts::{PI, TAU};

use divmerge_core::cloud::PointCloud;
use divmerge_core::geometry::circle::longest_gap;

/// Bins of azimuth in which returns are counted, ten for each degree.
const BINS: usize = 3600;

/// What a message covers of a turn, about the origin of its frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Part {
    /// Stamp of the cloud, nanoseconds since 1970.
    pub(super) stamp_ns: i64,
    /// Returns.
    pub(super) returns: usize,
    /// Mean azimuth of the returns, radians; `None` without returns.
    pub(super) direction: Option<f64>,
    /// The smallest sector with all returns, radians.
    pub(super) width: f64,
}

impl Part {
    pub(super) fn of(cloud: &PointCloud, stamp_ns: i64) -> Self {
        let (mut sum, mut returns, mut bins) = ([0.0, 0.0], 0, [false; BINS]);
        for (&x, &y) in cloud.x.iter().zip(&cloud.y) {
            let (x, y) = (f64::from(x), f64::from(y));
            let range = x.hypot(y);
            if !range.is_finite() || range == 0.0 {
                continue;
            }
            returns += 1;
            sum = [sum[0] + x / range, sum[1] + y / range];
            let turn = (y.atan2(x) + PI) / TAU;
            bins[((turn * BINS as f64) as usize).min(BINS - 1)] = true;
        }
        let direction = (returns > 0).then(|| sum[1].atan2(sum[0]));
        Part { stamp_ns, returns, direction, width: width(&bins) }
    }
}

/// The whole circle but for the longest run of empty bins; radians.
fn width(bins: &[bool; BINS]) -> f64 {
    longest_gap(bins).map_or(0.0, |gap| (BINS - gap.len()) as f64 * TAU / BINS as f64)
}

/// From one direction to another by the shorter way, -pi to pi.
pub(super) fn step(from: f64, to: f64) -> f64 {
    (to - from + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(degrees: &[f64]) -> Part {
        let (x, y): (Vec<f32>, Vec<f32>) = degrees
            .iter()
            .map(|degrees| degrees.to_radians().sin_cos())
            .map(|(sin, cos)| (5.0 * cos as f32, 5.0 * sin as f32))
            .unzip();
        Part::of(&PointCloud::new(x, y, vec![0.0; degrees.len()]).unwrap(), 0)
    }

    #[test]
    fn a_sector_is_seen_across_the_back() {
        let found = part(&[170.5, 175.5, -179.5, -170.5]);
        assert!((found.width.to_degrees() - 20.0).abs() < 1.5, "{found:?}");
        assert!((step(found.direction.unwrap().to_degrees(), 178.99)).abs() < 1.5, "{found:?}");
        assert_eq!(part(&[]).direction, None);
        assert!(part(&(0..360).map(f64::from).collect::<Vec<_>>()).width.to_degrees() > 358.0);
    }

    #[test]
    fn steps_go_the_shorter_way() {
        assert!((step(3.0, -3.0) - (TAU - 6.0)).abs() < 1e-9);
        assert!((step(-3.0, 3.0) + (TAU - 6.0)).abs() < 1e-9);
    }
}
