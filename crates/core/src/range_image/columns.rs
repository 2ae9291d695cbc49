//! How many columns a full turn has, and where within a column the shots of a beam fall.

use std::f64::consts::{PI, TAU};

use super::image::NOWHERE;
use super::sweep::{BLOCK, Sweep, common_row};
use crate::geometry::statistics::median;

/// From azimuths to columns. Columns run clockwise seen from above, column 0 beginning behind the
/// sensor (azimuth pi) but for a beam's shift.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Columns {
    /// Columns of the full circle.
    pub count: usize,
    /// Added to the column coordinate of a row's points, in columns; empty for none. It puts the
    /// shots of a beam that fires at fixed azimuths into the middle of the columns, where noise
    /// cannot throw two of them into one.
    shift: Vec<f64>,
}

impl Columns {
    /// A given number of columns.
    pub fn new(count: usize) -> Self {
        Columns { count, shift: Vec::new() }
    }

    /// Columns as far apart as neighbouring returns of one beam, or `default` where no beam has
    /// enough returns to tell; and each beam's shift.
    pub fn of_beams(
        sweep: &Sweep,
        row: &[u16],
        rows: usize,
        given: Option<usize>,
        default: usize,
    ) -> Self {
        let found = count(sweep, row, rows);
        let mut columns = Columns::new(given.or(found).unwrap_or(default));
        let mut directions = directions(sweep, &columns);
        if given.is_none() && found.is_some() {
            let count = count_of_fixed_shots(sweep, row, rows, &columns, &directions);
            if let Some(count) = count.filter(|&count| count != columns.count) {
                columns.count = count;
                directions = self::directions(sweep, &columns);
            }
        }
        columns.shift = shifts(sweep, row, rows, &directions);
        columns
    }

    /// N: the pixel of every point of an azimuth (radians, NaN for no return) and a row below
    /// `rows`, or [`NOWHERE`].
    pub fn pixels(&self, azimuth: &[f32], row: &[u16], rows: usize) -> Vec<u32> {
        let shift = |row: usize| self.shift.get(row).copied().unwrap_or(0.0);
        let of_row: Vec<(f64, i32)> =
            (0..rows).map(|row| (shift(row), (row * self.count) as i32)).collect();
        let mut pixels = vec![NOWHERE; azimuth.len()];
        let blocks = azimuth.chunks(BLOCK).zip(row.chunks(BLOCK)).zip(pixels.chunks_mut(BLOCK));
        for ((azimuth, row), pixels) in blocks {
            self.pixels_of_block(azimuth, row, &of_row, pixels);
        }
        pixels
    }

    /// First what depends on the row is looked up, then all columns are found, then wrapped: each a
    /// loop of vector instructions. `of_row` holds the shift and the first pixel of each row.
    fn pixels_of_block(
        &self,
        azimuth: &[f32],
        row: &[u16],
        of_row: &[(f64, i32)],
        pixels: &mut [u32],
    ) {
        let (mut shift, mut first, mut column) = ([0.0; BLOCK], [0; BLOCK], [0; BLOCK]);
        if let Some(row) = common_row(row) {
            let (shift_of_row, first_of_row) = of_row[usize::from(row)];
            shift.fill(shift_of_row);
            first.fill(first_of_row);
        } else {
            for ((shift, first), &row) in shift.iter_mut().zip(&mut first).zip(row) {
                (*shift, *first) = of_row[usize::from(row)];
            }
        }
        for (column, (&azimuth, &shift)) in column.iter_mut().zip(azimuth.iter().zip(&shift)) {
            // One turn up, so that a shift to the left of column 0 wraps.
            *column = floor(self.coordinate(azimuth) + shift + self.count as f64);
        }
        let count = self.count as i32;
        let places = azimuth.iter().zip(column.iter().zip(&first));
        for (pixel, (azimuth, (&column, &first))) in pixels.iter_mut().zip(places) {
            let column = column - if column >= count { count } else { 0 };
            let column = column - if column >= count { count } else { 0 };
            *pixel = if azimuth.is_nan() { NOWHERE } else { (first + column) as u32 };
        }
    }

    #[inline]
    fn coordinate(&self, azimuth: f32) -> f64 {
        (PI - f64::from(azimuth)) / TAU * self.count as f64
    }
}

/// Columns of the full circle from the azimuth steps between neighbouring returns of some of the
/// beams: the mean of the steps about as long as the median one, so that neither jitter nor lost
/// returns count. `None` where no beam has enough returns.
fn count(sweep: &Sweep, row: &[u16], rows: usize) -> Option<usize> {
    const FEWEST_STEPS: usize = 32;
    const SAME_SHOT: f64 = 2e-5;
    let mut steps = Vec::new();
    for sample in &mut sampled_beams(sweep, row, rows) {
        // Most are stored almost in order, which a stable sort makes use of.
        sample.sort_by(f32::total_cmp);
        steps.reserve(sample.len());
        for &[before, after] in sample.array_windows() {
            let gap = f64::from(after) - f64::from(before);
            if gap > SAME_SHOT {
                steps.push(gap);
            }
        }
    }
    if steps.len() < FEWEST_STEPS {
        return None;
    }
    let typical = median(&mut steps)?;
    steps.retain(|step| (0.8 * typical..1.2 * typical).contains(step));
    let mean = steps.iter().sum::<f64>() / steps.len() as f64;
    Some(((TAU / mean).round() as usize).clamp(64, 8192))
}

/// Of about so many rows a sample is taken.
const SAMPLED_BEAMS: usize = 8;

/// The azimuths of all returns of a few rows, row by row.
fn sampled_beams(sweep: &Sweep, row: &[u16], rows: usize) -> Vec<Vec<f32>> {
    let stride = rows.div_ceil(SAMPLED_BEAMS);
    let mut samples: Vec<Vec<f32>> = vec![Vec::new(); rows.div_ceil(stride)];
    let is_chosen: Vec<bool> = (0..rows).map(|row| row.is_multiple_of(stride)).collect();
    for (rows, azimuths) in row.chunks(BLOCK).zip(sweep.azimuth.chunks(BLOCK)) {
        if common_row(rows).is_some_and(|row| !is_chosen[usize::from(row)]) {
            continue;
        }
        for (&azimuth, &row) in azimuths.iter().zip(rows) {
            let row = usize::from(row);
            if is_chosen[row] && !azimuth.is_nan() {
                samples[row / stride].push(azimuth);
            }
        }
    }
    samples
}

/// Mean resultant length from which the places of returns within their columns agree.
const AGREEMENT: f64 = 0.5;

/// Columns of the full circle of a sensor that fires at fixed azimuths, near those that its steps
/// tell: so many that the places of a beam's returns within their columns agree best. Steps tell
/// the count to one in a hundred; one column too many or too few already leads the place within a
/// column once through it on the way round, and where shots fall on borders, noise throws two of
/// them into one pixel. `None` where no count makes the places agree.
fn count_of_fixed_shots(
    sweep: &Sweep,
    row: &[u16],
    rows: usize,
    columns: &Columns,
    directions: &[[f64; 2]],
) -> Option<usize> {
    /// Sectors of the circle within which a few columns more or less make no difference.
    const SECTORS: usize = 128;
    const FARTHEST: i32 = 24;
    let stride = rows.div_ceil(SAMPLED_BEAMS);
    let mut sums = vec![[[0.0; 2]; SECTORS]; rows.div_ceil(stride)];
    let mut all = 0.0;
    for (&point, &[sin, cos]) in sweep.sample.iter().zip(directions) {
        let [point, row] = [point as usize, usize::from(row[point as usize])];
        if row.is_multiple_of(stride) {
            let turn = columns.coordinate(sweep.azimuth[point]) / columns.count as f64;
            let sector = ((turn * SECTORS as f64) as usize).min(SECTORS - 1);
            let sum = &mut sums[row / stride][sector];
            *sum = [sum[0] + sin, sum[1] + cos];
            all += 1.0;
        }
    }
    let agreement = |more: i32| -> f64 {
        let turned = |sector: usize| {
            let turn = f64::from(more) * (sector as f64 + 0.5) / SECTORS as f64;
            sin_cos_of_turns(turn + f64::from(FARTHEST))
        };
        let turns: [[f64; 2]; SECTORS] = std::array::from_fn(turned);
        let resultant = |sums: &[[f64; 2]; SECTORS]| {
            let parts = sums.iter().zip(&turns);
            let cos = parts.clone().map(|([s, c], [sin, cos])| c * cos - s * sin).sum::<f64>();
            let sin = parts.map(|([s, c], [sin, cos])| s * cos + c * sin).sum::<f64>();
            cos.hypot(sin)
        };
        sums.iter().map(resultant).sum::<f64>() / all
    };
    let agreements = (-FARTHEST..=FARTHEST).map(|more| (more, agreement(more)));
    let (more, best) = agreements.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (best > AGREEMENT).then(|| columns.count.saturating_add_signed(more as isize))
}

/// The shift of each row, from a sample of its points: what brings the circular mean of their
/// places within a column to the middle, where those places agree.
fn shifts(sweep: &Sweep, row: &[u16], rows: usize, directions: &[[f64; 2]]) -> Vec<f64> {
    let mut sums = vec![[0.0; 3]; rows];
    for (point, [sin, cos]) in sweep.sample.iter().zip(directions) {
        let sum = &mut sums[usize::from(row[*point as usize])];
        *sum = [sum[0] + cos, sum[1] + sin, sum[2] + 1.0];
    }
    let shift = |[cos, sin, n]: [f64; 3]| {
        if cos.hypot(sin) <= AGREEMENT * n {
            return 0.0;
        }
        0.5 - (sin.atan2(cos) / TAU).rem_euclid(1.0)
    };
    sums.into_iter().map(shift).collect()
}

/// Sine and cosine of the place within its column of each point of the sample, a column being a
/// turn.
fn directions(sweep: &Sweep, columns: &Columns) -> Vec<[f64; 2]> {
    let azimuths: Vec<f32> = sweep.sample.iter().map(|&p| sweep.azimuth[p as usize]).collect();
    azimuths.into_iter().map(|azimuth| sin_cos_of_turns(columns.coordinate(azimuth))).collect()
}

/// The largest integer not above a number from 0 to 2^31, in vector instructions of every
/// processor.
#[inline]
fn floor(x: f64) -> i32 {
    // Adding this rounds to an integer, which the lowest bits of the sum then hold.
    const ROUNDS: f64 = (1_u64 << 52) as f64;
    let rounded = x + ROUNDS;
    let is_above = rounded - ROUNDS > x;
    (rounded - if is_above { 1.0 } else { 0.0 }).to_bits() as i32
}

/// Sine and cosine of an angle in turns, of less than 2^49 turns, by their Taylor series within an
/// eighth of a turn: to 4e-16, the same bits everywhere, and in vector instructions.
fn sin_cos_of_turns(turns: f64) -> [f64; 2] {
    // Adding this rounds to an integer, which the lowest bits of the sum then hold.
    const ROUNDS: f64 = 1.5 * (1_u64 << 52) as f64;
    let rounded = 4.0 * turns + ROUNDS;
    let quarters = rounded.to_bits();
    let angle = (turns - (rounded - ROUNDS) * 0.25) * TAU;
    let square = angle * angle;
    let (mut sin, mut cos) = (1.0, 1.0);
    for n in [14.0, 12.0, 10.0, 8.0, 6.0, 4.0, 2.0] {
        sin = 1.0 - square * sin * (1.0 / (n * (n + 1.0)));
        cos = 1.0 - square * cos * (1.0 / ((n + 1.0) * (n + 2.0)));
    }
    cos = 1.0 - square * cos * 0.5;
    sin *= angle;
    let (sin, cos) = if quarters & 1 == 0 { (sin, cos) } else { (cos, sin) };
    let signed = |value: f64, half: u64| f64::from_bits(value.to_bits() ^ ((half & 2) << 62));
    [signed(sin, quarters), signed(cos, quarters.wrapping_add(1))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_and_cosines_agree_with_the_library() {
        for step in -100_000..=100_000 {
            let turns = f64::from(step) * 3.217e-5;
            let [sin, cos] = sin_cos_of_turns(turns);
            let expected = (turns.rem_euclid(1.0) * TAU).sin_cos();
            let error = (sin - expected.0).abs().max((cos - expected.1).abs());
            assert!(error < 2e-15, "{turns}: {sin} {cos} for {expected:?}");
        }
    }

    #[test]
    fn floor_is_the_library_s() {
        for step in 0..100_000_u32 {
            let x = f64::from(step) / 16.0;
            for x in [x, x.next_up(), x.next_down().max(0.0), x * 7919.0] {
                assert_eq!(f64::from(floor(x)), x.floor());
            }
        }
    }

    #[test]
    fn columns_wrap_at_the_seam_whatever_the_shift() {
        for (count, shift) in [(1, 0.5), (1, -0.5), (7, 0.5), (7, -0.5), (2083, 0.3)] {
            let columns = Columns { count, shift: vec![0.0, shift] };
            let steps = -1000..=1000;
            let azimuths: Vec<f32> = steps.map(|step| step as f32 * 0.00314).collect();
            let rows = vec![1; azimuths.len()];
            for (azimuth, pixel) in azimuths.iter().zip(columns.pixels(&azimuths, &rows, 2)) {
                let turns = (PI - f64::from(*azimuth)) / TAU;
                let column = (turns * count as f64 + shift).rem_euclid(count as f64);
                assert_eq!(pixel as usize, count + column as usize, "{azimuth} of {count}");
            }
        }
        assert_eq!(Columns::new(9).pixels(&[f32::NAN], &[0], 1), [NOWHERE]);
    }
}
