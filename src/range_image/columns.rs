//! How many columns a full turn has, and where within a column the shots of a beam fall.

use std::f64::consts::{PI, TAU};

use super::{is_sampled, median};
use crate::cloud::PointCloud;

/// From azimuths to columns. Columns run clockwise seen from above, column 0 beginning behind the sensor
/// (azimuth pi) but for a beam's shift.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Columns {
    /// Columns of the full circle.
    pub count: usize,
    /// Added to the column coordinate of a row's points, in columns; empty for none. It puts the shots
    /// of a beam that fires at fixed azimuths into the middle of the columns, where noise cannot throw
    /// two of them into one.
    shift: Vec<f64>,
}

impl Columns {
    /// A given number of columns.
    pub fn new(count: usize) -> Self {
        Columns { count, shift: Vec::new() }
    }

    /// Columns as far apart as neighbouring returns of one beam, or `default` where no beam has enough
    /// returns to tell; and each beam's shift.
    pub fn of_beams(
        cloud: &PointCloud,
        azimuths: &[f32],
        row: &[u16],
        rows: usize,
        given: Option<usize>,
        default: usize,
    ) -> Self {
        let count = given.or_else(|| count(cloud, azimuths, row, rows)).unwrap_or(default);
        let mut columns = Columns::new(count);
        columns.shift = shifts(cloud, azimuths, row, rows, &columns);
        columns
    }

    /// The column of an azimuth (radians) in a row.
    pub fn of(&self, azimuth: f32, row: u16) -> usize {
        let shift = self.shift.get(usize::from(row)).copied().unwrap_or(0.0);
        let column = self.coordinate(azimuth) + shift;
        // One turn up, so that a shift to the left of column 0 wraps.
        (column + self.count as f64) as usize % self.count
    }

    fn coordinate(&self, azimuth: f32) -> f64 {
        (PI - f64::from(azimuth)) / TAU * self.count as f64
    }
}

/// Columns of the full circle from the azimuth steps between neighbouring returns of some of the beams:
/// the mean of the steps about as long as the median one, so that neither jitter nor lost returns count.
/// `None` where no beam has enough returns.
fn count(cloud: &PointCloud, azimuths: &[f32], row: &[u16], rows: usize) -> Option<usize> {
    const SAMPLED_BEAMS: usize = 8;
    const FEWEST_STEPS: usize = 32;
    const SAME_SHOT: f64 = 2e-5;
    let stride = rows.div_ceil(SAMPLED_BEAMS);
    let mut samples: Vec<Vec<f32>> = vec![Vec::new(); rows.div_ceil(stride)];
    for (point, &row) in row.iter().enumerate() {
        let row = usize::from(row);
        if row.is_multiple_of(stride) && cloud.is_return(point) {
            samples[row / stride].push(azimuths[point]);
        }
    }
    let mut steps = Vec::new();
    for sample in &mut samples {
        sample.sort_unstable_by(f32::total_cmp);
        let gaps = sample.windows(2).map(|pair| f64::from(pair[1]) - f64::from(pair[0]));
        steps.extend(gaps.filter(|&gap| gap > SAME_SHOT));
    }
    if steps.len() < FEWEST_STEPS {
        return None;
    }
    let typical = median(&mut steps)?;
    steps.retain(|step| (0.8 * typical..1.2 * typical).contains(step));
    let mean = steps.iter().sum::<f64>() / steps.len() as f64;
    Some(((TAU / mean).round() as usize).clamp(64, 8192))
}

/// The shift of each row, from a sample of its points: what brings the circular mean of their places
/// within a column to the middle, where those places agree (mean resultant length above one half).
fn shifts(
    cloud: &PointCloud,
    azimuths: &[f32],
    row: &[u16],
    rows: usize,
    columns: &Columns,
) -> Vec<f64> {
    const AGREEMENT: f64 = 0.5;
    let mut sums = vec![[0.0; 3]; rows];
    for (point, &row) in row.iter().enumerate() {
        if !is_sampled(cloud, point) || !cloud.is_return(point) {
            continue;
        }
        let (sin, cos) = (TAU * columns.coordinate(azimuths[point]).fract()).sin_cos();
        let sum = &mut sums[usize::from(row)];
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
