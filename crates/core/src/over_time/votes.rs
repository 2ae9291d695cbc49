//! Time as evidence: a cut that lasts a moment is a mistake, and the frames before and after say
//! so.
//!
//! Each cell of an instance is carried to the other frames of the window, once as part of its own
//! track and once as part of each other track that reaches it. In each frame where a cell of that
//! track is near, the track has a vote. So a piece that was part of a whole before and after goes
//! back to it, an object that another one swallowed for a moment is cut out again, and a track that
//! changed hands changes back.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Vector2;

use super::observation::ObservedInstance;
use super::params::TrackParams;
use super::sighting::{Cells, Sighting};
use super::window::{Place, Window};

/// Frames in which a track must be seen to have a say in others.
const APPEARANCES: usize = 3;

/// Fewest cells that are cut out of an instance.
const LEAST_PART: usize = 3;

/// A vote reaches to this share of the reach of an overlap: it must tell neighbours apart.
const REACH: f32 = 0.7;

/// The track of an instance.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum InstanceTrack {
    /// All of it is of one.
    Whole(u32),
    /// The track of each of its cells: it is of several.
    Parts(Vec<u32>),
}

impl InstanceTrack {
    /// The track of a point of the instance, which lies `at` a place in the cloud's frame, metres:
    /// that of the nearest cell where the instance is of several.
    pub fn of_point(&self, observed: &ObservedInstance, at: impl FnOnce() -> [f32; 3]) -> u32 {
        match self {
            InstanceTrack::Whole(track) => *track,
            InstanceTrack::Parts(of_cell) => of_cell[observed.nearest_cell(at())],
        }
    }

    /// The same with other numbers for the tracks.
    pub(super) fn renumbered(self, mut number: impl FnMut(u32) -> u32) -> Self {
        match self {
            InstanceTrack::Whole(track) => InstanceTrack::Whole(number(track)),
            InstanceTrack::Parts(tracks) => {
                InstanceTrack::Parts(tracks.into_iter().map(number).collect())
            }
        }
    }
}

/// A track that may vote on cells of a frame.
#[derive(Clone, Copy)]
struct Voter<'a> {
    track: u32,
    appearances: &'a [Place],
    /// Where it is in the frame that is decided.
    place: Vector2<f64>,
}

/// A track that may have a claim on an instance of another.
struct Claimant<'a> {
    voter: Voter<'a>,
    /// Whether it is background, as last seen.
    is_background: bool,
    /// The box of what it reaches in the frames nearest to the one that is decided, carried there.
    low: [f32; 3],
    high: [f32; 3],
}

/// The track of each instance of the frame that is decided next.
pub(super) fn decide(
    window: &Window,
    appearances: &BTreeMap<u32, Vec<Place>>,
    track_of: impl Fn(u32) -> u32,
    params: &TrackParams,
) -> Vec<InstanceTrack> {
    let frame = &window.frames[window.decided];
    let claimants: Vec<Claimant> = claimants(window, appearances);
    let decide = |(number, sighting): (usize, &Arc<Sighting>)| {
        let track = track_of(frame.keys[number]);
        let (appearances, place) = (appearances[&track].as_slice(), frame.places[number]);
        let own = Voter { track, appearances, place };
        let is_rival =
            |claimant: &&Claimant| claimant.voter.track != track && claimant.may_claim(sighting);
        let rivals: Vec<&Claimant> = claimants.iter().filter(is_rival).collect();
        match rivals.is_empty() {
            true => InstanceTrack::Whole(track),
            false => elect(window, sighting, own, &rivals, params),
        }
    };
    frame.sightings.iter().enumerate().map(decide).collect()
}

/// The tracks that are or should be in the frame that is decided next.
fn claimants<'a>(window: &Window, appearances: &'a BTreeMap<u32, Vec<Place>>) -> Vec<Claimant<'a>> {
    let seen_often = appearances.iter().filter(|(_, places)| places.len() >= APPEARANCES);
    let claimant = |(&track, appearances): (&u32, &'a Vec<Place>)| {
        let place = window.place_in(window.decided, appearances)?;
        Some(Claimant::new(window, Voter { track, appearances, place }))
    };
    seen_often.filter_map(claimant).collect()
}

impl<'a> Claimant<'a> {
    fn new(window: &Window, voter: Voter<'a>) -> Self {
        let Voter { appearances, place, .. } = voter;
        let at = appearances.partition_point(|place| place.0 < window.decided);
        let near = [at.checked_sub(1), Some(at), Some(at + 1)];
        let near = near.into_iter().flatten().filter_map(|number| appearances.get(number));
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for &other in near.filter(|other| other.0 != window.decided) {
            let shift = place - window.place(other);
            let shift = [shift.x as f32, shift.y as f32, 0.0];
            let seen = window.sighting(other);
            let reach = seen.reach * REACH;
            for axis in 0..3 {
                low[axis] = low[axis].min(seen.cells.low[axis] + shift[axis] - reach);
                high[axis] = high[axis].max(seen.cells.high[axis] + shift[axis] + reach);
            }
        }
        let last = appearances.last().map(|&place| window.sighting(place));
        let is_background = last.is_none_or(|sighting| sighting.body.is_none());
        Claimant { voter, is_background, low, high }
    }

    /// Whether the track reaches a place.
    fn reaches(&self, at: [f32; 3]) -> bool {
        (0..3).all(|k| self.low[k] <= at[k] && self.high[k] >= at[k])
    }

    /// Whether the track reaches the instance of another. Where background is cut does not matter.
    fn may_claim(&self, sighting: &Sighting) -> bool {
        let Cells { low, high, .. } = &sighting.cells;
        let is_reached = (0..3).all(|k| self.low[k] <= high[k] && self.high[k] >= low[k]);
        is_reached && !(self.is_background && sighting.body.is_none())
    }
}

/// Gives an instance, or its cells, to the track with most votes; equal votes leave it.
fn elect(
    window: &Window,
    sighting: &Sighting,
    own: Voter,
    rivals: &[&Claimant],
    params: &TrackParams,
) -> InstanceTrack {
    let elect_cell = |cell: usize| {
        let at = sighting.cells.at(cell);
        let mut best = None;
        for Claimant { voter: rival, .. } in rivals.iter().filter(|rival| rival.reaches(at)) {
            let (most, track) =
                *best.get_or_insert_with(|| (votes(window, own, at) + 1, own.track));
            let votes = match rival.appearances.len() > most {
                true => votes(window, *rival, at),
                false => 0,
            };
            best = Some(if votes > most { (votes, rival.track) } else { (most, track) });
        }
        best.map_or(own.track, |(_, track)| track)
    };
    let cells = sighting.cells.len();
    let mut elected: Vec<u32> = (0..cells).map(elect_cell).collect();
    let count = |elected: &[u32], track| elected.iter().filter(|&&other| other == track).count();
    for Claimant { voter: rival, .. } in rivals {
        let won = count(&elected, rival.track);
        if won as f64 >= params.whole_share * cells as f64 && won > 0 {
            return InstanceTrack::Whole(rival.track);
        }
        let usual = rival.appearances.iter().map(|&place| window.sighting(place).cells.len());
        let usual = usual.sum::<usize>() as f64 / rival.appearances.len() as f64;
        let least = params.part_share * usual.min(cells as f64);
        if won < LEAST_PART || (won as f64) < least {
            elected.iter_mut().filter(|track| **track == rival.track).for_each(|t| *t = own.track);
        }
    }
    match count(&elected, own.track) == cells {
        true => InstanceTrack::Whole(own.track),
        false => InstanceTrack::Parts(elected),
    }
}

/// Other frames in which a track has a cell near a place of the frame that is decided, carried
/// there with it.
fn votes(window: &Window, voter: Voter, at: [f32; 3]) -> usize {
    let others = voter.appearances.iter().filter(|place| place.0 != window.decided);
    let is_hit = |&&other: &&Place| {
        let shift = window.place(other) - voter.place;
        let seen = window.sighting(other);
        let reach = seen.reach * REACH;
        let carried = [at[0] + shift.x as f32, at[1] + shift.y as f32, at[2]];
        seen.cells.is_near(carried, reach) && seen.cells.is_within(carried, reach * reach)
    };
    others.filter(is_hit).count()
}
