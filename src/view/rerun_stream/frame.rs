//! One cloud on its way to the viewer.

use rerun::components::{FillMode, LineStrip3D, Radius, TextLogLevel};
use rerun::{
    AsComponents, EntityPath, Quaternion, RecordingStream, RecordingStreamResult, archetypes,
};

use super::names::{reason_id, rgb, shown_id, truth_id};
use crate::annotate::ClusteredFrame;
use crate::messages::palette::{BACKGROUND_COLOUR, instance_colour};
use crate::view::look::{self, Theme};
use crate::view::scene::FrameScene;
use crate::view::vote_graph::{Decision, MOST_EDGES, vote_edges};
use divmerge_core::cloud::{Instance, Reason, UprightBox};

/// Most objects whose names stand beside them; the others show theirs under the pointer.
pub const MOST_NAMES: usize = 15;
/// Without classes, least probability of what is named.
const LEAST_PROBABILITY: f64 = 0.1;
/// Names and colours of the stages of a run, as in `T/series/milliseconds`.
pub const STAGES: [(&str, [u8; 3]); 5] = [
    ("projection", [116, 184, 255]),
    ("mask", [255, 210, 90]),
    ("divide", [255, 122, 122]),
    ("merge", [130, 224, 140]),
    ("labels", [206, 150, 255]),
];

/// One cloud, and the entity of its topic, below which it is logged.
pub struct FrameLogger<'a> {
    pub recording: &'a RecordingStream,
    pub topic: EntityPath,
    pub frame: &'a ClusteredFrame<'a>,
}

impl FrameLogger<'_> {
    /// Logs everything about the cloud; `suspicion` in 0 to 1 is that of its decisions, and the
    /// colours of ranges end `far` metres away.
    pub fn log_all(&self, suspicion: f64, far: f64) -> RecordingStreamResult<()> {
        self.log_clouds()?;
        self.log_boxes()?;
        self.log_votes()?;
        self.log_images(far)?;
        self.log_series(suspicion)?;
        self.log_words()
    }

    pub fn log(&self, below: &str, entity: &dyn AsComponents) -> RecordingStreamResult<()> {
        self.recording.log(self.topic.join(&below.into()), entity)
    }

    /// Logs an entity in the cloud's coordinate frame.
    pub fn log_3d(&self, below: &str, entity: &dyn AsComponents) -> RecordingStreamResult<()> {
        let path = self.topic.join(&below.into());
        log_in_frame(self.recording, path, self.frame.key.frame_id, entity)
    }

    /// Logs the returns by class, component, instance, reason and truth, and the points of objects
    /// that were dropped.
    fn log_clouds(&self) -> RecordingStreamResult<()> {
        let ClusteredFrame { cloud, stages, .. } = *self.frame;
        let (labels, mask) = (&stages.labels, &stages.mask);
        let points = |points: &[usize]| {
            let positions = points.iter().map(|&point| cloud.position(point));
            archetypes::Points3D::update_fields().with_positions(positions)
        };
        let returns: Vec<usize> = (0..cloud.len()).filter(|&p| cloud.is_return(p)).collect();
        // The three share one column of positions.
        let cloud_of = points(&returns);
        let log = |below: &str, id: &dyn Fn(usize) -> u16| {
            let ids = returns.iter().map(|&point| id(point));
            self.log_3d(below, &cloud_of.clone().with_class_ids(ids))
        };
        log("cloud/class", &|p| match mask.class[p] {
            0 if mask.is_object[p] => 0,
            0 => reason_id(mask.reason[p]),
            class => class,
        })?;
        log("cloud/component", &|p| shown_id(labels.component[p], labels.reason[p]))?;
        log("cloud/instance", &|p| shown_id(labels.instance[p], labels.reason[p]))?;
        log("cloud/reason", &|p| reason_id(labels.reason[p]))?;
        if let Some(truth) = self.frame.truth {
            log("cloud/truth", &|p| truth_id(truth.id[p]))?;
        }
        for (below, reason) in
            [("dropped/unreached", Reason::Unreached), ("dropped/too_small", Reason::TooSmall)]
        {
            let is_dropped = |&point: &usize| labels.reason[point] == reason;
            let dropped: Vec<usize> = (0..cloud.len()).filter(is_dropped).collect();
            self.log_3d(below, &points(&dropped).with_class_ids([reason_id(reason)]))?;
        }
        Ok(())
    }

    /// Logs the boxes of objects, those of background in grey, and the names of the largest
    /// objects.
    fn log_boxes(&self) -> RecordingStreamResult<()> {
        let instances = &self.frame.stages.instances;
        let (objects, background): (Vec<&Instance>, Vec<&Instance>) =
            instances.iter().partition(|instance| instance.is_object());
        let colour = |instance: &Instance| instance_colour(instance.id);
        self.log_3d("boxes/objects", &titled_boxes(&objects, colour))?;
        self.log_3d("boxes/background", &titled_boxes(&background, |_| BACKGROUND_COLOUR))?;
        let mut largest = objects;
        largest.retain(|instance| probability(instance) >= LEAST_PROBABILITY);
        largest.sort_by(|a, b| weight(b).total_cmp(&weight(a)).then(a.id.cmp(&b.id)));
        largest.truncate(MOST_NAMES);
        let tops = largest.iter().map(|instance| {
            let ([x, y, z], height) = (instance.bounds.centre, instance.bounds.size[2]);
            [x, y, z + height / 2.0].map(|value| value as f32)
        });
        let names = archetypes::Points3D::new(tops)
            .with_colors(largest.iter().map(|instance| rgb(instance_colour(instance.id))))
            .with_radii([Radius::new_ui_points(1.0)])
            .with_labels(largest.iter().map(|instance| instance.title().trim_end().to_owned()))
            .with_show_labels(true);
        self.log_3d("boxes/names", &names)
    }

    /// Logs lines between the centroids of components with votes, labelled with the votes.
    fn log_votes(&self) -> RecordingStreamResult<()> {
        let ClusteredFrame { cloud, stages, .. } = *self.frame;
        let scene = FrameScene {
            cloud,
            stages,
            classes: &[],
            intensity: None,
            merge_ratio: 0.0,
            colour_numbers: Vec::new(),
            heading: String::new(),
            remark: String::new(),
            theme: Theme::Dark,
        };
        let mut edges = vote_edges(&scene);
        edges.sort_by_key(|edge| std::cmp::Reverse(edge.positive + edge.negative));
        edges.truncate(MOST_EDGES);
        let dark = &look::DARK;
        for (below, decision, colour, radius) in [
            ("votes/merged", Decision::Merged, dark.merged, 0.9),
            ("votes/rejoined", Decision::Rejoined, dark.rejoined, 0.5),
            ("votes/apart", Decision::Apart, dark.apart, 0.9),
        ] {
            let edges = || edges.iter().filter(|edge| edge.decision == decision);
            let strips = edges().map(|edge| edge.ends.map(|end| end.map(|value| value as f32)));
            let labels = edges().map(|edge| format!("{} : {}", edge.positive, edge.negative));
            let lines = lines(strips, colour, radius).with_labels(labels).with_show_labels(false);
            self.log_3d(below, &lines)?;
        }
        Ok(())
    }

    fn log_series(&self, suspicion: f64) -> RecordingStreamResult<()> {
        let stages = self.frame.stages;
        let t = &stages.times;
        let times = [t.projection_ms, t.mask_ms, t.divide_ms, t.merge_ms, t.labels_ms];
        self.log("series/milliseconds", &archetypes::Scalars::new(times))?;
        let instances = [stages.instances.len() as f64];
        self.log("series/instances", &archetypes::Scalars::new(instances))?;
        self.log("series/suspicion", &archetypes::Scalars::new([100.0 * suspicion]))
    }

    /// Logs the remarks on the cloud, and the reasons of points without an instance.
    fn log_words(&self) -> RecordingStreamResult<()> {
        let log =
            |level, text: &str| self.log("log", &archetypes::TextLog::new(text).with_level(level));
        for remark in self.frame.remarks {
            log(TextLogLevel::WARN, remark)?;
        }
        let counts = self.frame.stages.labels.counts();
        let (points, instances) = (self.frame.cloud.len(), self.frame.stages.instances.len());
        let words = format!("{} of {points} points in {instances} instances", counts[0]);
        log(TextLogLevel::INFO, &words)?;
        for (reason, count) in Reason::ALL.into_iter().zip(counts).skip(1) {
            let level = match reason {
                Reason::Unreached | Reason::TooSmall | Reason::Shadowed => TextLogLevel::WARN,
                _ => TextLogLevel::DEBUG,
            };
            if count > 0 {
                log(level, &format!("{}: {count} points", reason.describe()))?;
            }
        }
        Ok(())
    }
}

/// How much an object is worth a name: its points, and how sure it is that it is an object.
fn weight(instance: &Instance) -> f64 {
    f64::from(instance.points) * probability(instance)
}

/// How sure it is that an instance is what it seems to be; it is, where there are classes.
fn probability(instance: &Instance) -> f64 {
    instance.coarse_class.map_or(1.0, |found| found.probability)
}

/// Logs an entity in a coordinate frame, if it has a name.
pub fn log_in_frame(
    recording: &RecordingStream,
    path: EntityPath,
    frame_id: &str,
    entity: &dyn AsComponents,
) -> RecordingStreamResult<()> {
    let mut batches = entity.as_serialized_batches();
    if !frame_id.is_empty() {
        let frame = archetypes::CoordinateFrame::new(frame_id);
        batches.extend(frame.as_serialized_batches());
    }
    recording.log_serialized_batches(path, false, batches)
}

/// Boxes of instances; their names show under the pointer.
pub fn titled_boxes(
    instances: &[&Instance],
    colour: impl Fn(&Instance) -> [u8; 3],
) -> archetypes::Boxes3D {
    let bounds: Vec<&UprightBox> = instances.iter().map(|instance| &instance.bounds).collect();
    boxes(&bounds)
        .with_colors(instances.iter().map(|instance| rgb(colour(instance))))
        .with_labels(instances.iter().map(|instance| instance.title().trim_end().to_owned()))
}

/// The edges of boxes, without the labels that they may be given.
pub fn boxes(bounds: &[&UprightBox]) -> archetypes::Boxes3D {
    let each = |value: fn(&UprightBox) -> [f64; 3]| {
        bounds.iter().map(move |bounds| value(bounds).map(|v| v as f32))
    };
    let half_sizes = each(|bounds| bounds.size.map(|side| side / 2.0));
    let rotations = bounds.iter().map(|bounds| {
        let (sin, cos) = ((bounds.yaw / 2.0) as f32).sin_cos();
        Quaternion::from_xyzw([0.0, 0.0, sin, cos])
    });
    archetypes::Boxes3D::from_centers_and_half_sizes(each(|bounds| bounds.centre), half_sizes)
        .with_quaternions(rotations)
        .with_fill_mode(FillMode::MajorWireframe)
        .with_radii([Radius::new_ui_points(0.9)])
        .with_show_labels(false)
}

/// Lines of one colour.
pub fn lines<L: Into<LineStrip3D>>(
    strips: impl IntoIterator<Item = L>,
    colour: [u8; 3],
    radius: f32,
) -> archetypes::LineStrips3D {
    archetypes::LineStrips3D::new(strips)
        .with_colors([rgb(colour)])
        .with_radii([Radius::new_ui_points(radius)])
}
