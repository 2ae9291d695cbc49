//! What the Rerun viewer (<https://rerun.io>, 0.36) is shown of a run. The only file that knows of Rerun.
//!
//! Entities of a cloud topic T, logged anew for each cloud:
//!
//! | entity | what |
//! | --- | --- |
//! | `T/cloud/class`, `.../component`, `.../instance` | the returns, coloured by what each is |
//! | `T/boxes` | the instances' boxes, labelled with id and class |
//! | `T/votes/merged`, `.../apart` | lines between the centroids of components that voted on each other |
//! | `T/dropped/unreached`, `.../too_small` | points of objects that ended without an instance |
//! | `T/image/range`, `.../component`, `.../instance` | the range image, highest beam on top |
//! | `T/series/milliseconds`, `.../instances`, `.../suspicion` | time per stage, number of instances, how suspect the cloud's decisions are ([`triage`]) |
//! | `T/log` | what was dropped and why |
//! | `T/explanation/points` | the points A and B of an explanation (`divmerge explain --rerun`) |
//! | `T/explanation/votes/for`, `.../against` | lines between the pixels of each pair that voted |
//! | `T/explanation/text` | the answer in words |
//!
//! Timelines: `frame` (number of the cloud on its topic), `stamp` (of the cloud's header) and
//! `message_log_time` (as Rerun's own MCAP reader calls it). All that is in 3-D carries the cloud's
//! coordinate frame.
//!
//! Colours go through class ids and an annotation context, two bytes a point instead of four. Ids above
//! 65528 stand for reasons ([`Reason`]); component and instance numbers above that start again at 1 in
//! the clouds and images, not in the labels. A `.rrd` holds random ids and is never twice the same.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rerun::external::arrow::array::{ArrayRef, FixedSizeListArray, Float32Array, UInt16Array};
use rerun::external::arrow::datatypes::{DataType, Field};
use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::external::re_sdk_types::blueprint::datatypes::{TextLogColumn, TextLogColumnKind};
use rerun::external::re_sdk_types::blueprint::{archetypes as layout, components as kinds};
use rerun::external::re_uri::RedapUri;
use rerun::log::LogMsg;
use rerun::sink::{GrpcSink, GrpcSinkConnectionState, LogSink, SinkFlushError};
use rerun::{
    AnnotationInfo, AsComponents, EntityPath, EntityPathPart, RecordingStream,
    RecordingStreamBuilder, RecordingStreamResult, SerializedComponentBatch, archetypes as show,
    components as parts,
};

use super::Target;
use crate::annotate::{Frame, Method};
use crate::error::{Error, Result};
use crate::explain::Explanation;
use crate::instances::Reason;
use crate::io::PartialFile;
use crate::palette::{instance_colour, reason_colour};
use crate::pipeline::Stages;
use crate::triage;
use crate::triage::recording::triage_frame;

const APPLICATION: &str = "divmerge";
/// A viewer that is running answers within this time.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
/// A viewer that is started needs longer.
const SPAWN_TIMEOUT: Duration = Duration::from_secs(20);
/// A viewer that takes longer over one frame is gone.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(60);

/// Class ids from here on, plus a reason's number, stand for points without an instance.
const REASONS: u16 = 65_528;
/// Ids with a colour and a name of their own; the viewer makes up those of the others.
const NAMED_IDS: u16 = 4096;
/// Steps of the range image per metre.
const RANGE_STEPS: f32 = 200.0;
/// Range at which the colours of the range image end, in metres.
const RANGE_SHOWN: f64 = 60.0;
const MERGED: [u8; 3] = [96, 220, 120];
const APART: [u8; 3] = [150, 52, 58];
/// Points that are explained.
const MARKED: [u8; 3] = [255, 214, 64];
const STAGES: [(&str, [u8; 3]); 5] = [
    ("projection", [116, 184, 255]),
    ("mask", [255, 210, 90]),
    ("divide", [255, 122, 122]),
    ("merge", [130, 224, 140]),
    ("labels", [206, 150, 255]),
];

/// A stream of clustered clouds to a viewer, or into a file for one.
pub struct RerunStream {
    recording: RecordingStream,
    target: String,
    file: Option<RrdFile>,
    classes: Vec<(String, bool)>,
    method: Method,
    /// Topics seen so far, with the coordinate frame of their first cloud.
    topics: BTreeMap<String, String>,
}

impl RerunStream {
    /// Opens a stream named `title` of what a method does. A file appears under its name when the stream is finished.
    ///
    /// # Errors
    /// [`Error::Viewer`] if no viewer answers, [`Error::Io`] if the file cannot be made.
    pub fn open(target: &Target, title: &str, method: &Method) -> Result<Self> {
        let broken = |error: &dyn Display| Error::Viewer {
            target: target.to_string(),
            problem: error.to_string(),
        };
        let builder = RecordingStreamBuilder::new(APPLICATION).recording_name(title).enabled(true);
        let recording = builder.buffered().map_err(|error| broken(&error))?;
        recording.set_log_time_enabled(false);
        recording.set_log_tick_enabled(false);
        let mut file = None;
        match target {
            Target::Save { path, force } => {
                let rrd = RrdFile::create(path, *force)?;
                recording.set_sink(Box::new(RrdSink(Arc::clone(&rrd.writing))));
                file = Some(rrd);
            }
            Target::Connect(url) => {
                let sink = connect(url, CONNECT_TIMEOUT).map_err(|problem| broken(&problem))?;
                recording.set_sink(Box::new(sink));
            }
            Target::Spawn => recording.set_sink(Box::new(spawn().map_err(|p| broken(&p))?)),
        }
        let classes = method.taxonomy.classes().iter();
        let classes = classes.map(|class| (class.name.clone(), class.is_thing)).collect();
        let target = target.to_string();
        let (method, topics) = (method.clone(), BTreeMap::new());
        Ok(RerunStream { recording, target, file, classes, method, topics })
    }

    /// Shows one cloud, and returns when it is on its way: nothing piles up.
    ///
    /// # Errors
    /// [`Error::Viewer`] if the viewer is gone or the file cannot be written.
    pub fn log(&mut self, frame: &Frame) -> Result<()> {
        let logged = self.log_frame(frame);
        logged.map_err(|error| self.broken(error))?;
        let flushed = self.recording.flush_with_timeout(FLUSH_TIMEOUT);
        flushed.map_err(|error| self.broken(error))
    }

    /// Shows an explanation, with its answer in words, over the cloud that was shown last.
    ///
    /// # Errors
    /// [`Error::Viewer`] if the viewer is gone or the file cannot be written.
    pub fn explain(&mut self, frame: &Frame, found: &Explanation, answer: &str) -> Result<()> {
        let topic = topic_path(frame.topic);
        let scene = Scene { recording: &self.recording, topic, frame };
        let logged = scene.log_explanation(found, answer);
        logged.map_err(|error| self.broken(error))?;
        let flushed = self.recording.flush_with_timeout(FLUSH_TIMEOUT);
        flushed.map_err(|error| self.broken(error))
    }

    /// Shows a warning that belongs to no cloud.
    ///
    /// # Errors
    /// [`Error::Viewer`].
    pub fn warn(&mut self, warning: &str) -> Result<()> {
        let text = show::TextLog::new(warning).with_level(parts::TextLogLevel::WARN);
        self.recording.log("log", &text).map_err(|error| self.broken(error))
    }

    /// Ends the stream; a file gets its name.
    ///
    /// # Errors
    /// [`Error::Viewer`] if the viewer is gone, [`Error::Io`] if the file cannot be written or its name
    /// is taken by now.
    pub fn finish(self) -> Result<()> {
        let flushed = self.recording.flush_with_timeout(FLUSH_TIMEOUT);
        flushed.map_err(|error| self.broken(error))?;
        let RerunStream { recording, target, file, .. } = self;
        // Everything that is still on its way arrives before the drop returns.
        drop(recording);
        file.map_or(Ok(()), |file| file.finish(&target))
    }

    fn broken(&self, error: impl Display) -> Error {
        Error::Viewer { target: self.target.clone(), problem: error.to_string() }
    }

    fn log_frame(&mut self, frame: &Frame) -> RecordingStreamResult<()> {
        let recording = self.recording.clone();
        let topic = topic_path(frame.topic);
        if !self.topics.contains_key(frame.topic) {
            self.topics.insert(frame.topic.to_owned(), frame.frame_id.to_owned());
            self.log_static(&topic)?;
            send_blueprint(&recording, &self.topics)?;
        }
        recording.set_time_sequence("frame", frame.number as i64);
        recording.set_timestamp_nanos_since_epoch("stamp", frame.stamp_ns);
        recording.set_timestamp_nanos_since_epoch("message_log_time", frame.log_time_ns as i64);
        let scene = Scene { recording: &recording, topic, frame };
        scene.log_clouds()?;
        scene.log_boxes()?;
        scene.log_votes()?;
        scene.log_images()?;
        scene.log_series(self.suspicion(frame))?;
        scene.log_words()
    }

    /// How suspect the decisions on a cloud are, in percent.
    fn suspicion(&self, frame: &Frame) -> f64 {
        triage_frame(frame, &self.method, &triage::Params::default()).score * 100.0
    }

    /// What holds for all clouds of a topic: colours, names, sizes of points.
    fn log_static(&self, topic: &EntityPath) -> RecordingStreamResult<()> {
        let log = |path: &str, what: &dyn AsComponents| {
            self.recording.log_static(topic.join(&path.into()), what)
        };
        self.recording.log_static(topic.clone(), &show::AnnotationContext::new(ids()))?;
        log("cloud/class", &show::AnnotationContext::new(class_ids(&self.classes)))?;
        for (cloud, radius) in [
            ("cloud/class", 1.2),
            ("cloud/component", 1.2),
            ("cloud/instance", 1.2),
            ("dropped/unreached", 1.8),
            ("dropped/too_small", 1.8),
        ] {
            let points = show::Points3D::update_fields()
                .with_radii([parts::Radius::new_ui_points(radius)])
                .with_point_shading(parts::PointShading::Flat);
            log(cloud, &points)?;
        }
        let milliseconds = show::SeriesLines::new()
            .with_names(STAGES.map(|(name, _)| name))
            .with_colors(STAGES.map(|(_, colour)| colour));
        log("series/milliseconds", &milliseconds)?;
        let instances =
            show::SeriesLines::new().with_names(["instances"]).with_colors([STAGES[1].1]);
        log("series/instances", &instances)?;
        let suspicion =
            show::SeriesLines::new().with_names(["suspicion, %"]).with_colors([STAGES[0].1]);
        log("series/suspicion", &suspicion)
    }
}

/// `/lidar/points` as an entity; whatever stands between the slashes is one part.
fn topic_path(topic: &str) -> EntityPath {
    let named = topic.split('/').filter(|part| !part.is_empty()).map(EntityPathPart::new);
    match named.collect::<Vec<_>>() {
        none if none.is_empty() => EntityPath::from("cloud"),
        named => EntityPath::new(named),
    }
}

fn rgb([red, green, blue]: [u8; 3]) -> rerun::Rgba32 {
    parts::Color::from_rgb(red, green, blue).0
}

/// Names and colours of components, instances and reasons.
fn ids() -> Vec<AnnotationInfo> {
    let named = |id: u16| (id, id.to_string(), rgb(instance_colour(u32::from(id))));
    let infos = (1..=NAMED_IDS).map(named).chain(reasons());
    infos.map(|(id, name, colour)| info(id, &name, colour)).collect()
}

fn info(id: u16, name: &str, colour: rerun::Rgba32) -> AnnotationInfo {
    AnnotationInfo::from((id, name, colour))
}

fn reasons() -> impl Iterator<Item = (u16, String, rerun::Rgba32)> {
    let empty = (0, String::new(), rgb([0; 3]));
    let named = Reason::ALL.into_iter().skip(1).map(|reason| {
        (reason_id(reason), reason.describe().to_owned(), rgb(reason_colour(reason as u8)))
    });
    std::iter::once(empty).chain(named)
}

/// Names and colours of classes: things bright, the rest dull.
fn class_ids(classes: &[(String, bool)]) -> Vec<AnnotationInfo> {
    let colour = |class: u16, is_thing: bool| {
        let bright = instance_colour(u32::from(class));
        rgb(if is_thing { bright } else { bright.map(|value| 40 + (value - value / 3) / 2) })
    };
    let each = (0_u16..).zip(classes);
    let mut infos: Vec<AnnotationInfo> =
        each.map(|(class, (name, thing))| info(class, name, colour(class, *thing))).collect();
    if let Some(none) = infos.first_mut() {
        none.color = Some(rgb(reason_colour(0)));
    }
    infos.extend(reasons().skip(1).map(|(id, name, colour)| info(id, &name, colour)));
    infos
}

fn reason_id(reason: Reason) -> u16 {
    REASONS + reason as u16
}

/// The id by which a component or an instance is shown; `reason` where there is none.
fn shown_id(number: u32, reason: Reason) -> u16 {
    match number {
        0 if reason == Reason::None => 0,
        0 => reason_id(reason),
        number => ((number - 1) % u32::from(REASONS)) as u16 + 1,
    }
}

/// One cloud on its way to the viewer.
struct Scene<'a> {
    recording: &'a RecordingStream,
    topic: EntityPath,
    frame: &'a Frame<'a>,
}

impl Scene<'_> {
    fn path(&self, below: &str) -> EntityPath {
        self.topic.join(&below.into())
    }

    /// Logs something that is in 3-D, in the cloud's coordinate frame.
    fn log_3d(
        &self,
        below: &str,
        mut batches: Vec<SerializedComponentBatch>,
    ) -> RecordingStreamResult<()> {
        if !self.frame.frame_id.is_empty() {
            let frame = show::CoordinateFrame::new(self.frame.frame_id);
            batches.extend(frame.as_serialized_batches());
        }
        self.recording.log_serialized_batches(self.path(below), false, batches)
    }

    /// The returns by class, component and instance. The three share one column of positions.
    fn log_clouds(&self) -> RecordingStreamResult<()> {
        let Frame { cloud, stages, .. } = *self.frame;
        let (labels, mask) = (&stages.labels, &stages.mask);
        let returns = select(cloud.len(), |point| cloud.is_return(point));
        let positions = self.positions(&returns);
        let log = |below: &str, id: &dyn Fn(usize) -> u16| {
            let ids: Vec<u16> = returns.iter().map(|&point| id(point as usize)).collect();
            let ids: ArrayRef = Arc::new(UInt16Array::from(ids));
            let ids = SerializedComponentBatch::new(ids, show::Points3D::descriptor_class_ids());
            self.log_3d(below, vec![positions.clone(), ids])
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
            let dropped = select(cloud.len(), |point| labels.reason[point] == reason);
            let id = UInt16Array::from(vec![reason_id(reason)]);
            let id =
                SerializedComponentBatch::new(Arc::new(id), show::Points3D::descriptor_class_ids());
            self.log_3d(below, vec![self.positions(&dropped), id])?;
        }
        Ok(())
    }

    fn positions(&self, points: &[u32]) -> SerializedComponentBatch {
        let cloud = self.frame.cloud;
        let mut values = Vec::with_capacity(3 * points.len());
        for &point in points {
            values.extend(cloud.position(point as usize));
        }
        let item = Arc::new(Field::new("item", DataType::Float32, false));
        let values = Arc::new(Float32Array::from(values));
        let positions = FixedSizeListArray::new(item, 3, values, None);
        let descriptor = show::Points3D::descriptor_positions();
        SerializedComponentBatch::new(Arc::new(positions), descriptor)
    }

    fn log_boxes(&self) -> RecordingStreamResult<()> {
        let instances = &self.frame.stages.instances;
        let each = |place: fn(&crate::instances::UprightBox) -> [f64; 3]| {
            instances.iter().map(move |i| place(&i.bounds).map(|value| value as f32))
        };
        let centres = each(|bounds| bounds.centre);
        let half_sizes = each(|bounds| bounds.size.map(|side| side / 2.0));
        let turned = instances.iter().map(|instance| {
            let (sin, cos) = ((instance.bounds.yaw / 2.0) as f32).sin_cos();
            rerun::Quaternion::from_xyzw([0.0, 0.0, sin, cos])
        });
        let label = |i: &crate::instances::Instance| i.title();
        let boxes = show::Boxes3D::from_centers_and_half_sizes(centres, half_sizes)
            .with_quaternions(turned)
            .with_colors(instances.iter().map(|instance| rgb(instance_colour(instance.id))))
            .with_radii([parts::Radius::new_ui_points(0.8)])
            .with_labels(instances.iter().map(|instance| label(instance).trim_end().to_owned()));
        self.log_3d("boxes", boxes.as_serialized_batches())
    }

    /// A line between the centroids of every two components that voted, with their votes for and against.
    fn log_votes(&self) -> RecordingStreamResult<()> {
        let stages = self.frame.stages;
        let centroid = centroids(stages);
        let instance = instances_of_components(stages);
        for (below, colour, radius, merged) in
            [("votes/merged", MERGED, 0.9, true), ("votes/apart", APART, 0.4, false)]
        {
            let pairs = stages.votes.pairs.iter();
            let lines: Vec<_> = pairs
                .filter(|vote| (instance[vote.a as usize] == instance[vote.b as usize]) == merged)
                .filter_map(|vote| {
                    Some((vote, [centroid[vote.a as usize]?, centroid[vote.b as usize]?]))
                })
                .collect();
            let strips = lines.iter().map(|&(_, line)| line);
            let labels =
                lines.iter().map(|(vote, _)| format!("{} : {}", vote.positive, vote.negative));
            let lines = show::LineStrips3D::new(strips)
                .with_colors([rgb(colour)])
                .with_radii([parts::Radius::new_ui_points(radius)])
                .with_labels(labels)
                .with_show_labels(false);
            self.log_3d(below, lines.as_serialized_batches())?;
        }
        Ok(())
    }

    /// The points of an explanation, the pairs of pixels that voted, and the answer in words.
    fn log_explanation(&self, found: &Explanation, answer: &str) -> RecordingStreamResult<()> {
        let points = show::Points3D::new(found.points.iter().map(|point| point.position))
            .with_colors([rgb(MARKED)])
            .with_radii([parts::Radius::new_ui_points(6.0)])
            .with_labels(["A", "B"].into_iter().take(found.points.len()))
            .with_show_labels(true);
        self.log_3d("explanation/points", points.as_serialized_batches())?;
        let pairs = found.pairs();
        for (below, colour, holds) in
            [("explanation/votes/for", MERGED, true), ("explanation/votes/against", APART, false)]
        {
            let voted = pairs.iter().filter(|pair| pair.holds == holds);
            let strips = voted.map(|pair| [pair.a.position, pair.b.position]);
            let lines = show::LineStrips3D::new(strips)
                .with_colors([rgb(colour)])
                .with_radii([parts::Radius::new_ui_points(1.5)]);
            self.log_3d(below, lines.as_serialized_batches())?;
        }
        self.recording.log(self.path("explanation/text"), &show::TextDocument::new(answer))
    }

    fn log_images(&self) -> RecordingStreamResult<()> {
        let Frame { cloud, stages, .. } = *self.frame;
        let (image, labels) = (&stages.image, &stages.labels);
        let size = [image.columns() as u32, image.rows() as u32];
        let range = self.image(|point| {
            let steps = cloud.squared_range(point).sqrt() as f32 * RANGE_STEPS;
            steps.round().min(f32::from(u16::MAX)) as u16
        });
        let range = show::DepthImage::from_gray16(range, size)
            .with_meter(RANGE_STEPS)
            .with_colormap(parts::Colormap::Turbo)
            .with_depth_range(parts::ValueRange::new(0.0, RANGE_SHOWN * f64::from(RANGE_STEPS)));
        self.recording.log(self.path("image/range"), &range)?;
        let format = parts::ImageFormat::segmentation(size, rerun::ChannelDatatype::U16);
        for (below, ids) in
            [("image/component", &labels.component), ("image/instance", &labels.instance)]
        {
            let ids = self.image(|point| shown_id(ids[point], labels.reason[point]));
            self.recording.log(self.path(below), &show::SegmentationImage::new(ids, format))?;
        }
        Ok(())
    }

    /// Little-endian bytes of a value per pixel, highest beam first; 0 where no point is.
    fn image(&self, value: impl Fn(usize) -> u16) -> Vec<u8> {
        let image = &self.frame.stages.image;
        let rows = image.rows();
        let mut bytes = Vec::with_capacity(2 * rows * image.columns());
        for row in 0..rows {
            let row = if image.top_row_first { row } else { rows - 1 - row };
            for &point in image.point_of_pixel.row(row) {
                let value =
                    if point == crate::range_image::NOWHERE { 0 } else { value(point as usize) };
                bytes.extend(value.to_le_bytes());
            }
        }
        bytes
    }

    fn log_series(&self, suspicion: f64) -> RecordingStreamResult<()> {
        let stages = self.frame.stages;
        let t = &stages.times;
        let times = [t.projection_ms, t.mask_ms, t.divide_ms, t.merge_ms, t.labels_ms];
        self.recording.log(self.path("series/milliseconds"), &show::Scalars::new(times))?;
        let instances = show::Scalars::new([stages.instances.len() as f64]);
        self.recording.log(self.path("series/instances"), &instances)?;
        self.recording.log(self.path("series/suspicion"), &show::Scalars::new([suspicion]))
    }

    fn log_words(&self) -> RecordingStreamResult<()> {
        let log = |level: &str, text: &str| {
            self.recording.log(self.path("log"), &show::TextLog::new(text).with_level(level))
        };
        for remark in self.frame.remarks {
            log(parts::TextLogLevel::WARN, remark)?;
        }
        let counts = self.frame.stages.labels.counts();
        let points = self.frame.cloud.len();
        let (with, instances) = (counts[0], self.frame.stages.instances.len());
        log(
            parts::TextLogLevel::INFO,
            &format!("{with} of {points} points in {instances} instances"),
        )?;
        for (reason, count) in Reason::ALL.into_iter().zip(counts).skip(1) {
            let level = match reason {
                Reason::Unreached | Reason::TooSmall | Reason::Shadowed => {
                    parts::TextLogLevel::WARN
                }
                _ => parts::TextLogLevel::DEBUG,
            };
            if count > 0 {
                log(level, &format!("{}: {count} points", reason.describe()))?;
            }
        }
        Ok(())
    }
}

fn select(points: usize, is_shown: impl Fn(usize) -> bool) -> Vec<u32> {
    (0..points).filter(|&point| is_shown(point)).map(|point| point as u32).collect()
}

/// Centroid of the pixels of each component in metres; component k at k. None where other components took
/// all of its pixels.
fn centroids(stages: &Stages) -> Vec<Option<[f32; 3]>> {
    let mut sums = vec![([0.0_f64; 3], 0.0_f64); stages.components.count as usize + 1];
    for (&label, position) in stages.components.label.iter().zip(&stages.objects.position) {
        let (sum, count) = &mut sums[label as usize];
        for (sum, &value) in sum.iter_mut().zip(position) {
            *sum += f64::from(value);
        }
        *count += 1.0;
    }
    let mean = |sum: &[f64; 3], count: f64| sum.map(|sum| (sum / count) as f32);
    sums.iter().map(|(sum, count)| (*count > 0.0).then(|| mean(sum, *count))).collect()
}

/// The final instance of each component, component k at k; for one that was dropped a number that only
/// those have that were merged with it.
fn instances_of_components(stages: &Stages) -> Vec<u32> {
    let merged = stages.merge.instance_of_component.iter();
    let mut instance: Vec<u32> = vec![0];
    instance.extend(merged.map(|merged| u32::MAX - merged));
    let labels = &stages.labels;
    for (&component, &of_point) in labels.component.iter().zip(&labels.instance) {
        if component != 0 {
            instance[component as usize] = of_point;
        }
    }
    instance
}

// Where it goes.

fn connect(url: &str, timeout: Duration) -> std::result::Result<GrpcSink, String> {
    let Ok(RedapUri::Proxy(uri)) = url.parse::<RedapUri>() else {
        return Err("not the address of a viewer, as in rerun+http://127.0.0.1:9876/proxy".into());
    };
    let sink = GrpcSink::new(uri);
    let started = Instant::now();
    let problem = loop {
        match sink.status() {
            GrpcSinkConnectionState::Connected => return Ok(sink),
            GrpcSinkConnectionState::Disconnected(Err(error)) => break error.to_string(),
            GrpcSinkConnectionState::Disconnected(Ok(())) => break "disconnected".into(),
            GrpcSinkConnectionState::Connecting { .. } if started.elapsed() > timeout => {
                break format!(
                    "no viewer answered within {} s; is one running?",
                    timeout.as_secs()
                );
            }
            GrpcSinkConnectionState::Connecting { .. } => {
                std::thread::sleep(Duration::from_millis(10));
            }
        }
    };
    // Dropping it would wait for the address once more.
    std::thread::spawn(move || drop(sink));
    Err(problem)
}

fn spawn() -> std::result::Result<GrpcSink, String> {
    let options = rerun::SpawnOptions::default();
    let viewer = rerun::spawn(&options).map_err(|error| match error {
        rerun::SpawnError::ExecutableNotFoundInPath { executable_name, .. } => format!(
            "no program `{executable_name}` in PATH; `pip install rerun-sdk==0.36.3` brings one, or \
             use --save"
        ),
        error => error.to_string(),
    })?;
    connect(&format!("rerun+http://127.0.0.1:{}/proxy", viewer.port), SPAWN_TIMEOUT)
}

/// A `.rrd` that is being written under a temporary name.
struct RrdFile {
    writing: Arc<Mutex<Writing>>,
    partial: PartialFile,
}

/// The encoder; or why there is none any more.
struct Writing(std::result::Result<Encoder<BufWriter<File>>, String>);

struct RrdSink(Arc<Mutex<Writing>>);

fn lock(writing: &Mutex<Writing>) -> MutexGuard<'_, Writing> {
    writing.lock().unwrap_or_else(PoisonError::into_inner)
}

impl LogSink for RrdSink {
    fn send(&self, message: LogMsg) {
        let Writing(encoder) = &mut *lock(&self.0);
        if let Err(error) = encoder.as_mut().map_or(Ok(0), |encoder| encoder.append(&message)) {
            *encoder = Err(error.to_string());
        }
    }

    fn flush_blocking(&self, _timeout: Duration) -> std::result::Result<(), SinkFlushError> {
        match &lock(&self.0).0 {
            Ok(_) => Ok(()),
            Err(problem) => Err(SinkFlushError::failed(problem.clone())),
        }
    }
}

impl RrdFile {
    fn create(path: &Path, force: bool) -> Result<Self> {
        let (file, partial) = PartialFile::create(path, force)?;
        let file = BufWriter::with_capacity(1 << 20, file);
        let options = EncodingOptions::PROTOBUF_COMPRESSED;
        let encoder = Encoder::new_eager(CrateVersion::LOCAL, options, file);
        let writing = Writing(encoder.map_err(|error| error.to_string()));
        Ok(RrdFile { writing: Arc::new(Mutex::new(writing)), partial })
    }

    fn finish(self, target: &str) -> Result<()> {
        let ended = "the stream had ended".to_owned();
        let encoder = std::mem::replace(&mut lock(&self.writing).0, Err(ended));
        let written = encoder.and_then(|mut encoder| {
            encoder.finish().map_err(|error| error.to_string())?;
            let mut file = encoder.into_inner().map_err(|error| error.to_string())?;
            file.flush().map_err(|error| error.to_string())
        });
        written.map_err(|problem| Error::Viewer { target: target.to_owned(), problem })?;
        self.partial.put()
    }
}

// How it opens. The SDK's own blueprint has no setter for the eye, the background or the grid.

/// A blueprint being logged: views and containers, each with a number of its own.
struct Layout {
    stream: RecordingStream,
    last: u64,
}

fn send_blueprint(
    recording: &RecordingStream,
    topics: &BTreeMap<String, String>,
) -> RecordingStreamResult<()> {
    let (stream, storage) = RecordingStreamBuilder::new(APPLICATION).blueprint().memory()?;
    stream.set_time_sequence("blueprint", 0);
    let mut layout = Layout { stream, last: 0 };
    let mut pages = Vec::new();
    for (topic, frame_id) in topics {
        pages.push(layout.page(topic, frame_id)?);
    }
    if pages.len() > 1 {
        layout.container(kinds::ContainerKind::Tabs, &pages, None)?;
    }
    // The last container holds all others.
    let root = layout.uuid();
    let viewport = layout::ViewportBlueprint::new()
        .with_root_container(rerun::datatypes::Uuid { bytes: root.to_be_bytes() })
        .with_auto_layout(false)
        .with_auto_views(false);
    let collapsed = layout::PanelBlueprint::new().with_state(kinds::PanelState::Collapsed);
    let time = layout::TimePanelBlueprint::new()
        .with_state(kinds::PanelState::Collapsed)
        .with_timeline("frame");
    layout.stream.log("viewport", &viewport)?;
    layout.stream.log("blueprint_panel", &collapsed)?;
    layout.stream.log("selection_panel", &collapsed)?;
    layout.stream.log("time_panel", &time)?;
    let messages = storage.take();
    if let Some(LogMsg::SetStoreInfo(info)) = messages.first() {
        let blueprint_id = info.info.store_id.clone();
        let activation = rerun::external::re_log_types::BlueprintActivationCommand {
            blueprint_id,
            make_active: true,
            make_default: true,
        };
        recording.send_blueprint(messages, activation);
    }
    Ok(())
}

impl Layout {
    /// A topic: instances, components or classes, and numbers side by side, the images below.
    fn page(&mut self, topic: &str, frame_id: &str) -> RecordingStreamResult<String> {
        use kinds::ContainerKind::{Horizontal, Tabs, Vertical};
        let path = topic_path(topic);
        let at = |below: &str| path.join(&below.into());
        let instances = self.view_3d(
            "Instances",
            &path,
            &["cloud/instance", "boxes", "dropped/**", "explanation/**"],
            frame_id,
        )?;
        let components = self.view_3d(
            "Components and votes",
            &path,
            &["cloud/component", "votes/**", "dropped/**", "explanation/**"],
            frame_id,
        )?;
        let classes = self.view_3d("Classes", &path, &["cloud/class"], frame_id)?;
        let others = self.container(Tabs, &[components, classes], None)?;
        let corner = layout::PlotLegend::new().with_corner(kinds::Corner2D::LeftTop);
        let legend: [(&str, &dyn AsComponents); 1] = [("PlotLegend", &corner)];
        let times = self.view(
            "TimeSeries",
            "Milliseconds per stage",
            &at("series/milliseconds"),
            &[],
            &legend,
        )?;
        let counts =
            self.view("TimeSeries", "Number of instances", &at("series/instances"), &[], &legend)?;
        let suspicion =
            self.view("TimeSeries", "Suspicion, %", &at("series/suspicion"), &[], &legend)?;
        let counts = self.container(Tabs, &[counts, suspicion], None)?;
        let columns =
            layout::TextLogColumns::new()
                .with_text_log_columns([TextLogColumnKind::LogLevel, TextLogColumnKind::Body].map(
                    |kind| kinds::TextLogColumn(TextLogColumn { visible: true.into(), kind }),
                ));
        let columns: [(&str, &dyn AsComponents); 1] = [("TextLogColumns", &columns)];
        let words = self.view("TextLog", "Dropped, and why", &at("log"), &["/log"], &columns)?;
        let numbers = self.container(Vertical, &[times, counts, words], Some(&[3.0, 2.0, 3.5]))?;
        let upper =
            self.container(Horizontal, &[instances, others, numbers], Some(&[4.0, 4.0, 2.8]))?;
        let mut rows = vec![upper];
        for (name, below) in [
            ("Range", "image/range"),
            ("Components", "image/component"),
            ("Instances", "image/instance"),
        ] {
            rows.push(self.view("2D", name, &at(below), &[], &[])?);
        }
        let page = self.container(Vertical, &rows, Some(&[13.0, 1.8, 1.8, 1.8]))?;
        let named = layout::ContainerBlueprint::update_fields().with_display_name(topic);
        self.stream.log(page.as_str(), &named)?;
        Ok(page)
    }

    /// A view of the scene from above and behind, without a grid.
    fn view_3d(
        &mut self,
        name: &str,
        topic: &EntityPath,
        below: &[&str],
        frame_id: &str,
    ) -> RecordingStreamResult<String> {
        let eye = layout::EyeControls3D::new()
            .with_position([-24.0, -10.0, 19.0])
            .with_look_target([3.0, 0.0, -2.0])
            .with_eye_up([0.0, 0.0, 1.0]);
        let background = layout::Background::new(kinds::BackgroundKind::SolidColor)
            .with_color(rgb([16, 18, 22]));
        let grid = layout::LineGrid3D::new().with_visible(false);
        let space = layout::SpatialInformation::new(frame_id);
        let mut properties: Vec<(&str, &dyn AsComponents)> =
            vec![("EyeControls3D", &eye), ("Background", &background), ("LineGrid3D", &grid)];
        if !frame_id.is_empty() {
            properties.push(("SpatialInformation", &space));
        }
        self.view("3D", name, topic, below, &properties)
    }

    /// Logs a view of what is `below` its origin, or of the origin itself; returns its path. What starts
    /// with a slash is taken as it stands.
    fn view(
        &mut self,
        class: &str,
        name: &str,
        origin: &EntityPath,
        below: &[&str],
        properties: &[(&str, &dyn AsComponents)],
    ) -> RecordingStreamResult<String> {
        let path = format!("view/{}", self.next_id());
        let mut contents: Vec<String> = below
            .iter()
            .map(|below| match below.starts_with('/') {
                true => (*below).to_owned(),
                false => format!("{origin}/{below}"),
            })
            .collect();
        if below.iter().all(|below| below.starts_with('/')) {
            contents.push(origin.to_string());
        }
        let view = layout::ViewBlueprint::new(class)
            .with_display_name(name)
            .with_space_origin(origin.to_string());
        self.stream.log(path.as_str(), &view)?;
        self.stream.log(format!("{path}/ViewContents"), &layout::ViewContents::new(contents))?;
        for (property, archetype) in properties {
            self.stream.log(format!("{path}/{property}"), *archetype)?;
        }
        Ok(path)
    }

    /// Logs a container and returns its path; shares are widths in a row, heights in a column.
    fn container(
        &mut self,
        kind: kinds::ContainerKind,
        contents: &[String],
        shares: Option<&[f32]>,
    ) -> RecordingStreamResult<String> {
        let path = format!("container/{}", self.next_id());
        let mut container = layout::ContainerBlueprint::new(kind)
            .with_contents(contents.iter().map(String::as_str));
        if let Some(shares) = shares {
            let shares = shares.iter().copied();
            container = match kind {
                kinds::ContainerKind::Horizontal => container.with_col_shares(shares),
                _ => container.with_row_shares(shares),
            };
        }
        if let (kinds::ContainerKind::Tabs, Some(first)) = (kind, contents.first()) {
            container = container.with_active_tab(first.as_str());
        }
        self.stream.log(path.as_str(), &container)?;
        Ok(path)
    }

    /// The last number given, as a UUID.
    fn uuid(&self) -> u128 {
        const OURS: u128 = 0x6469_766d_6572_4765_8000 << 48;
        OURS | u128::from(self.last)
    }

    fn next_id(&mut self) -> String {
        self.last += 1;
        let hex = format!("{:032x}", self.uuid());
        let parts = [&hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..]];
        parts.join("-")
    }
}
