//! How many columns a full turn has.

use std::f64::consts::TAU;

use super::median;
use crate::cloud::PointCloud;

/// Columns of the full circle from the azimuth step between neighbouring returns of one beam: the
/// median step over a sample of the beams. `None` where no beam has enough returns.
pub(super) fn count(
    cloud: &PointCloud,
    azimuths: &[f32],
    row: &[u16],
    rows: usize,
) -> Option<usize> {
    const SAMPLED_BEAMS: usize = 8;
    const FEWEST_STEPS: usize = 32;
    const SAME_SHOT: f64 = 2e-5;
    let stride = rows.div_ceil(SAMPLED_BEAMS);
    let mut samples: Vec<Vec<f32>> = vec![Vec::new(); rows.div_ceil(stride)];
    for (point, &row) in row.iter().enumerate() {
        let row = usize::from(row);
        if row % stride == 0 && cloud.is_return(point) {
            samples[row / stride].push(azimuths[point]);
        }
    }
    let mut steps = Vec::new();
    for sample in &mut samples {
        sample.sort_unstable_by(f32::total_cmp);
        let gaps = sample
            .windows(2)
            .map(|pair| f64::from(pair[1]) - f64::from(pair[0]));
        steps.extend(gaps.filter(|&gap| gap > SAME_SHOT));
    }
    if steps.len() < FEWEST_STEPS {
        return None;
    }
    let columns = (TAU / median(&mut steps)?).round() as usize;
    Some(columns.clamp(64, 8192))
}
