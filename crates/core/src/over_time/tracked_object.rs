//! Objects as their tracks know them: how they move, and a box whose size does not flicker.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Vector2, Vector3};

use super::params::TrackParams;
use super::sighting::{Sighting, heading_of};
use super::votes::InstanceTrack;
use super::window::{Place, Window};
use crate::cloud::{Body, UprightBox};

/// The size of an object is the median of at most so many sightings, those of most points.
const FULLEST: usize = 16;

/// Of these only those count that have so large a part of the points of the fullest: an object that
/// is seen in part shows fewer.
const FULL: f64 = 0.5;

/// The velocity is that of so many seconds before and after a frame: longer, and a turn is cut.
const VELOCITY_OVER: f64 = 0.5;

/// What is slower stands, metres in a second: half the pace of a walk.
const LEAST_SPEED: f64 = 0.5;

/// A velocity of so many standard errors is none of chance.
const STANDARD_ERRORS: f64 = 3.0;

/// An object stands whose cells lie, where they are, as near to those before and after as this
/// share of what they do once it is moved along. Other faces of it come into sight as the sensor
/// passes, which looks like a slow motion.
const STANDS: f64 = 0.8;

/// A side that is seen to this share is seen whole: cells lie within it.
const SEEN_WHOLE: f64 = 0.8;

/// An object of a frame, as its track knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackedObject {
    /// Number of its track.
    pub track: u32,
    /// What it is, as last seen.
    pub body: Body,
    /// A box in the cloud's frame. Its size is the median of the sightings of most points until a
    /// lag after the frame; the faces toward the sensor lie where they are seen.
    pub bounds: UprightBox,
    /// Velocity over the ground in the cloud's frame; `None` of an object that is seen once.
    pub velocity: Option<ObjectVelocity>,
}

/// How an object moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectVelocity {
    /// Metres in a second; zero of what stands.
    pub along: [f64; 3],
    /// Standard error of each component on the plane, metres in a second.
    pub error: f64,
    /// Whether it moves: faster than half a metre in a second and not by chance, and what was seen
    /// of it before and after does not lie where it is seen now.
    pub is_moving: bool,
}

impl ObjectVelocity {
    /// Metres in a second.
    pub fn speed(&self) -> f64 {
        Vector3::from(self.along).norm()
    }
}

/// How the objects of tracks looked, by the key of the track.
#[derive(Debug, Default)]
pub(super) struct Looks(BTreeMap<u32, Look>);

#[derive(Debug, Default)]
struct Look {
    /// Sightings of most points.
    fullest: Vec<View>,
    /// Direction in which it last moved, radians in the tracker's world.
    heading: Option<f64>,
}

/// The box of a sighting.
#[derive(Debug, Clone, Copy)]
struct View {
    points: u32,
    size: [f64; 3],
    /// Direction of its length in the tracker's world, radians.
    yaw: f64,
}

impl View {
    fn of(sighting: &Sighting) -> Self {
        let size = sighting.size.map(f64::from);
        View { points: sighting.points, size, yaw: f64::from(sighting.yaw) }
    }

    /// Length, width and height if the length lies along `yaw`.
    fn size_along(&self, yaw: f64) -> [f64; 3] {
        let [length, width, height] = self.size;
        match (self.yaw - yaw).cos().abs() >= std::f64::consts::FRAC_1_SQRT_2 {
            true => [length, width, height],
            false => [width, length, height],
        }
    }
}

impl Looks {
    /// Forgets the tracks that are not needed.
    pub(super) fn retain(&mut self, is_needed: impl Fn(u32) -> bool) {
        self.0.retain(|&track, _| is_needed(track));
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// The objects of the frame that is decided next, by the key of their track.
    pub(super) fn objects(
        &mut self,
        window: &Window,
        appearances: &BTreeMap<u32, Vec<Place>>,
        decided: &[InstanceTrack],
        params: &TrackParams,
    ) -> Vec<TrackedObject> {
        let cells = cells_of_tracks(window, decided);
        let frame = &window.frames[window.decided];
        let mut objects = Vec::new();
        for (track, cells) in cells {
            let Some(of_track) = appearances.get(&track) else { continue };
            let Some(body) = body_of(window, of_track) else { continue };
            let look = self.0.entry(track).or_default();
            look.take(window, of_track, decided);
            let motion = Motion::of(window, of_track, params);
            if let Some(motion) = motion.filter(|motion| motion.is_moving) {
                look.heading = Some(motion.velocity.y.atan2(motion.velocity.x));
            }
            let later = of_track.iter().filter(|place| place.0 > window.decided);
            let later = later.map(|&place| View::of(window.sighting(place)));
            let views: Vec<View> = look.fullest.iter().copied().chain(later).collect();
            let Some((yaw, size)) = usual_look(views, look.heading) else { continue };
            let centre = centre(&cells, (yaw, size), &frame.sensor);
            let velocity = motion.map(|motion| motion.in_frame(&frame.sensor));
            let centre = frame.sensor.inverse_transform_point(&centre).coords.into();
            let bounds = UprightBox::new(centre, size, yaw - heading_of(&frame.sensor));
            objects.push(TrackedObject { track, body, bounds, velocity });
        }
        objects
    }
}

impl Look {
    /// Takes the sightings of the frame that is decided next that are wholly of the track.
    fn take(&mut self, window: &Window, of_track: &[Place], decided: &[InstanceTrack]) {
        let now = of_track.iter().filter(|place| place.0 == window.decided);
        let whole = now.filter(|place| matches!(decided[place.1], InstanceTrack::Whole(_)));
        self.fullest.extend(whole.map(|&place| View::of(window.sighting(place))));
        self.fullest.sort_by_key(|view| std::cmp::Reverse(view.points));
        self.fullest.truncate(FULLEST);
    }
}

/// The cells of each track in the frame that is decided next.
fn cells_of_tracks(window: &Window, decided: &[InstanceTrack]) -> BTreeMap<u32, Vec<[f32; 3]>> {
    let mut cells: BTreeMap<u32, Vec<[f32; 3]>> = BTreeMap::new();
    let sightings = &window.frames[window.decided].sightings;
    for (sighting, track) in sightings.iter().zip(decided) {
        match track {
            InstanceTrack::Whole(track) if sighting.body.is_some() => {
                cells.entry(*track).or_default().extend(sighting.cells.iter());
            }
            InstanceTrack::Whole(_) => {}
            InstanceTrack::Parts(of_cell) => {
                for (cell, &track) in sighting.cells.iter().zip(of_cell) {
                    cells.entry(track).or_default().push(cell);
                }
            }
        }
    }
    cells
}

/// What a track is: as it was last seen until the frame that is decided next, or first seen after.
fn body_of(window: &Window, of_track: &[Place]) -> Option<Body> {
    let (until, after): (Vec<&Place>, Vec<&Place>) =
        of_track.iter().partition(|place| place.0 <= window.decided);
    let body = |place: &&Place| window.sighting(**place).body;
    until.iter().rev().find_map(body).or_else(|| after.iter().find_map(body))
}

/// The direction and the size of an object: where it heads, or as the sighting of most points has
/// it; and the median of its sides.
fn usual_look(mut views: Vec<View>, heading: Option<f64>) -> Option<(f64, [f64; 3])> {
    views.sort_by_key(|view| std::cmp::Reverse(view.points));
    views.truncate(FULLEST);
    let most = f64::from(views.first()?.points);
    views.retain(|view| f64::from(view.points) >= FULL * most);
    let yaw = heading.or(views.first().map(|view| view.yaw))?;
    let sizes: Vec<[f64; 3]> = views.iter().map(|view| view.size_along(yaw)).collect();
    let median = |axis: usize| {
        let mut sides: Vec<f64> = sizes.iter().map(|size| size[axis]).collect();
        sides.sort_by(f64::total_cmp);
        sides.get(sides.len() / 2).copied()
    };
    Some((yaw, [median(0)?, median(1)?, median(2)?]))
}

/// Where the middle of an object lies in the tracker's world: sides that are seen in part begin at
/// the face toward the sensor, and what is hidden lies behind and below.
fn centre(
    cells: &[[f32; 3]],
    (yaw, size): (f64, [f64; 3]),
    sensor: &Isometry3<f64>,
) -> Point3<f64> {
    let axes = [
        Vector3::new(yaw.cos(), yaw.sin(), 0.0),
        Vector3::new(-yaw.sin(), yaw.cos(), 0.0),
        Vector3::z(),
    ];
    let mut middle = Vector3::zeros();
    for (number, (axis, side)) in axes.iter().zip(size).enumerate() {
        let along = cells.iter().map(|cell| axis.dot(&Vector3::from(cell.map(f64::from))));
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
            (low.min(at), high.max(at))
        });
        let sensor_at = axis.dot(&sensor.translation.vector);
        let at = if high - low >= SEEN_WHOLE * side {
            (low + high) / 2.0
        } else if number == 2 || sensor_at > high {
            high - side / 2.0
        } else if sensor_at < low {
            low + side / 2.0
        } else {
            (low + high) / 2.0
        };
        middle += axis * at;
    }
    middle.into()
}

/// Velocity of a track in the frame that is decided next, in the tracker's world.
#[derive(Debug, Clone, Copy)]
struct Motion {
    velocity: Vector2<f64>,
    error: f64,
    is_moving: bool,
}

impl Motion {
    /// By a line through the places around, the nearer ones counting more (Cleveland 1979). `None`
    /// where there are not two.
    fn of(window: &Window, of_track: &[Place], params: &TrackParams) -> Option<Self> {
        let time = |place: &Place| window.frames[place.0].time;
        let now = window.frames[window.decided].time;
        let near: Vec<&Place> =
            of_track.iter().filter(|place| (time(place) - now).abs() < VELOCITY_OVER).collect();
        let (used, over) = match near.len() {
            0..=2 => (of_track.iter().collect(), window.span_around(now)),
            _ => (near, VELOCITY_OVER),
        };
        let weighed = |place: &&Place| {
            let share = ((time(place) - now).abs() / over.max(1e-3)).min(1.0);
            ((1.0 - share.powi(3)).powi(3).max(1e-3), time(place) - now, window.place(**place))
        };
        let used: Vec<(f64, f64, Vector2<f64>)> = used.iter().map(weighed).collect();
        let total: f64 = used.iter().map(|(weight, ..)| weight).sum();
        let mean_time = used.iter().map(|(weight, time, _)| weight * time).sum::<f64>() / total;
        let mean_place =
            used.iter().map(|(weight, _, place)| *weight * place).sum::<Vector2<f64>>() / total;
        let of_time = |time: f64| time - mean_time;
        let spread: f64 =
            used.iter().map(|(weight, time, _)| weight * of_time(*time).powi(2)).sum();
        if used.len() < 2 || spread < 1e-9 {
            return None;
        }
        let slope = |(weight, time, place): &(f64, f64, Vector2<f64>)| {
            (place - mean_place) * (weight * of_time(*time))
        };
        let velocity = used.iter().map(slope).sum::<Vector2<f64>>() / spread;
        let left = |(weight, time, place): &(f64, f64, Vector2<f64>)| {
            weight * (place - mean_place - velocity * of_time(*time)).norm_squared() / 2.0
        };
        let scatter = used.iter().map(left).sum::<f64>() / total;
        // What the filter takes out of the places is in no residual.
        let variance = scatter + (params.displacement_error / 2.0).powi(2);
        let squares =
            used.iter().map(|(weight, time, _)| (weight * of_time(*time)).powi(2)).sum::<f64>();
        let error = (variance * squares).sqrt() / spread;
        let is_fast = velocity.norm() > LEAST_SPEED.max(STANDARD_ERRORS * error);
        Some(Motion { velocity, error, is_moving: is_fast && !stands(window, of_track) })
    }

    /// The velocity in the cloud's frame.
    fn in_frame(&self, sensor: &Isometry3<f64>) -> ObjectVelocity {
        let Motion { velocity, error, is_moving, .. } = *self;
        let along = match is_moving {
            true => Vector3::new(velocity.x, velocity.y, 0.0),
            false => Vector3::zeros(),
        };
        let along = sensor.rotation.inverse_transform_vector(&along).into();
        ObjectVelocity { along, error, is_moving }
    }
}

/// Whether a track is, at the ends of the window, where it is in the frame that is decided next.
fn stands(window: &Window, of_track: &[Place]) -> bool {
    let Some(&now) = of_track.iter().find(|place| place.0 == window.decided) else { return true };
    let ends = [of_track.first(), of_track.last()].into_iter().flatten();
    let (mut there, mut moved) = (0.0, 0.0);
    for &end in ends.filter(|end| end.0 != window.decided) {
        let shift = (window.place(end) - window.place(now)).cast::<f32>();
        let (now, end) = (window.sighting(now), window.sighting(end));
        there += overlap(now, end, [0.0, 0.0]);
        moved += overlap(now, end, shift.into());
    }
    there >= STANDS * moved
}

/// Share of the cells of the smaller of two sightings that are near one of the larger, if the first
/// is moved on the plane.
fn overlap(first: &Sighting, second: &Sighting, [x, y]: [f32; 2]) -> f64 {
    let (small, large, shift) = match first.cells.len() <= second.cells.len() {
        true => (first, second, [x, y]),
        false => (second, first, [-x, -y]),
    };
    let near = small.cells.count_near(&large.cells, shift, small.reach.max(large.reach));
    near as f64 / small.cells.len().max(1) as f64
}
