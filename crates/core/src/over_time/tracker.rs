//! The tracker: instances of frames in, tracks out, with a fixed lag between.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, Vector3};

use super::affinity::{Agreement, Candidate, affinities};
use super::continuation::continuations;
use super::observation::ObservedInstance;
use super::params::TrackParams;
use super::sighting::Sighting;
use super::track::Track;
use super::tracked_object::{Looks, TrackedObject};
use super::votes::{InstanceTrack, decide};
use super::window::{KeyLink, Window, WindowFrame};
use crate::geometry::assignment::assign;

/// A pause between frames that ends all tracks, seconds.
const LONGEST_PAUSE: f64 = 5.0;

/// How long background may be out of sight and keep its track, seconds.
const BACKGROUND_GAP: f64 = 0.35;

/// Faster than this the sensor does not move: the pose jumped, metres in a second. 360 km/h.
const FASTEST: f64 = 100.0;

/// The tracker's world is moved along with the sensor in steps of this, metres, so that single
/// precision suffices.
const WORLD: f64 = 1000.0;

/// The next frame of a drive.
#[derive(Debug, Clone, Copy)]
pub struct TrackerFrame<'a> {
    /// Its time, seconds since a time that is the same for all frames.
    pub time: f64,
    /// From the frame of the cloud to one that stands still, z up.
    pub pose: &'a Isometry3<f64>,
    /// Its instances.
    pub instances: &'a [ObservedInstance],
}

/// A frame whose tracks are decided.
#[derive(Debug, Clone, PartialEq)]
pub struct DecidedFrame {
    /// The track of each of its instances.
    pub tracks: Vec<InstanceTrack>,
    /// Its objects as their tracks know them; background is none.
    pub objects: Vec<TrackedObject>,
    /// Why each of its instances continues a track.
    pub links: Vec<TrackLink>,
}

/// Why an instance continues a track.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackLink {
    /// The track of the instance by association alone, before the votes of the frames around;
    /// `None` if no instance is decided to be of it.
    pub associated: Option<u32>,
    /// Whether it is the first sighting of an object that was out of sight, told by its velocity
    /// before and after.
    pub is_continuation: bool,
    /// Seconds since the track was seen before; `None` where one begins.
    pub since_s: Option<f64>,
    /// How well the instance agrees with the track; `None` where one begins.
    pub agreement: Option<Agreement>,
    /// The other tracks that it agrees with, and how well, 0 to 1; the largest first.
    pub others: Vec<(u32, f64)>,
}

/// Follows objects from frame to frame.
///
/// Tracks have numbers from 1 in the order in which frames are decided. A frame that goes back in
/// time or comes after a long pause, and a pose that jumps, end all tracks; later ones have new
/// numbers. Memory is that of two lags of frames and of the tracks seen within the longest gap.
///
/// ```
/// use divmerge_core::over_time::{InstanceTrack, ObservedInstance, TrackParams, Tracker};
/// use divmerge_core::over_time::TrackerFrame;
/// use nalgebra::Isometry3;
///
/// let walker = |x: i16| ObservedInstance {
///     id: 1,
///     semantic: 30,
///     body: None,
///     points: 2,
///     size: [0.5, 0.5, 1.7],
///     yaw: 0.0,
///     cells: vec![[x, 0, 0], [x, 0, 50]],
/// };
/// let mut tracker = Tracker::new(TrackParams { lag_s: 0.0, ..TrackParams::default() });
/// for (frame, x) in [500, 510, 520].into_iter().enumerate() {
///     let (time, pose) = (frame as f64 * 0.1, &Isometry3::identity());
///     let decided = tracker.push(TrackerFrame { time, pose, instances: &[walker(x)] });
///     assert_eq!(decided[0].tracks, [InstanceTrack::Whole(1)]);
/// }
/// ```
#[derive(Debug)]
pub struct Tracker {
    params: TrackParams,
    tracks: Vec<Track>,
    window: Window,
    /// By key of a track: the key of the one that it continues.
    continues: BTreeMap<u32, u32>,
    /// By key of a track: its number.
    numbers: BTreeMap<u32, u32>,
    /// How the objects of tracks looked.
    looks: Looks,
    last_key: u32,
    last_number: u32,
    /// Time and translation of the last pose.
    last_pose: Option<(f64, Vector3<f64>)>,
    /// Where the tracker's world begins.
    origin: Vector3<f64>,
}

impl Tracker {
    /// A tracker before the first frame.
    pub fn new(params: TrackParams) -> Self {
        Tracker {
            params,
            tracks: Vec::new(),
            window: Window::default(),
            continues: BTreeMap::new(),
            numbers: BTreeMap::new(),
            looks: Looks::default(),
            last_key: 0,
            last_number: 0,
            last_pose: None,
            origin: Vector3::zeros(),
        }
    }

    /// Takes the next frame. Gives the tracks of the instances of each frame that is decided by
    /// it, in the order of the frames.
    pub fn push(&mut self, frame: TrackerFrame) -> Vec<DecidedFrame> {
        let mut decided = if self.is_continued_by(&frame) { Vec::new() } else { self.finish() };
        let TrackerFrame { time, pose, instances } = frame;
        self.last_pose = Some((time, pose.translation.vector));
        self.move_world(&pose.translation.vector);
        let local = Translation3::from(-self.origin) * pose;
        let sighting = |instance| Arc::new(Sighting::new(instance, &local, time));
        let sightings: Vec<Arc<Sighting>> = instances.iter().map(sighting).collect();

        let gap_s = self.params.gap_s;
        self.tracks.retain(|track| {
            // Nobody asks which wall it was.
            let longest = if track.is_background() { gap_s.min(BACKGROUND_GAP) } else { gap_s };
            time - track.last().time <= longest
        });
        let pairs = affinities(&self.tracks, &sightings, time, &self.params);
        let weighed: Vec<(usize, usize, f64)> = pairs.iter().map(Candidate::weighed).collect();
        let track_of = assign(sightings.len(), self.tracks.len(), &weighed);
        let links = self.links(&pairs, &track_of, time);
        let (mut keys, mut places) = (Vec::new(), Vec::new());
        for (sighting, track) in sightings.iter().zip(track_of) {
            let track = track.unwrap_or_else(|| self.begin(sighting));
            let track = &mut self.tracks[track];
            if track.last().time < time {
                track.follow(Arc::clone(sighting), &self.params);
            }
            keys.push(track.key);
            places.push(track.kinematics.place);
        }
        let frame = WindowFrame { time, sensor: local, sightings, places, keys, links };
        self.window.frames.push_back(frame);
        self.continue_tracks(time);
        let lag_s = self.params.lag_s;
        let is_due = |since: f64| time - since >= lag_s;
        while self.window.undecided_since().is_some_and(is_due) {
            decided.push(self.decide());
        }
        decided
    }

    /// Decides the frames that are left with what is known. Tracks go on.
    pub fn decide_all(&mut self) -> Vec<DecidedFrame> {
        let mut decided = Vec::new();
        while self.window.undecided_since().is_some() {
            decided.push(self.decide());
        }
        decided
    }

    /// Decides the frames that are left, and ends all tracks.
    pub fn finish(&mut self) -> Vec<DecidedFrame> {
        let decided = self.decide_all();
        self.tracks.clear();
        self.window = Window::default();
        self.continues.clear();
        self.numbers.clear();
        self.looks.clear();
        self.last_pose = None;
        decided
    }

    /// Why each instance continues the track that it was given.
    fn links(
        &self,
        pairs: &[Candidate],
        track_of: &[Option<usize>],
        time: f64,
    ) -> Vec<Option<KeyLink>> {
        let mut of_instance: Vec<Vec<&Candidate>> = vec![Vec::new(); track_of.len()];
        pairs.iter().for_each(|pair| of_instance[pair.instance].push(pair));
        let link = |(given, mut pairs): (&Option<usize>, Vec<&Candidate>)| {
            let affinity = |pair: &Candidate| pair.agreement.affinity;
            pairs.sort_by(|a, b| affinity(b).total_cmp(&affinity(a)));
            let track = (*given)?;
            let chosen = pairs.iter().find(|pair| pair.track == track)?;
            let others = pairs.iter().filter(|pair| pair.track != track);
            let others = others.map(|pair| (self.tracks[pair.track].key, affinity(pair)));
            Some(KeyLink {
                since_s: time - self.tracks[track].last().time,
                agreement: chosen.agreement,
                others: others.collect(),
            })
        };
        track_of.iter().zip(of_instance).map(link).collect()
    }

    /// Whether a frame can follow the last one.
    fn is_continued_by(&self, frame: &TrackerFrame) -> bool {
        let Some((time, translation)) = self.last_pose else { return true };
        let seconds = frame.time - time;
        let moved = (frame.pose.translation.vector - translation).norm();
        seconds > 0.0 && seconds <= LONGEST_PAUSE && moved <= FASTEST * seconds
    }

    /// Begins a track; its place in the list.
    fn begin(&mut self, sighting: &Arc<Sighting>) -> usize {
        self.last_key += 1;
        self.tracks.push(Track::new(self.last_key, Arc::clone(sighting), &self.params));
        self.tracks.len() - 1
    }

    /// Joins tracks that began not long ago to those that they continue.
    fn continue_tracks(&mut self, now: f64) {
        let Some(since) = self.window.undecided_since() else { return };
        for found in continuations(&self.tracks, (since, now), &self.params) {
            self.continues.insert(found.by, found.of);
            self.tracks.retain(|track| track.key != found.of);
        }
    }

    /// The key under which a track began.
    fn first_key(&self, key: u32) -> u32 {
        let mut first = key;
        while let Some(&earlier) = self.continues.get(&first) {
            first = earlier;
        }
        first
    }

    /// Decides the next frame, and forgets what no later one needs.
    fn decide(&mut self) -> DecidedFrame {
        let track_of = |key| self.first_key(key);
        let appearances = self.window.appearances(track_of);
        let decided = decide(&self.window, &appearances, track_of, &self.params);
        let mut objects = self.looks.objects(&self.window, &appearances, &decided, &self.params);
        let mut number = |key: u32| {
            *self.numbers.entry(key).or_insert_with(|| {
                self.last_number += 1;
                self.last_number
            })
        };
        let tracks = decided.into_iter().map(|track| track.renumbered(&mut number)).collect();
        objects.iter_mut().for_each(|object| object.track = number(object.track));
        let links = self.decided_links();
        self.window.advance(self.params.lag_s);
        self.forget();
        DecidedFrame { tracks, objects, links }
    }

    /// Why the instances of the frame that is decided next continue tracks.
    fn decided_links(&self) -> Vec<TrackLink> {
        let known = |key: u32| self.numbers.get(&self.first_key(key)).copied();
        let frame = &self.window.frames[self.window.decided];
        let link = |(link, &key): (&Option<KeyLink>, &u32)| {
            let others = link.iter().flat_map(|link| &link.others);
            TrackLink {
                associated: known(key),
                is_continuation: link.is_none() && self.first_key(key) != key,
                since_s: link.as_ref().map(|link| link.since_s),
                agreement: link.as_ref().map(|link| link.agreement),
                others: others.filter_map(|&(other, of)| Some((known(other)?, of))).collect(),
            }
        };
        frame.links.iter().zip(&frame.keys).map(link).collect()
    }

    /// Forgets the numbers of tracks that are seen no more.
    fn forget(&mut self) {
        let of_tracks = self.tracks.iter().map(|track| track.key);
        let of_window = self.window.frames.iter().flat_map(|frame| frame.keys.iter().copied());
        let mut needed: Vec<u32> = of_tracks.chain(of_window).collect();
        let mut known = std::collections::BTreeSet::new();
        while let Some(key) = needed.pop() {
            if known.insert(key) {
                needed.extend(self.continues.get(&key));
            }
        }
        self.continues.retain(|key, _| known.contains(key));
        self.numbers.retain(|key, _| known.contains(key));
        self.looks.retain(|key| known.contains(&key));
    }

    /// Moves the world along with the sensor.
    fn move_world(&mut self, sensor: &Vector3<f64>) {
        let step = (sensor - self.origin).map(|along| (along / WORLD).trunc() * WORLD);
        if step == Vector3::zeros() {
            return;
        }
        self.origin += step;
        let by = step.map(|along| along as f32).into();
        self.tracks.iter_mut().for_each(|track| track.shift(by));
        self.window.shift(by);
    }
}
