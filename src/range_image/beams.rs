//! Which beam measured a point, where the driver does not say, and in which order the beams lie.

use std::f64::consts::{PI, TAU};

use super::{elevation, is_sampled, median};
use crate::cloud::PointCloud;

/// A sensor with more beams than this is not known; a larger ring number is not a beam.
const MOST_BEAMS: usize = 1024;

/// Row of each ring number, row 0 the highest: rings sorted by the median elevation of their returns.
/// Where that is all but monotone in the ring number, plain ascending or descending order is used, so
/// that a ring with few returns cannot fall out of line. `None` if the numbers cannot be beams.
pub(super) fn row_of_ring(cloud: &PointCloud, ring: &[u16]) -> Option<Vec<u16>> {
    let medians = median_slopes(cloud, ring)?;
    let known: Vec<f64> = medians.iter().copied().flatten().collect();
    let rising = known.windows(2).filter(|pair| pair[1] > pair[0]).count();
    let steps = known.len().saturating_sub(1);

    let rings = medians.len();
    let mut order: Vec<usize> = (0..rings).collect();
    if rising * 10 >= steps * 9 && steps > 0 {
        order.reverse();
    } else if rising * 10 > steps {
        let height = |ring: usize| medians[ring].unwrap_or(f64::NEG_INFINITY);
        order.sort_by(|&a, &b| height(b).total_cmp(&height(a)));
    }
    let mut row_of_ring = vec![0; rings];
    for (row, ring) in order.into_iter().enumerate() {
        row_of_ring[ring] = row as u16;
    }
    Some(row_of_ring)
}

/// For each ring number the median slope of its returns, from a sample of them where they are many.
/// `None` without any return or with a ring number that is no beam.
fn median_slopes(cloud: &PointCloud, ring: &[u16]) -> Option<Vec<Option<f64>>> {
    const MANY: usize = 256;
    let highest = ring.iter().copied().max().map_or(0, usize::from);
    let mut counts = vec![0_usize; highest + 1];
    for (_, &ring) in ring.iter().enumerate().filter(|&(point, _)| cloud.is_return(point)) {
        counts[usize::from(ring)] += 1;
    }
    let rings = counts.iter().rposition(|&count| count > 0)? + 1;
    if rings > MOST_BEAMS {
        return None;
    }
    let mut slopes: Vec<Vec<f64>> = vec![Vec::new(); rings];
    for (point, &ring) in ring.iter().enumerate() {
        let ring = usize::from(ring);
        if (is_sampled(cloud, point) || counts[ring] < MANY) && cloud.is_return(point) {
            slopes[ring].push(slope(cloud, point));
        }
    }
    Some(slopes.iter_mut().map(|beam| median(beam)).collect())
}

/// Tangent of the elevation: orders as the elevation does.
fn slope(cloud: &PointCloud, point: usize) -> f64 {
    let [x, y, z] = cloud.position(point).map(f64::from);
    z / (x * x + y * y).sqrt().max(f64::MIN_POSITIVE)
}

/// Number of the turn in which each point was stored, for clouds stored beam after beam (KITTI's, and
/// many converters'): the azimuth runs round once per beam. `None` unless the turns are beams, that is
/// unless their median elevations lie in order.
pub(super) fn turns(cloud: &PointCloud, azimuths: &[f32]) -> Option<Vec<u16>> {
    [0.0, PI].iter().find_map(|&seam| turns_at(cloud, azimuths, seam))
}

fn turns_at(cloud: &PointCloud, azimuths: &[f32], seam: f64) -> Option<Vec<u16>> {
    const FEWEST_BEAMS: u16 = 4;
    const MOST_TURNS: u16 = 256;
    let mut turn = 0_u16;
    let mut previous = None;
    let mut turns = vec![0; cloud.len()];
    for point in 0..cloud.len() {
        if cloud.is_return(point) {
            let angle = (f64::from(azimuths[point]) - seam).rem_euclid(TAU);
            if previous.is_some_and(|previous: f64| (angle - previous).abs() > 0.9 * PI) {
                turn += 1;
            }
            if turn == MOST_TURNS {
                return None;
            }
            previous = Some(angle);
        }
        turns[point] = turn;
    }
    (turn + 1 >= FEWEST_BEAMS && are_ordered(cloud, &turns)).then_some(turns)
}

/// Whether the median elevations of the turns rise or fall all but steadily.
fn are_ordered(cloud: &PointCloud, turns: &[u16]) -> bool {
    let medians: Vec<f64> =
        median_slopes(cloud, turns).unwrap_or_default().into_iter().flatten().collect();
    let falling = medians.windows(2).filter(|pair| pair[1] < pair[0]).count();
    let steps = medians.len().saturating_sub(1);
    steps > 0 && (falling * 20 >= steps * 19 || falling * 20 <= steps)
}

/// Elevations of the beams in radians, highest first, from a histogram of all returns. `None` unless
/// returns crowd on few of its bins, as those of a sensor do whose beams leave from one point.
pub(super) fn elevation_peaks(cloud: &PointCloud) -> Option<Vec<f64>> {
    const BIN: f64 = 0.05 * PI / 180.0;
    const MOST_OCCUPIED: f64 = 0.25;
    let bins = (PI / BIN) as usize + 1;
    let mut counts = vec![0_u32; bins];
    let mut sums = vec![0.0; bins];
    for point in (0..cloud.len()).filter(|&point| cloud.is_return(point)) {
        let elevation = elevation(cloud, point);
        let bin = ((elevation + PI / 2.0) / BIN) as usize;
        counts[bin] += 1;
        sums[bin] += elevation;
    }
    let first = counts.iter().position(|&count| count > 0)?;
    let last = counts.iter().rposition(|&count| count > 0)?;
    let occupied: Vec<usize> = (first..=last).filter(|&bin| counts[bin] > 0).collect();
    if occupied.len() as f64 > MOST_OCCUPIED * (last - first + 1) as f64 {
        return None;
    }
    let mut beams: Vec<(u32, f64)> = Vec::new();
    let mut previous = None;
    for bin in occupied {
        match beams.last_mut() {
            Some(beam) if previous == Some(bin - 1) => {
                beam.0 += counts[bin];
                beam.1 += sums[bin];
            }
            _ => beams.push((counts[bin], sums[bin])),
        }
        previous = Some(bin);
    }
    let enough = |beams: &[f64]| (4..=MOST_BEAMS).contains(&beams.len());
    let beams: Vec<f64> = beams.iter().rev().map(|&(n, sum)| sum / f64::from(n)).collect();
    enough(&beams).then_some(beams)
}

/// Index of the beam nearest in elevation; `beams` runs from the highest down.
pub(super) fn nearest(beams: &[f64], elevation: f64) -> u16 {
    let below = beams.partition_point(|&beam| beam > elevation);
    let above = below.saturating_sub(1);
    let below = below.min(beams.len() - 1);
    let closer = if beams[above] - elevation <= elevation - beams[below] { above } else { below };
    closer as u16
}

/// Elevations in radians (upper, lower) between which all but 0.2 % of the returns lie.
pub(super) fn field_of_view(cloud: &PointCloud) -> (f64, f64) {
    const TAIL: f64 = 0.001;
    const NARROWEST: f64 = 0.01;
    let returns = (0..cloud.len()).filter(|&point| cloud.is_return(point));
    let mut elevations: Vec<f64> = returns.map(|point| elevation(cloud, point)).collect();
    if elevations.is_empty() {
        return (NARROWEST, -NARROWEST);
    }
    elevations.sort_unstable_by(f64::total_cmp);
    let tail = (elevations.len() as f64 * TAIL) as usize;
    let lower = elevations[tail];
    let upper = elevations[elevations.len() - 1 - tail];
    if upper - lower < NARROWEST {
        let middle = (upper + lower) / 2.0;
        return (middle + NARROWEST, middle - NARROWEST);
    }
    (upper, lower)
}
