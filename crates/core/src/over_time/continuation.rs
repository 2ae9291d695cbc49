//! Tracks that begin where another ended some time ago are the same object, which was hidden: told
//! by the velocities before and after.

use super::affinity::likeness;
use super::params::TrackParams;
use super::track::Track;

/// Sightings from which a velocity says something: of a track that begins, and of one that ended.
const SIGHTINGS: (u32, u32) = (4, 2);

/// Variance of a change of velocity while an object is hidden, (m/s)² in a second.
const UNSEEN_CHANGE: f64 = 1.0;

/// The less certain the place is in which a track is expected again, the less it says that one
/// begins there: its likelihood falls with this power of the share of the variance that is not of
/// the way in between.
const CERTAINTY: f64 = 0.25;

/// A track that continues another one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Continuation {
    /// Key of the earlier.
    pub of: u32,
    /// Key of the later.
    pub by: u32,
}

/// The continuations among tracks, the likeliest first, each track in one at most; of those that
/// began at `since` seconds or later and were seen at `now`.
pub(super) fn continuations(
    tracks: &[Track],
    (since, now): (f64, f64),
    params: &TrackParams,
) -> Vec<Continuation> {
    let begins = |track: &&Track| {
        track.born.0 >= since && track.sightings >= SIGHTINGS.0 && track.last().time == now
    };
    let mut likely: Vec<(f64, u32, u32)> = Vec::new();
    for later in tracks.iter().filter(begins) {
        for earlier in tracks.iter().filter(|track| track.sightings >= SIGHTINGS.1) {
            let likelihood = likelihood(earlier, later, params);
            if earlier.key != later.key && likelihood > params.least_continuation {
                likely.push((likelihood, earlier.key, later.key));
            }
        }
    }
    likely.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut chosen: Vec<Continuation> = Vec::new();
    for (_, of, by) in likely {
        let is_taken =
            |other: &Continuation| [other.of, other.by].iter().any(|&k| k == of || k == by);
        if !chosen.iter().any(is_taken) {
            chosen.push(Continuation { of, by });
        }
    }
    chosen
}

/// How likely one object was last seen as one track and came back as another, 0 to 1.
fn likelihood(earlier: &Track, later: &Track, params: &TrackParams) -> f64 {
    let last = earlier.last();
    let gap = later.born.0 - last.time;
    if gap <= 0.0 || gap > params.gap_s {
        return 0.0;
    }
    let variances =
        [earlier, later].map(|track| track.kinematics.velocity_variance() + UNSEEN_CHANGE * gap);
    let weights = variances.map(|variance| 1.0 / variance);
    let (before, after) = (earlier.kinematics.velocity, later.kinematics.velocity);
    let velocity = (before * weights[0] + after * weights[1]) / (weights[0] + weights[1]);
    let missed = (later.born.1 - last.middle - velocity * gap).norm_squared();
    let apart = (before - after).norm_squared();
    let first = later.latest.back().map_or(later.last(), |(sighting, _)| sighting);
    let length = f64::from(last.size[0].max(first.size[0]));
    let of_places = (params.place_error + 0.2 * length).powi(2)
        + first.sampling_variance()
        + last.sampling_variance();
    let place = of_places + gap * gap / (weights[0] + weights[1]);
    let certain = (of_places / place).powf(CERTAINTY);
    let change = variances[0] + variances[1] + 0.25;
    certain * (-0.5 * (missed / place + apart / change)).exp() * likeness(last, first, params)
}
