//! The ways of objects over the ground.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Point3;
use rerun::components::{LineStrip3D, Radius};
use rerun::{EntityPath, RecordingStream, RecordingStreamResult, archetypes};

use super::frame::{boxes, log_in_frame};
use super::names::rgb;
use crate::annotate::TrackedFrame;
use crate::messages::palette::instance_colour;
use crate::view::look;
use divmerge_core::cloud::UprightBox;
use divmerge_core::over_time::TrackedObject;

/// Clouds that a trail goes back.
const TRAIL: usize = 50;

/// The last places of the objects of a topic in a frame that stands still.
#[derive(Debug, Default)]
pub struct Trails {
    ways: BTreeMap<u32, Way>,
    sensor: VecDeque<Point3<f64>>,
    clouds: u64,
}

/// The places of a track.
#[derive(Debug, Default)]
struct Way {
    places: VecDeque<Point3<f64>>,
    /// Number of the cloud that saw it last.
    last: u64,
    has_moved: bool,
}

impl Trails {
    /// Takes the next cloud.
    pub fn push(&mut self, frame: &TrackedFrame) {
        if frame.began_anew {
            *self = Trails::default();
        }
        self.clouds += 1;
        add(&mut self.sensor, frame.world_from_cloud * Point3::origin());
        for object in &frame.objects {
            let way = self.ways.entry(object.track).or_default();
            way.last = self.clouds;
            way.has_moved |= object.velocity.is_some_and(|velocity| velocity.is_moving);
            let [x, y, z] = object.bounds.centre;
            let foot = Point3::new(x, y, z - object.bounds.size[2] / 2.0);
            add(&mut way.places, frame.world_from_cloud * foot);
        }
        let oldest = self.clouds.saturating_sub(TRAIL as u64);
        self.ways.retain(|_, way| way.last > oldest);
    }

    /// Logs the trails of what has moved, the way of the sensor and the boxes of tracks, in the
    /// frame of the cloud that was taken last.
    pub fn log(
        &self,
        recording: &RecordingStream,
        topic: &EntityPath,
        frame: &TrackedFrame,
    ) -> RecordingStreamResult<()> {
        let log = |below: &str, entity: &dyn rerun::AsComponents| {
            log_in_frame(recording, topic.join(&below.into()), &frame.frame_id, entity)
        };
        let cloud_from_world = frame.world_from_cloud.inverse();
        let strip = |places: &VecDeque<Point3<f64>>| {
            let there = places.iter().map(|place| cloud_from_world * place);
            LineStrip3D::from_iter(there.map(|at| [at.x as f32, at.y as f32, at.z as f32]))
        };
        let moved: Vec<(u32, &Way)> = self
            .ways
            .iter()
            .filter(|(_, way)| way.has_moved && way.places.len() > 1)
            .map(|(&track, way)| (track, way))
            .collect();
        let trails = archetypes::LineStrips3D::new(moved.iter().map(|(_, way)| strip(&way.places)))
            .with_colors(moved.iter().map(|(track, _)| rgb(instance_colour(*track))))
            .with_radii([Radius::new_ui_points(1.5)])
            .with_labels(moved.iter().map(|(track, _)| format!("track {track}")))
            .with_show_labels(false);
        log("tracks/trails", &trails)?;
        let [red, green, blue, _] = look::DARK.on_panel;
        let sensor = archetypes::LineStrips3D::new([strip(&self.sensor)])
            .with_colors([rgb([red, green, blue])])
            .with_radii([Radius::new_ui_points(1.5)]);
        log("tracks/sensor", &sensor)?;
        let bounds: Vec<&UprightBox> = frame.objects.iter().map(|object| &object.bounds).collect();
        let boxes = boxes(&bounds)
            .with_colors(frame.objects.iter().map(|object| rgb(instance_colour(object.track))))
            .with_labels(frame.objects.iter().map(title));
        log("tracks/boxes", &boxes)
    }
}

/// Adds a place, and forgets the oldest beyond a trail.
fn add(places: &mut VecDeque<Point3<f64>>, place: Point3<f64>) {
    places.push_back(place);
    if places.len() > TRAIL {
        places.pop_front();
    }
}

/// Its number, what it is, and how fast it moves.
fn title(object: &TrackedObject) -> String {
    let speed = object.velocity.filter(|velocity| velocity.is_moving);
    let speed = speed.map(|velocity| format!(" {:.1} m/s", velocity.speed()));
    format!("{} {}{}", object.track, object.body.name(), speed.unwrap_or_default())
}
