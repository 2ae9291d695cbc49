//! Which beam measured a point, where the driver does not say, and in which order the beams lie.

use std::f64::consts::{PI, TAU};

use serde::Serialize;

use super::angles::elevation;
use super::sweep::{BLOCK, Sweep, common_row};
use crate::cloud::point_cloud::{PointCloud, wide};
use crate::geometry::statistics::median;

/// A sensor with more beams than this is not known; a larger ring number is not a beam.
const MOST_BEAMS: usize = 1024;

/// What the ring numbers of a sweep look like.
pub(super) struct Rings {
    /// For each number the median slope of its returns.
    medians: Vec<Option<f64>>,
    /// Share of the returns that lie off the median slope of their ring.
    astray: f64,
    /// Share of the returns that have the most frequent number.
    largest: f64,
}

/// Why the numbers of a ring field are no beams.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RingFlaw {
    /// All but a few returns have one number, though they lie at many elevations.
    Constant,
    /// Returns of one number lie as far apart in elevation as any others.
    Scattered,
    /// Several numbers stand for one elevation.
    Repeated,
    /// A number is higher than any sensor has beams.
    TooHigh,
}

/// What speaks against ring numbers; `None` where nothing does.
pub(super) fn ring_flaw(sweep: &Sweep, ring: &[u16]) -> Option<RingFlaw> {
    match Rings::measured(sweep, ring) {
        Some(rings) => rings.flaw(sweep, ring),
        None => (!sweep.sample.is_empty()).then_some(RingFlaw::TooHigh),
    }
}

/// Whether the median slopes of many rings are those of others.
fn are_repeated(medians: &[Option<f64>]) -> bool {
    const FEWEST_RINGS: usize = 8;
    const MUCH_LESS: f64 = 0.1;
    let mut known: Vec<f64> = medians.iter().copied().flatten().collect();
    known.sort_by(f64::total_cmp);
    let mut gaps: Vec<f64> = known.windows(2).map(|pair| pair[1] - pair[0]).collect();
    gaps.sort_by(f64::total_cmp);
    let Some(&wide) = gaps.get(gaps.len() * 3 / 4) else {
        return false;
    };
    let none = gaps.iter().filter(|&&gap| gap < MUCH_LESS * wide).count();
    known.len() >= FEWEST_RINGS && 3 * none > gaps.len()
}

impl Rings {
    /// `None` if the numbers cannot be beams.
    ///
    /// A beam turns on a cone about the sensor's axis, so that returns that follow each other on it
    /// agree in elevation, while those of different beams do not. The first holds wherever the
    /// sensor stands in the cloud's frame, and the second is asked of its own frame.
    pub fn of(sweep: &Sweep, ring: &[u16]) -> Option<Rings> {
        let rings = Rings::measured(sweep, ring)?;
        rings.flaw(sweep, ring).is_none().then_some(rings)
    }

    fn measured(sweep: &Sweep, ring: &[u16]) -> Option<Rings> {
        /// Slope, half a degree at the horizon: the offsets of lasers, and a frame turned a little.
        const NEAR: f64 = 0.01;
        let mut slopes = slopes(sweep, ring)?;
        let medians: Vec<Option<f64>> = slopes.iter_mut().map(|beam| median(beam)).collect();
        let (mut astray, mut all, mut most) = (0, 0, 0);
        for (beam, middle) in slopes.iter().zip(&medians) {
            let middle = middle.unwrap_or(0.0);
            astray += beam.iter().map(|s| usize::from((s - middle).abs() > NEAR)).sum::<usize>();
            all += beam.len();
            most = most.max(beam.len());
        }
        let share = |count: usize| count as f64 / all as f64;
        Some(Rings { medians, astray: share(astray), largest: share(most) })
    }

    fn flaw(&self, sweep: &Sweep, ring: &[u16]) -> Option<RingFlaw> {
        /// In the sensor's own frame, only the offsets of its lasers lead returns astray.
        const FEW_ASTRAY: f64 = 0.05;
        const ALL_BUT_A_FEW: f64 = 0.9;
        match () {
            () if self.are_level() && are_repeated(&self.medians) => Some(RingFlaw::Repeated),
            () if self.astray < FEW_ASTRAY || tell_elevations_apart(sweep, ring) => None,
            () if self.largest > ALL_BUT_A_FEW => Some(RingFlaw::Constant),
            () => Some(RingFlaw::Scattered),
        }
    }

    /// Whether each ring keeps its elevation all round, as in the sensor's own frame.
    pub fn are_level(&self) -> bool {
        self.astray < 0.3
    }

    /// Row of each ring number, row 0 the highest: rings sorted by the median elevation of their
    /// returns. Where that is all but monotone in the ring number, plain ascending or descending
    /// order is used, so that a ring with few returns cannot fall out of line.
    pub fn rows(&self) -> Vec<u16> {
        rows_by_slope(&self.medians)
    }
}

/// Whether rings are beams that go up and down as they turn, as in a frame that is not the
/// sensor's, and not patches or modules: returns that follow each other in azimuth differ little in
/// elevation.
pub(super) fn are_swept(sweep: &Sweep, ring: &[u16]) -> bool {
    const CALM: f64 = 1.5 * PI / 180.0;
    median(&mut changes(&places(sweep, ring))).is_none_or(|change| change < CALM)
}

/// Whether three in four returns differ much less in elevation from the next on their ring than any
/// two returns do. (Of two beams with one number, half of the returns are followed by one of the
/// other beam.)
fn tell_elevations_apart(sweep: &Sweep, ring: &[u16]) -> bool {
    const MUCH_LESS: f64 = 0.5;
    /// A sensor of a single beam has one elevation, radians.
    const ONE_ELEVATION: f64 = 0.5 * PI / 180.0;
    let places = places(sweep, ring);
    let half = places.len() / 2;
    let any = places.iter().zip(&places[half..]);
    let mut any: Vec<f64> = any.map(|(a, b)| (a.2 - b.2).abs()).collect();
    let mut changes = changes(&places);
    changes.sort_unstable_by(f64::total_cmp);
    let Some((&change, any)) = changes.get(changes.len() * 3 / 4).zip(median(&mut any)) else {
        return true;
    };
    any < ONE_ELEVATION || change < MUCH_LESS * any
}

/// Ring, azimuth and elevation (radians) of the returns of the sample, ring by ring as they follow
/// each other in azimuth.
fn places(sweep: &Sweep, ring: &[u16]) -> Vec<(u16, f32, f64)> {
    let place = |&point: &u32| {
        let point = point as usize;
        (ring[point], sweep.azimuth[point], elevation(sweep.cloud, point))
    };
    let mut places: Vec<(u16, f32, f64)> = sweep.sample.iter().map(place).collect();
    places
        .sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2)));
    places
}

/// Changes in elevation from each return to the next on its ring, radians.
fn changes(places: &[(u16, f32, f64)]) -> Vec<f64> {
    let pairs = places.windows(2).filter(|pair| pair[0].0 == pair[1].0);
    pairs.map(|pair| (pair[1].2 - pair[0].2).abs()).collect()
}

fn rows_by_slope(medians: &[Option<f64>]) -> Vec<u16> {
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
    row_of_ring
}

/// For each ring number the median slope of its returns.
fn median_slopes(sweep: &Sweep, ring: &[u16]) -> Option<Vec<Option<f64>>> {
    Some(slopes(sweep, ring)?.iter_mut().map(|beam| median(beam)).collect())
}

/// For each ring number the slopes of its returns, of the sample where they are many. `None`
/// without any return or with a ring number that is no beam.
fn slopes(sweep: &Sweep, ring: &[u16]) -> Option<Vec<Vec<f64>>> {
    const MANY: usize = 256;
    let counts = returns_of_rings(sweep, ring);
    let rings = counts.iter().rposition(|&count| count > 0)? + 1;
    if rings > MOST_BEAMS {
        return None;
    }
    let mut slopes: Vec<Vec<f64>> =
        counts[..rings].iter().map(|&n| Vec::with_capacity((n / 4).max(MANY))).collect();
    for &point in &sweep.sample {
        let ring = usize::from(ring[point as usize]);
        if counts[ring] >= MANY {
            slopes[ring].push(slope(sweep.cloud, point as usize));
        }
    }
    if counts.iter().any(|count| (1..MANY).contains(count)) {
        for (point, &ring) in ring.iter().enumerate() {
            let ring = usize::from(ring);
            if counts[ring] < MANY && !sweep.azimuth[point].is_nan() {
                slopes[ring].push(slope(sweep.cloud, point));
            }
        }
    }
    Some(slopes)
}

/// Number of returns of each ring.
fn returns_of_rings(sweep: &Sweep, ring: &[u16]) -> Vec<usize> {
    let highest = ring.iter().copied().max().map_or(0, usize::from);
    let mut counts = vec![0; highest + 1];
    for (rings, azimuths) in ring.chunks(BLOCK).zip(sweep.azimuth.chunks(BLOCK)) {
        if let Some(ring) = common_row(rings) {
            let returns: u32 = azimuths.iter().map(|azimuth| u32::from(!azimuth.is_nan())).sum();
            counts[usize::from(ring)] += returns as usize;
            continue;
        }
        for (&ring, azimuth) in rings.iter().zip(azimuths) {
            counts[usize::from(ring)] += usize::from(!azimuth.is_nan());
        }
    }
    counts
}

/// Tangent of the elevation: orders as the elevation does.
fn slope(cloud: &PointCloud, point: usize) -> f64 {
    let [x, y, z] = wide(cloud.position(point));
    z / (x * x + y * y).sqrt().max(f64::MIN_POSITIVE)
}

/// The row of every point of a cloud stored beam after beam (KITTI's, and many converters'), and
/// the number of rows: the azimuth runs round once per beam. `None` unless the turns are beams,
/// that is unless their median elevations lie in order.
pub(super) fn rows_of_turns(sweep: &Sweep) -> Option<(Vec<u16>, usize)> {
    [0.0, PI].iter().find_map(|&seam| {
        let mut turns = turns(&sweep.azimuth, seam)?;
        let medians = median_slopes(sweep, &turns)?;
        if !are_ordered(&medians) {
            return None;
        }
        let row_of_turn = rows_by_slope(&medians);
        let row = |turn: u16| row_of_turn[usize::from(turn)];
        for block in turns.chunks_mut(BLOCK) {
            match common_row(block) {
                Some(turn) => block.fill(row(turn)),
                None => block.iter_mut().for_each(|turn| *turn = row(*turn)),
            }
        }
        Some((turns, row_of_turn.len()))
    })
}

/// The turn of the azimuth (radians, NaN for no return) in which each point was stored; a turn ends
/// where the azimuth jumps at the seam. `None` if they are fewer or more than beams.
fn turns(azimuth: &[f32], seam: f64) -> Option<Vec<u16>> {
    const FEWEST_BEAMS: u16 = 4;
    const MOST_TURNS: u16 = 256;
    let angle = |azimuth: f32| turned(f64::from(azimuth) - seam);
    let mut turns = Vec::with_capacity(azimuth.len());
    let mut turn = 0_u16;
    let mut previous = None;
    for start in (0..azimuth.len()).step_by(BLOCK) {
        let end = (start + BLOCK).min(azimuth.len());
        if start > 0 && is_calm(&azimuth[start - 1..end]) {
            turns.resize(end, turn);
            previous = Some(angle(azimuth[end - 1]));
            continue;
        }
        for &azimuth in &azimuth[start..end] {
            if !azimuth.is_nan() {
                let angle = angle(azimuth);
                if previous.is_some_and(|previous: f64| (angle - previous).abs() > JUMP) {
                    turn += 1;
                }
                if turn == MOST_TURNS {
                    return None;
                }
                previous = Some(angle);
            }
            turns.push(turn);
        }
    }
    (turn + 1 >= FEWEST_BEAMS).then_some(turns)
}

/// Neighbouring returns of a beam are nearer than this, radians, but for those on either side of
/// the seam.
const JUMP: f64 = 0.9 * PI;

/// Whether azimuths (radians) are those of returns, do not jump and stay clear of both seams, 0 and
/// pi. All but a few blocks of a cloud stored beam after beam are calm.
fn is_calm(azimuths: &[f32]) -> bool {
    const SURELY_NO_JUMP: f32 = 2.8;
    const CLEAR_OF_PI: f32 = 3.1;
    azimuths.array_windows().fold(true, |is_calm, &[a, b]| {
        let is_one_side = a.is_sign_negative() == b.is_sign_negative();
        let is_clear = (a.abs() < CLEAR_OF_PI) & (b.abs() < CLEAR_OF_PI);
        is_calm & is_one_side & is_clear & ((a - b).abs() < SURELY_NO_JUMP)
    })
}

/// An angle between -2 turns and 1 turn, brought into [0, turn].
fn turned(angle: f64) -> f64 {
    let angle = if angle < -TAU { angle + TAU } else { angle };
    if angle < 0.0 { angle + TAU } else { angle }
}

/// Whether the median elevations of the turns rise or fall all but steadily.
fn are_ordered(medians: &[Option<f64>]) -> bool {
    let medians: Vec<f64> = medians.iter().copied().flatten().collect();
    let falling = medians.windows(2).filter(|pair| pair[1] < pair[0]).count();
    let steps = medians.len().saturating_sub(1);
    steps > 0 && (falling * 20 >= steps * 19 || falling * 20 <= steps)
}

/// Elevations of the beams in radians, highest first, from a histogram of all returns. `None`
/// unless returns crowd on few of its bins, as those of a sensor do whose beams leave from one
/// point.
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
