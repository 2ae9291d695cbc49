//! Tracks from their first cloud to their last.

use std::collections::BTreeMap;

use serde::Serialize;

use divmerge_core::cloud::Body;
use divmerge_core::over_time::{DecidedFrame, InstanceTrack, ObservedInstance};

/// An object that was out of sight for longer may have stood meanwhile, seconds.
const LONGEST_STEP: f64 = 0.5;

/// An object that moves in fewer clouds stands: chance alone comes to one or two.
const LEAST_MOVING: u64 = 3;

/// An object from its first cloud to its last.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrackSummary {
    /// Its number: the field `track` of its points.
    pub track: u32,
    /// What it is by most of its points: person, two-wheeler, car or large vehicle.
    pub body: &'static str,
    /// Class of most of its points in the recording's ids; none without classes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub class: Option<u16>,
    /// Stamp of the first cloud that has it, nanoseconds since 1970.
    pub first_ns: i64,
    /// Stamp of the last.
    pub last_ns: i64,
    /// Clouds that have it.
    pub clouds: u64,
    /// Length, width and height of its box in the last cloud, metres: the size of its sightings of
    /// most points.
    pub size: [f32; 3],
    /// Whether it moved: in half of its clouds, or by its own length in all.
    pub moving: bool,
    /// Mean speed over the ground while it moved, and the standard error of the speed in a cloud;
    /// metres in a second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed: Option<[f32; 2]>,
}

/// The objects of a topic so far, by the number of their track.
#[derive(Debug, Default)]
pub(super) struct Summaries(BTreeMap<u32, Sums>);

#[derive(Debug, Clone)]
struct Sums {
    first_ns: i64,
    last_ns: i64,
    clouds: u64,
    size: [f32; 3],
    /// Points by what they are of.
    points: Vec<((Body, u16), u64)>,
    /// Clouds in which it moved, and the sums of its speed and of the errors of that.
    moving: (u64, f64, f64),
    /// How far it moved, metres.
    way: f64,
}

impl Summaries {
    /// Takes a cloud whose tracks are decided.
    pub(super) fn take(
        &mut self,
        time_ns: i64,
        observed: &[ObservedInstance],
        decided: &DecidedFrame,
    ) {
        for object in &decided.objects {
            let sums = self.0.entry(object.track).or_insert_with(|| Sums {
                first_ns: time_ns,
                last_ns: time_ns,
                clouds: 0,
                size: [0.0; 3],
                points: Vec::new(),
                moving: (0, 0.0, 0.0),
                way: 0.0,
            });
            let step = time_ns.saturating_sub(sums.last_ns) as f64 / 1e9;
            sums.last_ns = time_ns;
            sums.clouds += 1;
            sums.size = object.bounds.size.map(|along| along as f32);
            if let Some(velocity) = object.velocity.filter(|velocity| velocity.is_moving) {
                let (clouds, speed, error) = &mut sums.moving;
                *clouds += 1;
                *speed += velocity.speed();
                *error += velocity.error;
                sums.way += velocity.speed() * step.clamp(0.0, LONGEST_STEP);
            }
        }
        for (instance, track) in observed.iter().zip(&decided.tracks) {
            let (InstanceTrack::Whole(track), Some(body)) = (track, instance.body) else {
                continue;
            };
            let Some(sums) = self.0.get_mut(track) else { continue };
            let kind = (body, instance.semantic);
            match sums.points.iter_mut().find(|(of, _)| *of == kind) {
                Some((_, points)) => *points += u64::from(instance.points),
                None => sums.points.push((kind, u64::from(instance.points))),
            }
        }
    }

    /// One of each track, in the order of their numbers.
    pub(super) fn each(&self) -> Vec<TrackSummary> {
        let summary = |(&track, sums): (&u32, &Sums)| {
            let (clouds, speed, error) = sums.moving;
            let moving = clouds >= LEAST_MOVING
                && (2 * clouds >= sums.clouds || sums.way >= f64::from(sums.size[0]));
            let mean = |sum: f64| (sum / clouds as f64) as f32;
            let most = sums.points.iter().max_by_key(|(_, points)| *points);
            let (body, class) = most.map(|(kind, _)| *kind)?;
            Some(TrackSummary {
                track,
                body: body.name(),
                class: Some(class).filter(|&class| class != 0),
                first_ns: sums.first_ns,
                last_ns: sums.last_ns,
                clouds: sums.clouds,
                size: sums.size,
                moving,
                speed: moving.then(|| [mean(speed), mean(error)]),
            })
        };
        self.0.iter().filter_map(summary).collect()
    }
}
