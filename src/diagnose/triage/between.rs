//! Whether the sensor saw through between two masses.
//!
//! A beam that passes between two masses and comes back from behind them shows that nothing is
//! there: they are two objects, or a window lies between them. A nearer return, or none (dark
//! paint, glass), leaves open what is there.

use super::facts::FrameFacts;

/// Shares of the beams between two masses by what they met; all 0 if no beam lies between.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Between {
    /// They came back from something nearer.
    pub hidden: f64,
    /// They came back with nothing.
    pub missing: f64,
}

impl Between {
    /// Share of the evidence of a gap that remains, 1/2 to 1: half of it if nothing could be seen
    /// in the gap.
    pub fn unexplained(&self) -> f64 {
        1.0 - (self.hidden + self.missing) / 2.0
    }
}

/// So many pixels of the smaller mass are connected to their nearest of the larger ...
const PAIRS: usize = 24;
/// ... and so many places on each connection are looked at.
const PLACES: usize = 8;
/// A return that is nearer than a place by this much hides it, metres.
const OFF: f64 = 0.4;
/// A metre of height counts for so many metres in the search for the nearest pixel, so that pixels
/// of one height are connected rather than those above one another.
const UPRIGHT: f64 = 3.0;

/// What the sensor saw between two sets of object pixels.
pub(super) fn between(facts: &FrameFacts, one: &[u32], other: &[u32]) -> Between {
    let (fewer, more) = if one.len() < other.len() { (one, other) } else { (other, one) };
    let every = fewer.len().div_ceil(PAIRS).max(1);
    let mut counts = [0_usize; 3];
    for &from in fewer.iter().step_by(every) {
        // A pixel on the far side of a mass too leads to the sides that face each other.
        let to = partner(facts, from, more);
        let facing = to.and_then(|to| Some((partner(facts, to, fewer)?, to)));
        if let Some((from, to)) = facing {
            (1..=PLACES).for_each(|place| {
                let along = place as f64 / (PLACES + 1) as f64;
                if let Some(seen) = seen(facts, from, to, along) {
                    counts[seen] += 1;
                }
            });
        }
    }
    let total = counts.iter().sum::<usize>().max(1) as f64;
    let [hidden, missing, _] = counts.map(|count| count as f64 / total);
    Between { hidden, missing }
}

fn partner(facts: &FrameFacts, from: u32, among: &[u32]) -> Option<u32> {
    let position = &facts.frame.stages.objects.position;
    let [x, y, z] = position[from as usize].map(f64::from);
    let squared = |&to: &u32| {
        let [a, b, c] = position[to as usize].map(f64::from);
        (a - x).powi(2) + (b - y).powi(2) + (UPRIGHT * (c - z)).powi(2)
    };
    let every = among.len().div_ceil(512).max(1);
    let candidates = among.iter().copied().step_by(every);
    candidates.min_by(|a, b| squared(a).total_cmp(&squared(b)))
}

/// What the beam towards a place between two object pixels met: 0 something nearer, 1 nothing, 2
/// something there or behind. None if the place is in the pixel of one of the two.
fn seen(facts: &FrameFacts, from: u32, to: u32, along: f64) -> Option<usize> {
    let (image, objects) = (&facts.frame.stages.image, &facts.frame.stages.objects);
    let columns = image.columns();
    let [a, b] = [from, to].map(|object| objects.pixel[object as usize] as usize);
    let (row, column) = (
        lerp((a / columns) as f64, (b / columns) as f64, along).round() as usize,
        lerp_around((a % columns) as f64, (b % columns) as f64, along, columns, image.wraps),
    );
    let pixel = row * columns + column;
    if pixel == a || pixel == b {
        return None;
    }
    let [p, q] = [from, to].map(|object| objects.position[object as usize].map(f64::from));
    let place = [0, 1, 2].map(|axis: usize| lerp(p[axis], q[axis], along));
    let expected = place.iter().map(|x| x * x).sum::<f64>().sqrt();
    let Some(point) = image.point_at(pixel) else {
        return Some(1);
    };
    let range = facts.frame.cloud.squared_range(point).sqrt();
    Some(if range < expected - OFF { 0 } else { 2 })
}

fn lerp(from: f64, to: f64, along: f64) -> f64 {
    from + along * (to - from)
}

/// Interpolates between two columns, the short way around.
fn lerp_around(from: f64, to: f64, along: f64, columns: usize, wraps: bool) -> usize {
    let around = columns as f64;
    let short = match to - from {
        apart if wraps && apart > around / 2.0 => to - around,
        apart if wraps && apart < -around / 2.0 => to + around,
        _ => to,
    };
    lerp(from, short, along).round().rem_euclid(around) as usize % columns
}
