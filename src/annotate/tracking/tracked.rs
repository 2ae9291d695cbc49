//! A clustered cloud whose tracks are decided: the tracks of its points, its boxes, its messages.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::time::Instant;

use nalgebra::{Point3, Translation3, Vector3};

use super::observation::{CloudObservation, Stored};
use crate::annotate::types::{Objects, Placement};
use crate::annotate::writing::{Annotated, Writing};
use crate::error::Result;
use crate::frames::EncodedCloud;
use crate::messages::annotation::{OwnedAnnotation, annotated_cloud, annotation_of};
use divmerge_core::cloud::{Instance, PointCloud, PointColumns, UprightBox};
use divmerge_core::over_time::{
    DecidedFrame, InstanceTrack, ObjectVelocity, ObservedInstance, TrackedObject,
};
use divmerge_recording::stopwatch::ms_since;

/// A clustered cloud whose tracks are not decided.
pub(in crate::annotate) struct Untracked {
    pub(in crate::annotate) labels: OwnedAnnotation,
    pub(in crate::annotate) instances: Vec<Instance>,
    pub(in crate::annotate) placement: Placement,
    pub(in crate::annotate) observation: CloudObservation,
    /// The same as a checkpoint keeps it, if checkpoints are written.
    pub(in crate::annotate) kept: Option<String>,
    /// The rest of what is known; its messages are empty.
    pub(in crate::annotate) annotated: Annotated,
}

impl Untracked {
    /// Keeps what a checkpoint needs.
    pub(in crate::annotate) fn keep(&mut self) {
        let stored = Stored {
            observation: self.observation.clone(),
            instances: self.instances.clone(),
            placement: self.placement,
        };
        self.kept = Some(stored.to_text());
    }

    /// The messages of the cloud of a slice: its tracks are found when the slices are joined.
    ///
    /// # Errors
    /// Those of [`write`](Self::write).
    pub(in crate::annotate) fn write_untracked(
        self,
        encoded: &EncodedCloud,
        writing: Writing,
    ) -> Result<Annotated> {
        let track = vec![0; self.labels.instance.len()];
        let instances = self.instances.clone();
        let objects = Objects::of_cloud(&instances);
        self.write_with(encoded, writing, (&track, objects))
    }

    /// The messages of the cloud with its tracks.
    ///
    /// # Errors
    /// Those of [`annotate_message`](crate::annotate::annotate_message).
    pub(in crate::annotate) fn write(
        self,
        encoded: &EncodedCloud,
        writing: Writing,
        (observed, decided): (&[ObservedInstance], &DecidedFrame),
    ) -> Result<Annotated> {
        let points = Points { encoded, placement: &self.placement, cloud: OnceCell::new() };
        let found = (observed, decided.tracks.as_slice());
        let track = point_tracks(&self.labels.instance, &points, found)?;
        let mut instances = tracked_instances(&self, &track, &points, found)?;
        let bounds = object_bounds(&track, &points, &decided.objects)?;
        for instance in &mut instances {
            instance.bounds = bounds.get(&instance.id).copied().unwrap_or(instance.bounds);
        }
        let velocity = |object: &TrackedObject| Some((object.track, object.velocity?));
        let velocities: BTreeMap<u32, ObjectVelocity> =
            decided.objects.iter().filter_map(velocity).collect();
        let objects = Objects { instances: &instances, velocities: Some(&velocities) };
        self.write_with(encoded, writing, (&track, objects))
    }

    fn write_with(
        self,
        encoded: &EncodedCloud,
        writing: Writing,
        (track, objects): (&[u32], Objects),
    ) -> Result<Annotated> {
        let started = Instant::now();
        let Untracked { labels, placement, mut annotated, .. } = self;
        let wire = encoded.decode()?;
        let written = wire.reformatted(writing.types.format(wire.format))?;
        annotated_cloud(&written, &labels.with_tracks(Some(track)), &mut annotated.cloud)?;
        writing.types.write_objects(&written, objects, &placement, &mut annotated.objects)?;
        annotated.times.encode_ms += ms_since(started);
        Ok(annotated)
    }
}

/// A cloud of a slice, from its message on `T/instances` and what the slice keeps of it. `None` if
/// the message is not the one of a cloud whose objects are followed.
///
/// # Errors
/// Those of `CloudFormat::decode`.
pub(in crate::annotate) fn stored_cloud(
    encoded: &EncodedCloud,
    writing: Writing,
    message: &[u8],
    stored: Stored,
) -> Result<Option<Untracked>> {
    let format = writing.types.format(encoded.format);
    let wire = format.decode(message)?;
    let Some(labels) = annotation_of(&wire) else { return Ok(None) };
    let Stored { observation, instances, placement } = stored;
    let annotated = Annotated {
        frame_id: wire.frame_id.clone(),
        stamp_ns: wire.stamp_ns(),
        ..Annotated::default()
    };
    let kept = None;
    Ok(Some(Untracked { labels, instances, placement, observation, kept, annotated }))
}

/// Where the points of a message lie; it is decoded for this alone, once and where it is needed.
struct Points<'a> {
    encoded: &'a EncodedCloud,
    placement: &'a Placement,
    cloud: OnceCell<PointCloud>,
}

impl Points<'_> {
    /// The points as they were clustered, decoded at the first call.
    fn cloud(&self) -> Result<&PointCloud> {
        match self.cloud.get() {
            Some(cloud) => Ok(cloud),
            None => {
                let cloud = self.decoded()?;
                Ok(self.cloud.get_or_init(|| cloud))
            }
        }
    }

    /// The points as they were clustered. They are the same in a run and in a join, which knows no
    /// more of the cloud than its message and its placement.
    fn decoded(&self) -> Result<PointCloud> {
        let wire = self.encoded.decode()?;
        let recorded = wire.to_cloud(None)?;
        let Placement { frame, per_metre } = self.placement;
        let offset = Translation3::from(recorded.offset);
        let clustered_from_recorded = frame.inverse() * wire.isometry() * offset;
        let positions = (0..recorded.len()).map(|point| {
            let at = Point3::from(recorded.position(point)).cast::<f64>();
            (clustered_from_recorded * at).coords.map(|along| (along / per_metre) as f32)
        });
        let mut columns = PointColumns::default();
        for position in positions {
            columns.x.push(position.x);
            columns.y.push(position.y);
            columns.z.push(position.z);
        }
        (columns.height, columns.width) = (1, columns.x.len());
        Ok(columns.checked()?)
    }
}

/// The boxes of objects as their tracks know them, grown so that each holds the points of its
/// track.
fn object_bounds(
    track: &[u32],
    points: &Points,
    objects: &[TrackedObject],
) -> Result<BTreeMap<u32, UprightBox>> {
    if objects.is_empty() {
        return Ok(BTreeMap::new());
    }
    let cloud = points.cloud()?;
    let empty = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let number: BTreeMap<u32, usize> =
        objects.iter().enumerate().map(|(number, object)| (object.track, number)).collect();
    let axes: Vec<[Vector3<f64>; 3]> = objects.iter().map(|object| object.bounds.axes()).collect();
    let mut extents = vec![empty; objects.len()];
    for (point, track) in track.iter().enumerate().filter(|(_, track)| **track != 0) {
        let Some(&number) = number.get(track) else { continue };
        let at = Vector3::from(cloud.position(point).map(f64::from));
        let (low, high) = &mut extents[number];
        for (k, axis) in axes[number].iter().enumerate() {
            let along = axis.dot(&at);
            low[k] = low[k].min(along);
            high[k] = high[k].max(along);
        }
    }
    let grown = |(object, (low, high)): (&TrackedObject, ([f64; 3], [f64; 3]))| {
        (object.track, object.bounds.holding(low, high))
    };
    Ok(objects.iter().zip(extents).map(grown).collect())
}

/// The track of each point. A point of an instance of several tracks has that of the nearest cell.
fn point_tracks(
    instance: &[u32],
    points: &Points,
    (observed, tracks): (&[ObservedInstance], &[InstanceTrack]),
) -> Result<Vec<u32>> {
    let count = observed.last().map_or(0, |last| last.id as usize);
    let mut of_instance: Vec<Option<usize>> = vec![None; count + 1];
    let mut is_in_parts = false;
    for (number, (observed, track)) in observed.iter().zip(tracks).enumerate() {
        of_instance[observed.id as usize] = Some(number);
        is_in_parts |= matches!(track, InstanceTrack::Parts(_));
    }
    let cloud = if is_in_parts { Some(points.cloud()?) } else { None };
    let track_of = |(point, &id): (usize, &u32)| {
        let Some(number) = of_instance.get(id as usize).copied().flatten() else { return 0 };
        tracks[number].of_point(&observed[number], || {
            let cloud = cloud.expect("decoded, as an instance is in parts");
            cloud.position(point)
        })
    };
    Ok(instance.iter().enumerate().map(track_of).collect())
}

/// What is found of each track in the cloud, by its number: an instance as it is, or where a track
/// has parts of several or one is of several tracks, the box around its points.
fn tracked_instances(
    cloud: &Untracked,
    track: &[u32],
    points: &Points,
    (observed, tracks): (&[ObservedInstance], &[InstanceTrack]),
) -> Result<Vec<Instance>> {
    let by_id: BTreeMap<u32, &Instance> = cloud.instances.iter().map(|i| (i.id, i)).collect();
    // Of each track: its largest instance, and whether that is all of it.
    let mut found: BTreeMap<u32, (&Instance, bool)> = BTreeMap::new();
    for (observed, of_instance) in observed.iter().zip(tracks) {
        let Some(&instance) = by_id.get(&observed.id) else { continue };
        let (numbers, is_whole) = match of_instance {
            InstanceTrack::Whole(track) => (std::slice::from_ref(track), true),
            InstanceTrack::Parts(of_cell) => (of_cell.as_slice(), false),
        };
        let mut last = 0;
        for &number in numbers.iter().filter(|&&number| number != 0) {
            if std::mem::replace(&mut last, number) == number {
                continue;
            }
            let entry = found.entry(number).or_insert((instance, is_whole));
            if entry.0.id != instance.id {
                let larger = if instance.points > entry.0.points { instance } else { entry.0 };
                *entry = (larger, false);
            }
        }
    }
    let positions = match found.values().any(|(_, is_whole)| !is_whole) {
        true => Some(points.cloud()?),
        false => None,
    };
    let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    if positions.is_some() {
        for (point, number) in track.iter().enumerate() {
            if found.get(number).is_some_and(|(_, is_whole)| !is_whole) {
                members.entry(*number).or_default().push(point as u32);
            }
        }
    }
    let tracked = |(number, (instance, _)): (u32, (&Instance, bool))| {
        let mut tracked = Instance { id: number, ..instance.clone() };
        if let (Some(cloud), Some(members)) = (positions, members.get(&number)) {
            tracked.points = members.len() as u32;
            tracked.bounds = UprightBox::around(cloud, members).unwrap_or(tracked.bounds);
        }
        tracked
    };
    let is_there = |(number, (_, is_whole)): &(u32, (&Instance, bool))| {
        *is_whole || members.contains_key(number)
    };
    Ok(found.into_iter().filter(is_there).map(tracked).collect())
}
