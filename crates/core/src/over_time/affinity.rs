//! How well each track agrees with each instance of a frame: by overlap of their cells and by
//! distance, where the track is expected.

use nalgebra::Vector2;

use super::assignment::Pair;
use super::params::TrackParams;
use super::sighting::Sighting;
use super::track::Track;

/// Standard deviation of the place of a track beyond which nothing near is expected any more,
/// metres.
const WIDEST: f64 = 2.5;

/// Distances count up to so many standard deviations.
const FARTHEST: f64 = 3.0;

/// By how much the affinity falls with the logarithm of the growth of length or height, and of
/// their shrinking: a part that is hidden is usual, one that is added is not.
const GROWTH: (f64, f64) = (0.3, 0.09);

/// Seconds between frames from which the affinity of a track falls.
const USUAL_STEP: f64 = 0.1;

/// The pairs of tracks and instances of a frame whose affinity is large enough.
pub(super) fn affinities(
    tracks: &[Track],
    frame: &[Sighting],
    time: f64,
    params: &TrackParams,
) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (track, of_track) in tracks.iter().enumerate() {
        let expected = Expected::new(of_track, time, params);
        for (instance, sighting) in frame.iter().enumerate() {
            let affinity = expected.affinity(sighting, params);
            if affinity > params.least_affinity {
                pairs.push(Pair { track, instance, affinity });
            }
        }
    }
    pairs
}

/// Where and how a track is expected at a time.
struct Expected<'a> {
    /// Its last sighting and the fullest of the latest, with their displacements since.
    sightings: Vec<(&'a Sighting, Vector2<f64>)>,
    /// The fullest.
    usual: &'a Sighting,
    /// Variance of its place, square metres.
    variance: f64,
    /// Affinity of an instance that agrees in everything.
    most: f64,
}

impl<'a> Expected<'a> {
    fn new(track: &'a Track, time: f64, params: &TrackParams) -> Self {
        let since = time - track.last().time;
        let expected = track.kinematics.after(since);
        let (last, fullest) = (&track.latest[0], track.fullest());
        let mut sightings = vec![(&last.0, expected.place - last.1)];
        if fullest.0.points > last.0.points {
            sightings.push((&fullest.0, expected.place - fullest.1));
        }
        let young = if track.sightings < 3 { params.young } else { 1.0 };
        Expected {
            sightings,
            usual: &fullest.0,
            variance: expected.place_variance().min(WIDEST * WIDEST),
            most: young * params.kept_after_second.powf(since - USUAL_STEP),
        }
    }

    fn affinity(&self, sighting: &Sighting, params: &TrackParams) -> f64 {
        let length = f64::from(self.usual.size[0].min(sighting.size[0]));
        let variance = (params.place_error + 0.1 * length).powi(2) + self.variance;
        let of_sighting = |(seen, shift): &(&Sighting, Vector2<f64>)| {
            (
                (sighting.middle - seen.middle - shift).norm_squared(),
                overlap(seen, sighting, *shift),
            )
        };
        let (squared, overlap) =
            self.sightings.iter().map(of_sighting).fold((f64::INFINITY, 0.0_f64), |best, next| {
                (best.0.min(next.0), best.1.max(next.1))
            });
        let is_far = squared > FARTHEST * FARTHEST * variance;
        let nearness = if is_far { 0.0 } else { (-0.5 * squared / variance).exp() };
        if nearness == 0.0 && overlap == 0.0 {
            return 0.0;
        }
        let share = params.distance_weight;
        let agreed = share * nearness + (1.0 - share) * overlap;
        agreed * likeness(self.usual, sighting, params) * self.most
    }
}

/// How alike an object was and is, 0 to 1: by class, length and height.
pub(super) fn likeness(was: &Sighting, is: &Sighting, params: &TrackParams) -> f64 {
    let class = match (was.body == is.body, was.semantic == is.semantic) {
        (true, true) => 1.0,
        (true, false) => 0.8,
        (false, _) => params.other_class,
    };
    let change = |axis: usize| {
        let growth = f64::from((is.size[axis].max(0.2) / was.size[axis].max(0.2)).ln());
        if growth > 0.0 { GROWTH.0 * growth } else { -GROWTH.1 * growth }
    };
    class * (-change(0) - change(2)).exp()
}

/// Share of the cells of two sightings that have one of the other within reach, the first moved on
/// the plane.
fn overlap(a: &Sighting, b: &Sighting, shift: Vector2<f64>) -> f64 {
    let shift = [shift.x as f32, shift.y as f32];
    if !b.cells.are_near(&a.cells, shift, a.reach) {
        return 0.0;
    }
    let reach = a.reach * a.reach;
    let mut is_hit = vec![false; b.cells.len()];
    let mut hits = 0;
    for cell in 0..a.cells.len() {
        let [x, y, z] = a.cells.at(cell);
        let at = [x + shift[0], y + shift[1], z];
        if !b.cells.is_near(at, a.reach) {
            continue;
        }
        let mut any = false;
        for (hit, squared) in is_hit.iter_mut().zip(b.cells.squared_from(at)) {
            let is_near = squared <= reach;
            *hit |= is_near;
            any |= is_near;
        }
        hits += usize::from(any);
    }
    let hits = hits + is_hit.iter().filter(|&&hit| hit).count();
    hits as f64 / (a.cells.len() + b.cells.len()).max(1) as f64
}
