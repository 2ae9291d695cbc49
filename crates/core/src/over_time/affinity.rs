//! How well each track agrees with each instance of a frame: by overlap of their cells and by
//! distance, where the track is expected.

use std::sync::Arc;

use nalgebra::Vector2;
use serde::Serialize;

use super::params::TrackParams;
use super::sighting::{Cells, Sighting, sampling_variance};
use super::track::Track;

/// Standard deviation of the place of a track beyond which nothing near is expected any more,
/// metres.
const WIDEST: f64 = 2.5;

/// Distances count up to so many standard deviations.
const FARTHEST: f64 = 3.0;

/// By how much the affinity falls with the logarithm of the growth of length or height, and of
/// their shrinking: a part that is hidden is usual, one that is added is not.
const GROWTH: (f64, f64) = (0.3, 0.09);

/// Points of a track's fullest sighting from which a growth counts half: what is seen of fewer is
/// no size.
const SIZED_POINTS: f64 = 10.0;

/// Cells of the smaller of two sightings from which the overlap counts half of what it may: one
/// cell of a far object is seen on its roof, the next on its door.
const OVERLAPPING_CELLS: f64 = 1.0;

/// A place that is expected within a smaller error is worth more: nearness falls with this power of
/// the share of the variance that is not of the expectation. 1 would be a density on the plane; the
/// velocity of a track that begins is not known, and with 1 it would find no second sighting.
const CERTAINTY: f64 = 0.15;

/// Seconds between frames from which the affinity of a track falls.
const USUAL_STEP: f64 = 0.1;

/// How well a track and an instance agree. The affinity is the mean of nearness and overlap, as
/// weighed, times the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Agreement {
    /// Distance of the instance from where the track is expected, metres.
    pub away_m: f64,
    /// How near the instance lies to where the track is expected, 0 to 1.
    pub nearness: f64,
    /// Share of the cells of both that lie on each other, 0 to 1.
    pub overlap: f64,
    /// Weight of the overlap beside the nearness, 0 to 1: less where few cells are seen.
    pub overlap_weight: f64,
    /// How alike both are in class, length and height, 0 to 1.
    pub likeness: f64,
    /// Less than 1 for a track that is young or was out of sight.
    pub trust: f64,
    /// 0 to 1.
    pub affinity: f64,
}

/// A track and an instance of a frame by their numbers, and how well they agree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub track: usize,
    pub instance: usize,
    pub agreement: Agreement,
}

impl Candidate {
    /// The instance, the track, and the affinity.
    pub fn weighed(&self) -> (usize, usize, f64) {
        (self.instance, self.track, self.agreement.affinity)
    }
}

/// The pairs of tracks and instances of a frame whose affinity is large enough.
pub(super) fn affinities(
    tracks: &[Track],
    frame: &[Arc<Sighting>],
    time: f64,
    params: &TrackParams,
) -> Vec<Candidate> {
    let mut pairs = Vec::new();
    for (track, of_track) in tracks.iter().enumerate() {
        let expected = Expected::new(of_track, time, params);
        for (instance, sighting) in frame.iter().enumerate() {
            if !expected.may_be(sighting) {
                continue;
            }
            let agreement = expected.agreement(sighting, params);
            pairs.extend(
                agreement
                    .filter(|agreement| agreement.affinity > params.least_affinity)
                    .map(|agreement| Candidate { track, instance, agreement }),
            );
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
    /// The box on the plane outside of which it is not expected.
    low: [f32; 2],
    high: [f32; 2],
}

impl<'a> Expected<'a> {
    fn new(track: &'a Track, time: f64, params: &TrackParams) -> Self {
        let since = time - track.last().time;
        let expected = track.kinematics.after(since);
        let (last, fullest) = (&track.latest[0], track.fullest());
        let mut sightings = vec![(&*last.0, expected.place - last.1)];
        if fullest.0.points > last.0.points {
            sightings.push((&*fullest.0, expected.place - fullest.1));
        }
        let young = if track.sightings < 3 { params.young } else { 1.0 };
        let variance = expected.place_variance().min(WIDEST * WIDEST);
        let length = f64::from(fullest.0.size[0]);
        let sampled = fullest.0.sampling_variance().max(last.0.sampling_variance())
            + sampling_variance(fullest.0.body, 1);
        let error = ((params.place_error + 0.1 * length).powi(2) + sampled + variance).sqrt();
        let far = (FARTHEST * error) as f32;
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for (seen, shift) in &sightings {
            for axis in 0..2 {
                let shift = shift[axis] as f32;
                let middle = seen.middle[axis] as f32;
                let (least, most) = (seen.cells.low[axis], seen.cells.high[axis]);
                low[axis] = low[axis].min((least - seen.reach).min(middle - far) + shift);
                high[axis] = high[axis].max((most + seen.reach).max(middle + far) + shift);
            }
        }
        Expected {
            sightings,
            usual: &fullest.0,
            variance,
            low,
            high,
            most: young * params.kept_after_second.powf(since - USUAL_STEP),
        }
    }

    /// Whether an instance is where the track is expected.
    fn may_be(&self, sighting: &Sighting) -> bool {
        let Cells { low, high, .. } = &sighting.cells;
        (0..2).all(|k| self.low[k] <= high[k] && self.high[k] >= low[k])
    }

    /// `None` where neither place nor overlap speaks for it.
    fn agreement(&self, sighting: &Sighting, params: &TrackParams) -> Option<Agreement> {
        let nearest = |best: Nearness, next: Nearness| match next.variances < best.variances {
            true => next,
            false => best,
        };
        let of_each = self.sightings.iter().map(|seen| self.nearness(*seen, sighting, params));
        let near = of_each.reduce(nearest)?;
        let overlaps = self.sightings.iter().map(|(seen, shift)| overlap(seen, sighting, *shift));
        let overlap = overlaps.fold(0.0, f64::max);
        if near.value == 0.0 && overlap == 0.0 {
            return None;
        }
        let cells = self.usual.cells.len().min(sighting.cells.len()) as f64;
        let share = (1.0 - params.distance_weight) * cells / (cells + OVERLAPPING_CELLS);
        let agreed = (1.0 - share) * near.value + share * overlap;
        let likeness = likeness(self.usual, sighting, params);
        Some(Agreement {
            nearness: near.value,
            overlap,
            overlap_weight: share,
            likeness,
            trust: self.most,
            away_m: near.away_m,
            affinity: agreed * likeness * self.most,
        })
    }
}

/// How near an instance lies to where a sighting of a track is expected.
#[derive(Clone, Copy)]
struct Nearness {
    away_m: f64,
    /// The square of the distance in variances.
    variances: f64,
    /// 0 to 1.
    value: f64,
}

impl Expected<'_> {
    fn nearness(
        &self,
        (seen, shift): (&Sighting, Vector2<f64>),
        sighting: &Sighting,
        params: &TrackParams,
    ) -> Nearness {
        let length = f64::from(self.usual.size[0].min(sighting.size[0]));
        let of_places = (params.place_error + 0.1 * length).powi(2)
            + seen.sampling_variance()
            + sighting.sampling_variance();
        let variance = of_places + self.variance;
        let squared = (sighting.middle - seen.middle - shift).norm_squared();
        let variances = squared / variance;
        let is_far = variances > FARTHEST * FARTHEST;
        let certain = (of_places / variance).powf(CERTAINTY);
        let value = if is_far { 0.0 } else { certain * (-0.5 * variances).exp() };
        Nearness { away_m: squared.sqrt(), variances, value }
    }
}

/// How alike an object was and is, 0 to 1: by class, length and height.
pub(super) fn likeness(was: &Sighting, is: &Sighting, params: &TrackParams) -> f64 {
    let class = match (was.body == is.body, was.semantic == is.semantic) {
        (true, true) => 1.0,
        (true, false) => 0.8,
        // Told by shape alone, a body is a guess that flickers.
        (false, true) if was.semantic == 0 => params.other_class.sqrt(),
        (false, _) => params.other_class,
    };
    let points = f64::from(was.points);
    let sized = points / (points + SIZED_POINTS);
    let change = |axis: usize| {
        let growth = f64::from((is.size[axis].max(0.2) / was.size[axis].max(0.2)).ln());
        if growth > 0.0 { sized * GROWTH.0 * growth } else { -GROWTH.1 * growth }
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
    let of_a = a.cells.count_near(&b.cells, shift, a.reach);
    let of_b = b.cells.count_near(&a.cells, shift.map(|along| -along), a.reach);
    (of_a + of_b) as f64 / (a.cells.len() + b.cells.len()).max(1) as f64
}
