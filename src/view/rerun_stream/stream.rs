//! The stream of clustered clouds.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::time::Duration;

use rerun::components::{PointShading, Radius, TextLogLevel};
use rerun::{
    AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamResult,
    archetypes,
};

use super::blueprint::{TopicPage, send_blueprint};
use super::eye::Eye;
use super::frame::{FrameLogger, STAGES};
use super::names::{APPLICATION, class_ids, instance_ids, rgb, topic_path, truth_ids};
use super::sinks::{RrdFile, connect, spawn};
use super::trails::Trails;
use crate::annotate::{AnnotateConfig, ClusteredFrame, TrackedFrame};
use crate::diagnose::explain::Explanation;
use crate::diagnose::triage;
use crate::diagnose::triage::recording::triage_frame;
use crate::error::{Error, Result};
use crate::view::numbers::quantile;
use crate::view::target::Target;
use divmerge_core::cloud::taxonomy::Taxonomy;

/// A viewer that takes longer over one frame is gone.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(60);
/// Sizes of the points of each cloud, in units of the screen.
const RADII: [(&str, f32); 7] = [
    ("cloud/class", 1.2),
    ("cloud/component", 1.2),
    ("cloud/instance", 1.2),
    ("cloud/reason", 1.2),
    ("cloud/truth", 1.2),
    ("dropped/unreached", 1.8),
    ("dropped/too_small", 1.8),
];

type LogResult = RecordingStreamResult<()>;

/// A stream of clustered clouds to a viewer, or into a file for one.
pub struct RerunStream {
    recording: RecordingStream,
    target: String,
    file: Option<RrdFile>,
    method: AnnotateConfig,
    follows: bool,
    /// Topics so far, by their first cloud.
    topics: BTreeMap<String, TopicPage>,
    /// The taxonomy of each topic's classes so far.
    taxonomies: BTreeMap<String, Option<Taxonomy>>,
    trails: BTreeMap<String, Trails>,
}

impl RerunStream {
    /// Opens a stream with a title, of clouds that a method clusters; with `follows` their objects
    /// are followed over time. A file appears under its name when the stream is finished.
    ///
    /// # Errors
    /// [`Error::Viewer`] if no viewer answers, [`Error::Io`] if the file cannot be created.
    pub fn open(
        target: &Target,
        title: &str,
        (method, follows): (&AnnotateConfig, bool),
    ) -> Result<Self> {
        let failed = |problem: String| Error::Viewer { target: target.to_string(), problem };
        let builder = RecordingStreamBuilder::new(APPLICATION).recording_name(title).enabled(true);
        let recording = builder.buffered().map_err(|error| failed(error.to_string()))?;
        recording.set_log_time_enabled(false);
        recording.set_log_tick_enabled(false);
        let mut file = None;
        recording.set_sink(match target {
            Target::Save { path, force } => file.insert(RrdFile::create(path, *force)?).sink(),
            Target::Connect(url) => Box::new(connect(url).map_err(failed)?),
            Target::Spawn => Box::new(spawn().map_err(failed)?),
        });
        let (target, method) = (target.to_string(), method.clone());
        let (topics, taxonomies, trails) = Default::default();
        Ok(RerunStream { recording, target, file, method, follows, topics, taxonomies, trails })
    }

    /// Shows one cloud; returns when it is sent, so that nothing piles up.
    ///
    /// # Errors
    /// [`Error::Viewer`] if the viewer is gone or the file cannot be written.
    pub fn log(&mut self, frame: &ClusteredFrame) -> Result<()> {
        let logged = self.log_frame(frame);
        self.flush(logged)
    }

    /// Shows the tracks of a cloud that was shown before.
    ///
    /// # Errors
    /// [`Error::Viewer`] if the viewer is gone or the file cannot be written.
    pub fn tracks(&mut self, frame: &TrackedFrame) -> Result<()> {
        let trails = self.trails.entry(frame.topic.clone()).or_default();
        trails.push(frame);
        set_times(&self.recording, [frame.number, frame.log_time_ns], frame.stamp_ns);
        let logged = trails.log(&self.recording, &topic_path(&frame.topic), frame);
        self.flush(logged)
    }

    /// Shows an explanation in words over the cloud that was shown last, on a page of its own.
    ///
    /// # Errors
    /// [`Error::Viewer`] if the viewer is gone or the file cannot be written.
    pub fn explain(
        &mut self,
        frame: &ClusteredFrame,
        found: &Explanation,
        words: &str,
    ) -> Result<()> {
        let topic = topic_path(frame.key.topic);
        let logger = FrameLogger { recording: &self.recording, topic, frame };
        let logged = logger.log_explanation(found, words);
        self.flush(
            logged.and_then(|page| send_blueprint(&self.recording, &self.topics, Some(&page))),
        )
    }

    /// Shows a warning that belongs to no cloud.
    ///
    /// # Errors
    /// [`Error::Viewer`] if the viewer is gone or the file cannot be written.
    pub fn warn(&mut self, warning: &str) -> Result<()> {
        let text = archetypes::TextLog::new(warning).with_level(TextLogLevel::WARN);
        self.recording.log("log", &text).map_err(|error| self.failed(error))
    }

    /// Ends the stream; a file gets its name.
    ///
    /// # Errors
    /// [`Error::Viewer`] if the viewer is gone, [`Error::Io`] if the file cannot be written or its
    /// name is taken by now.
    pub fn finish(self) -> Result<()> {
        self.flush(Ok(()))?;
        let RerunStream { recording, target, file, .. } = self;
        // The drop returns when everything has arrived.
        drop(recording);
        file.map_or(Ok(()), |file| file.finish(&target))
    }

    /// Sends what was logged.
    fn flush(&self, logged: RecordingStreamResult<()>) -> Result<()> {
        logged.map_err(|error| self.failed(error))?;
        let flushed = self.recording.flush_with_timeout(FLUSH_TIMEOUT);
        flushed.map_err(|error| self.failed(error))
    }

    fn failed(&self, error: impl Display) -> Error {
        Error::Viewer { target: self.target.clone(), problem: error.to_string() }
    }

    fn log_frame(&mut self, frame: &ClusteredFrame) -> RecordingStreamResult<()> {
        let topic = topic_path(frame.key.topic);
        if !self.topics.contains_key(frame.key.topic) {
            self.topics.insert(frame.key.topic.to_owned(), self.page(frame));
            self.log_static(&topic)?;
            send_blueprint(&self.recording, &self.topics, None)?;
        }
        self.log_classes(&topic, frame)?;
        let recording = &self.recording;
        set_times(recording, [frame.key.number, frame.header.log_time], frame.key.stamp_ns);
        let suspicion = triage_frame(frame, &self.method, &triage::TriageParams::default()).score;
        let far = self.topics[frame.key.topic].far;
        FrameLogger { recording, topic, frame }.log_all(suspicion, far)
    }

    /// What there is to see of a topic, by its first cloud.
    fn page(&self, frame: &ClusteredFrame) -> TopicPage {
        TopicPage {
            frame_id: frame.key.frame_id.to_owned(),
            eye: Eye::of_cloud(frame.cloud),
            far: farthest(frame),
            has_classes: frame.taxonomy.is_some(),
            has_votes: frame.stages.post_merge.tree.is_none(),
            has_truth: frame.truth.is_some(),
            has_tracks: self.follows,
        }
    }

    /// Logs the names and colours of classes, where they are not those of the cloud before.
    fn log_classes(&mut self, topic: &EntityPath, frame: &ClusteredFrame) -> LogResult {
        let before = self.taxonomies.get(frame.key.topic).map(Option::as_ref);
        if before == Some(frame.taxonomy) {
            return Ok(());
        }
        let context = archetypes::AnnotationContext::new(class_ids(frame.taxonomy));
        self.recording.log_static(topic.join(&"cloud/class".into()), &context)?;
        self.taxonomies.insert(frame.key.topic.to_owned(), frame.taxonomy.cloned());
        Ok(())
    }

    /// Logs what holds for all clouds of a topic: colours, names, sizes of points.
    fn log_static(&self, topic: &EntityPath) -> RecordingStreamResult<()> {
        let log = |below: &str, entity: &dyn AsComponents| {
            self.recording.log_static(topic.join(&below.into()), entity)
        };
        let context = archetypes::AnnotationContext::new(instance_ids());
        self.recording.log_static(topic.clone(), &context)?;
        log("cloud/truth", &archetypes::AnnotationContext::new(truth_ids()))?;
        for (cloud, radius) in RADII {
            let points = archetypes::Points3D::update_fields()
                .with_radii([Radius::new_ui_points(radius)])
                .with_point_shading(PointShading::Flat)
                .with_show_labels(false);
            log(cloud, &points)?;
        }
        let series = |below: &str, lines: &[(&str, [u8; 3])]| {
            let names = lines.iter().map(|(name, _)| *name);
            let colours = lines.iter().map(|(_, colour)| rgb(*colour));
            let lines = archetypes::SeriesLines::new().with_names(names).with_colors(colours);
            log(below, &lines)
        };
        series("series/milliseconds", &STAGES)?;
        series("series/instances", &[("instances", STAGES[1].1)])?;
        series("series/suspicion", &[("suspicion, %", STAGES[0].1)])
    }
}

/// Sets the time on each timeline: of a cloud by its number, its log time and its stamp.
fn set_times(recording: &RecordingStream, [number, log_time_ns]: [u64; 2], stamp_ns: i64) {
    recording.set_time_sequence("frame", number as i64);
    recording.set_timestamp_nanos_since_epoch("stamp", stamp_ns);
    recording.set_timestamp_nanos_since_epoch("message_log_time", log_time_ns as i64);
}

/// Where the colours of ranges end, metres: as in figures, all but the farthest are shown.
fn farthest(frame: &ClusteredFrame) -> f64 {
    let cloud = frame.cloud;
    let returns = (0..cloud.len()).filter(|&point| cloud.is_return(point));
    let far = quantile(returns.map(|point| cloud.squared_range(point).sqrt()), 0.99);
    (far / 5.0).ceil().max(1.0) * 5.0
}
