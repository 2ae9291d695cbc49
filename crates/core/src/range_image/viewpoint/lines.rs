//! Beams that no field numbers: the lines on which elevations crowd.

use nalgebra::Vector3;

use super::cones::RingReturn;
use super::search::direction;

/// The returns that lie on one of the lines on which elevations crowd, seen from a place, each with
/// the number of its line.
pub(super) fn returns_by_line(returns: &[Vector3<f32>], place: &Vector3<f32>) -> Vec<RingReturn> {
    /// Width of a bin of elevation, radians: a twentieth of a degree.
    const BIN: f32 = std::f32::consts::PI / 3600.0;
    /// A line is the fullest of so many bins on either side, and holds the returns of those.
    const NEAR: usize = 2;
    const BINS: usize = 3602;
    /// Fewer returns to a line, on average, crowd nowhere.
    const FEWEST: usize = 16;
    let bin = |at: &Vector3<f32>| {
        let up = direction(at, place)[1] + std::f32::consts::FRAC_PI_2;
        ((up / BIN) as usize).min(BINS - 1)
    };
    let bins: Vec<usize> = returns.iter().map(bin).collect();
    let mut counts = vec![0_u32; BINS];
    for &bin in &bins {
        counts[bin] += 1;
    }
    let is_line = |bin: usize| {
        let near = bin.saturating_sub(NEAR)..(bin + NEAR + 1).min(BINS);
        // Of equal ones the lowest.
        counts[bin] > 0
            && near.into_iter().all(|other| {
                counts[other] < counts[bin] || (counts[other] == counts[bin] && other >= bin)
            })
    };
    let mut line_of_bin = vec![usize::MAX; BINS];
    let lines: Vec<usize> = (0..BINS).filter(|&bin| is_line(bin)).collect();
    if returns.len() < FEWEST * lines.len() {
        return Vec::new();
    }
    for (number, line) in lines.into_iter().enumerate() {
        line_of_bin[line.saturating_sub(NEAR)..(line + NEAR + 1).min(BINS)].fill(number);
    }
    let numbered = returns.iter().zip(bins).filter(|(_, bin)| line_of_bin[*bin] != usize::MAX);
    numbered.map(|(at, bin)| RingReturn { position: at.cast(), ring: line_of_bin[bin] }).collect()
}
