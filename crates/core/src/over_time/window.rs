//! The frames around the one that is decided next: those of the lag before it and behind it.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use nalgebra::{Isometry3, Vector2, Vector3};

use super::affinity::Agreement;
use super::sighting::Sighting;

/// A frame whose instances have been followed.
#[derive(Debug)]
pub(super) struct WindowFrame {
    pub time: f64,
    /// From the frame of the cloud to the tracker's world.
    pub sensor: Isometry3<f64>,
    pub sightings: Vec<Arc<Sighting>>,
    /// By sighting: where its track was.
    pub places: Vec<Vector2<f64>>,
    /// By sighting: key of its track.
    pub keys: Vec<u32>,
    /// By sighting: why that is its track; `None` where one begins.
    pub links: Vec<Option<KeyLink>>,
}

/// Why an instance continues a track.
#[derive(Debug, Clone)]
pub(super) struct KeyLink {
    /// Seconds since the track was seen before.
    pub since_s: f64,
    pub agreement: Agreement,
    /// Keys of the other tracks that it agrees with, and the affinities; the largest first.
    pub others: Vec<(u32, f64)>,
}

/// Frames in their order, the last ones not decided yet.
#[derive(Debug, Default)]
pub(super) struct Window {
    pub frames: VecDeque<WindowFrame>,
    /// Frames that are decided.
    pub decided: usize,
}

/// Where a track was seen: a frame of the window and a sighting in it.
pub(super) type Place = (usize, usize);

impl Window {
    /// Time of the first frame that is not decided.
    pub fn undecided_since(&self) -> Option<f64> {
        self.frames.get(self.decided).map(|frame| frame.time)
    }

    /// Lets the next frame be decided, and forgets those longer ago than `lag_s` seconds before.
    pub fn advance(&mut self, lag_s: f64) {
        let Some(time) = self.undecided_since() else { return };
        self.decided += 1;
        while self.decided > 1 && time - self.frames[0].time >= lag_s {
            self.frames.pop_front();
            self.decided -= 1;
        }
    }

    /// Where each track was seen, given which track each key belongs to.
    pub fn appearances(&self, track_of: impl Fn(u32) -> u32) -> BTreeMap<u32, Vec<Place>> {
        let mut appearances: BTreeMap<u32, Vec<Place>> = BTreeMap::new();
        for (number, frame) in self.frames.iter().enumerate() {
            for (sighting, &key) in frame.keys.iter().enumerate() {
                appearances.entry(track_of(key)).or_default().push((number, sighting));
            }
        }
        appearances
    }

    /// The longest time from `now` to a frame, seconds.
    pub fn span_around(&self, now: f64) -> f64 {
        self.frames.iter().map(|frame| (frame.time - now).abs()).fold(0.0, f64::max)
    }

    pub fn sighting(&self, (frame, sighting): Place) -> &Sighting {
        &self.frames[frame].sightings[sighting]
    }

    pub fn place(&self, (frame, sighting): Place) -> Vector2<f64> {
        self.frames[frame].places[sighting]
    }

    /// Where a track is in a frame that it was seen in, or before and after; else `None`.
    pub fn place_in(&self, frame: usize, appearances: &[Place]) -> Option<Vector2<f64>> {
        let at = appearances.partition_point(|place| place.0 < frame);
        let after = *appearances.get(at)?;
        if after.0 == frame {
            return Some(self.place(after));
        }
        let before = appearances[at.checked_sub(1)?];
        let time = |number: usize| self.frames[number].time;
        let share = (time(frame) - time(before.0)) / (time(after.0) - time(before.0));
        Some(self.place(before) * (1.0 - share) + self.place(after) * share)
    }

    /// Moves the world's origin.
    pub fn shift(&mut self, by: [f32; 3]) {
        let on_plane = Vector2::new(f64::from(by[0]), f64::from(by[1]));
        for frame in &mut self.frames {
            frame.sensor.translation.vector -= Vector3::from(by).cast::<f64>();
            frame.sightings.iter_mut().for_each(|seen| Arc::make_mut(seen).shift(by));
            frame.places.iter_mut().for_each(|place| *place -= on_plane);
        }
    }
}
