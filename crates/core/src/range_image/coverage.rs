//! How much of the circle around the sensor a scan covers.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use super::sweep::Sweep;
use crate::geometry::circle::longest_gap;

/// A scan with a larger gap does not close, radians.
const LEAST_GAP: f64 = 20.0 * PI / 180.0;
/// Bins of azimuth, half a degree each.
const BINS: usize = 720;

/// Whether nothing was measured around azimuth pi, where the columns begin and end, and the gap is
/// wider than a scan that closes has.
pub(super) fn is_open_behind(sweep: &Sweep) -> bool {
    const FEW: usize = 4 * BINS;
    let occupied = if sweep.sample.len() < FEW {
        occupied(sweep.azimuth.iter().copied())
    } else {
        occupied(sweep.sample.iter().map(|&point| sweep.azimuth[point as usize]))
    };
    largest_gap(&occupied).is_some_and(|gap| gap.end >= BINS)
}

/// The azimuths that a scan covers in radians, from right to left: start and width. All of the
/// circle where it closes.
pub(super) fn covered(azimuths: impl Iterator<Item = f32>) -> (f64, f64) {
    let angle = |bins: usize| bins as f64 * TAU / BINS as f64;
    match largest_gap(&occupied(azimuths)) {
        None => (-PI, TAU),
        Some(gap) => {
            let start = angle(gap.end % BINS) - PI;
            (start, TAU - angle(gap.len()))
        }
    }
}

fn occupied(azimuths: impl Iterator<Item = f32>) -> Vec<bool> {
    let mut occupied = vec![false; BINS];
    for azimuth in azimuths.filter(|azimuth| !azimuth.is_nan()) {
        let bin = (f64::from(azimuth) + PI) / TAU * BINS as f64;
        occupied[(bin as usize).min(BINS - 1)] = true;
    }
    occupied
}

/// The largest gap in bins, which may run beyond the last one; `None` where the scan closes, and of
/// no return.
fn largest_gap(occupied: &[bool]) -> Option<Range<usize>> {
    longest_gap(occupied).filter(|gap| gap.len() as f64 * TAU / BINS as f64 > LEAST_GAP)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees(range: Range<i32>) -> impl Iterator<Item = f32> {
        range.map(|degree| {
            ((degree as f32 + 0.2).to_radians() + 3.0 * PI as f32).rem_euclid(TAU as f32)
                - PI as f32
        })
    }

    #[test]
    fn covers_are_what_was_measured() {
        let of = |range| {
            let (start, width) = covered(degrees(range));
            (start.to_degrees().round() as i32, width.to_degrees().round() as i32)
        };
        assert_eq!(of(-180..180), (-180, 360));
        assert_eq!(of(-175..175), (-180, 360), "ten degrees are no gap");
        assert_eq!(of(-60..60), (-60, 120));
        assert_eq!(of(120..240), (120, 120));
        assert_eq!(covered(std::iter::empty()), (-PI, TAU));
    }

    #[test]
    fn the_seam_is_open_only_where_nothing_was_measured() {
        let is_open = |range: Range<i32>| {
            largest_gap(&occupied(degrees(range))).is_some_and(|gap| gap.end >= BINS)
        };
        assert!(is_open(-60..60));
        assert!(!is_open(120..240), "the sensor looks back");
        assert!(!is_open(-180..180));
    }
}
