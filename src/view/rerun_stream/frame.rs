//! One cloud on its way to the viewer.

use rerun::components::{Colormap, ImageFormat, LineStrip3D, Radius, TextLogLevel, ValueRange};
use rerun::{
    AsComponents, ChannelDatatype, EntityPath, Quaternion, RecordingStream, RecordingStreamResult,
    archetypes,
};

use super::names::{reason_id, rgb, shown_id};
use crate::annotate::ClusteredFrame;
use crate::diagnose::explain::Explanation;
use crate::messages::palette::instance_colour;
use crate::view::look;
use crate::view::scene::{component_centroids, instance_of_component, row_from_top};
use divmerge_core::cloud::{Reason, UprightBox};

/// Steps of the range image per metre.
const RANGE_STEPS: f32 = 200.0;
/// Range at which the colours of the range image end, metres.
const RANGE_SHOWN: f64 = 60.0;
const MERGED: [u8; 3] = [96, 220, 120];
const APART: [u8; 3] = [150, 52, 58];
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
    /// Logs everything about the cloud; `suspicion` in 0 to 1 is that of its decisions.
    pub fn log_all(&self, suspicion: f64) -> RecordingStreamResult<()> {
        self.log_clouds()?;
        self.log_boxes()?;
        self.log_votes()?;
        self.log_images()?;
        self.log_series(suspicion)?;
        self.log_words()
    }

    fn log(&self, below: &str, entity: &dyn AsComponents) -> RecordingStreamResult<()> {
        self.recording.log(self.topic.join(&below.into()), entity)
    }

    /// Logs an entity in the cloud's coordinate frame.
    fn log_3d(&self, below: &str, entity: &dyn AsComponents) -> RecordingStreamResult<()> {
        let mut batches = entity.as_serialized_batches();
        if !self.frame.key.frame_id.is_empty() {
            let frame = archetypes::CoordinateFrame::new(self.frame.key.frame_id);
            batches.extend(frame.as_serialized_batches());
        }
        self.recording.log_serialized_batches(self.topic.join(&below.into()), false, batches)
    }

    /// Logs the returns by class, component and instance, and the points of objects that were
    /// dropped.
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
            0 => shown_id(0, mask.reason[p]),
            class => class,
        })?;
        log("cloud/component", &|p| shown_id(labels.component[p], labels.reason[p]))?;
        log("cloud/instance", &|p| shown_id(labels.instance[p], labels.reason[p]))?;
        for (below, reason) in
            [("dropped/unreached", Reason::Unreached), ("dropped/too_small", Reason::TooSmall)]
        {
            let is_dropped = |&point: &usize| labels.reason[point] == reason;
            let dropped: Vec<usize> = (0..cloud.len()).filter(is_dropped).collect();
            self.log_3d(below, &points(&dropped).with_class_ids([reason_id(reason)]))?;
        }
        Ok(())
    }

    fn log_boxes(&self) -> RecordingStreamResult<()> {
        let instances = &self.frame.stages.instances;
        let each = |value: fn(&UprightBox) -> [f64; 3]| {
            instances.iter().map(move |instance| value(&instance.bounds).map(|v| v as f32))
        };
        let centres = each(|bounds| bounds.centre);
        let half_sizes = each(|bounds| bounds.size.map(|side| side / 2.0));
        let rotations = instances.iter().map(|instance| {
            let (sin, cos) = ((instance.bounds.yaw / 2.0) as f32).sin_cos();
            Quaternion::from_xyzw([0.0, 0.0, sin, cos])
        });
        let labels = instances.iter().map(|instance| instance.title().trim_end().to_owned());
        let boxes = archetypes::Boxes3D::from_centers_and_half_sizes(centres, half_sizes)
            .with_quaternions(rotations)
            .with_colors(instances.iter().map(|instance| rgb(instance_colour(instance.id))))
            .with_radii([Radius::new_ui_points(0.8)])
            .with_labels(labels);
        self.log_3d("boxes", &boxes)
    }

    /// Logs lines between the centroids of components with votes, labelled with the votes.
    fn log_votes(&self) -> RecordingStreamResult<()> {
        let stages = self.frame.stages;
        let centroids = component_centroids(stages);
        // Where an instance was dropped as too small, a number that only its components have.
        let merged = stages.merge.instance_of_component.iter();
        let last = instance_of_component(stages).into_iter().zip(merged);
        let last: Vec<u32> =
            last.map(|(last, merged)| if last == 0 { u32::MAX - merged } else { last }).collect();
        for (below, colour, radius, is_merged) in
            [("votes/merged", MERGED, 0.9, true), ("votes/apart", APART, 0.4, false)]
        {
            let (mut strips, mut labels) = (Vec::new(), Vec::new());
            for vote in &stages.votes.pairs {
                let [a, b] = [vote.a, vote.b].map(|label| label as usize - 1);
                let ends = [a, b].map(|component| centroids[component]);
                if (last[a] == last[b]) == is_merged && ends.iter().all(|(_, pixels)| *pixels > 0) {
                    strips.push(ends.map(|(centroid, _)| centroid.map(|value| value as f32)));
                    labels.push(format!("{} : {}", vote.positive, vote.negative));
                }
            }
            let lines = lines(strips, colour, radius).with_labels(labels).with_show_labels(false);
            self.log_3d(below, &lines)?;
        }
        Ok(())
    }

    /// Logs the points of an explanation, the pairs of pixels that voted, and the answer in words.
    pub fn log_explanation(&self, found: &Explanation, answer: &str) -> RecordingStreamResult<()> {
        let points = archetypes::Points3D::new(found.points.iter().map(|point| point.position))
            .with_colors([rgb(look::DARK.focus)])
            .with_radii([Radius::new_ui_points(6.0)])
            .with_labels(["A", "B"].into_iter().take(found.points.len()))
            .with_show_labels(true);
        self.log_3d("explanation/points", &points)?;
        let pairs = found.pairs();
        for (below, colour, holds) in
            [("explanation/votes/for", MERGED, true), ("explanation/votes/against", APART, false)]
        {
            let voted = pairs.iter().filter(|pair| pair.holds == holds);
            let strips = voted.map(|pair| [pair.a.position, pair.b.position]);
            self.log_3d(below, &lines(strips, colour, 1.5))?;
        }
        self.log("explanation/text", &archetypes::TextDocument::new(answer))
    }

    /// Logs the range image by range, component and instance.
    fn log_images(&self) -> RecordingStreamResult<()> {
        let ClusteredFrame { cloud, stages, .. } = *self.frame;
        let (image, labels) = (&stages.image, &stages.labels);
        let size = [image.columns() as u32, image.rows() as u32];
        let range = self.pixels(|point| {
            let steps = cloud.squared_range(point).sqrt() as f32 * RANGE_STEPS;
            steps.round().min(f32::from(u16::MAX)) as u16
        });
        let range = archetypes::DepthImage::from_gray16(range, size)
            .with_meter(RANGE_STEPS)
            .with_colormap(Colormap::Turbo)
            .with_depth_range(ValueRange::new(0.0, RANGE_SHOWN * f64::from(RANGE_STEPS)));
        self.log("image/range", &range)?;
        let format = ImageFormat::segmentation(size, ChannelDatatype::U16);
        for (below, ids) in
            [("image/component", &labels.component), ("image/instance", &labels.instance)]
        {
            let ids = self.pixels(|point| shown_id(ids[point], labels.reason[point]));
            self.log(below, &archetypes::SegmentationImage::new(ids, format))?;
        }
        Ok(())
    }

    /// Little-endian bytes of a value for each pixel, highest beam first; 0 without a point.
    fn pixels(&self, value: impl Fn(usize) -> u16) -> Vec<u8> {
        let image = &self.frame.stages.image;
        let (rows, columns) = (image.rows(), image.columns());
        let pixels = (0..rows).flat_map(|row| {
            let first = row_from_top(image, row) * columns;
            first..first + columns
        });
        pixels.flat_map(|pixel| image.point_at(pixel).map_or(0, &value).to_le_bytes()).collect()
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

fn lines<L: Into<LineStrip3D>>(
    strips: impl IntoIterator<Item = L>,
    colour: [u8; 3],
    radius: f32,
) -> archetypes::LineStrips3D {
    archetypes::LineStrips3D::new(strips)
        .with_colors([rgb(colour)])
        .with_radii([Radius::new_ui_points(radius)])
}
