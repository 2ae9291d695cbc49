//! A track: one object from frame to frame.

use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::Vector2;

use super::displacement::displacement;
use super::kinematics::Kinematics;
use super::params::TrackParams;
use super::sighting::Sighting;

/// Sightings that a track keeps: half a second of a sensor at 10 Hz.
const KEPT: usize = 6;

/// How much less the displacement says of an object whose length changed by half: part of it came
/// into sight or went.
const RESIZED: f64 = 3.0;

/// How much less it says of an object of a single cell.
const FEW_CELLS: f64 = 1.0;

/// One object from frame to frame. Its place is the middle of its first sighting, displaced.
#[derive(Debug, Clone)]
pub(super) struct Track {
    /// From 1, in the order of their first sightings.
    pub key: u32,
    /// Time and place of its first sighting.
    pub born: (f64, Vector2<f64>),
    pub sightings: u32,
    pub kinematics: Kinematics,
    /// The latest sightings and where the track was, the last first.
    pub latest: VecDeque<(Arc<Sighting>, Vector2<f64>)>,
}

impl Track {
    pub fn new(key: u32, first: Arc<Sighting>, params: &TrackParams) -> Self {
        let place = first.middle;
        let error = params.displacement_error.hypot(first.sampling_variance().sqrt());
        Track {
            key,
            born: (first.time, place),
            sightings: 1,
            kinematics: Kinematics::new(place, error, first.body),
            latest: VecDeque::from([(first, place)]),
        }
    }

    pub fn last(&self) -> &Sighting {
        &self.latest[0].0
    }

    /// Whether it was background of late.
    pub fn is_background(&self) -> bool {
        self.latest.iter().all(|(sighting, _)| sighting.body.is_none())
    }

    /// The latest sighting of most points, and where the track was.
    pub fn fullest(&self) -> &(Arc<Sighting>, Vector2<f64>) {
        let (last, rest) = (&self.latest[0], self.latest.iter().skip(1));
        rest.fold(last, |best, next| if next.0.points > best.0.points { next } else { best })
    }

    /// Goes on with the sighting of a later frame.
    pub fn follow(&mut self, next: Arc<Sighting>, params: &TrackParams) {
        let expected = self.kinematics.after(next.time - self.last().time);
        let (reference, was_at) = self.fullest();
        let moved = displacement(reference, &next, expected.place - was_at);
        let length = |sighting: &Sighting| f64::from(sighting.size[0].max(0.1));
        let resized = (length(&next) / length(reference)).ln().abs();
        let cells = next.cells.len().min(reference.cells.len()).max(1) as f64;
        let error =
            params.displacement_error * (1.0 + RESIZED * resized) * (1.0 + FEW_CELLS / cells);
        let sampled = next.sampling_variance() + reference.sampling_variance();
        let error = error.hypot(sampled.sqrt());
        self.kinematics = expected.corrected(was_at + moved, error, next.body);
        self.sightings += 1;
        self.latest.push_front((next, self.kinematics.place));
        self.latest.truncate(KEPT);
    }

    /// Moves the world's origin.
    pub fn shift(&mut self, by: [f32; 3]) {
        let on_plane = Vector2::new(f64::from(by[0]), f64::from(by[1]));
        self.born.1 -= on_plane;
        self.kinematics.place -= on_plane;
        for (sighting, place) in &mut self.latest {
            Arc::make_mut(sighting).shift(by);
            *place -= on_plane;
        }
    }
}
