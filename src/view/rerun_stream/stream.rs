//! The stream of clustered clouds.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::time::Duration;

use rerun::components::{PointShading, Radius, TextLogLevel};
use rerun::{
    AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamResult,
    archetypes,
};

use super::blueprint::send_blueprint;
use super::frame::{FrameLogger, STAGES};
use super::names::{APPLICATION, class_ids, instance_ids, rgb, topic_path};
use super::sinks::{RrdFile, connect, spawn};
use crate::annotate::{AnnotateConfig, ClusteredFrame};
use crate::diagnose::explain::Explanation;
use crate::diagnose::triage;
use crate::diagnose::triage::recording::triage_frame;
use crate::error::{Error, Result};
use crate::view::target::Target;

/// A viewer that takes longer over one frame is gone.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(60);
/// Sizes of the points of each cloud, in units of the screen.
const RADII: [(&str, f32); 5] = [
    ("cloud/class", 1.2),
    ("cloud/component", 1.2),
    ("cloud/instance", 1.2),
    ("dropped/unreached", 1.8),
    ("dropped/too_small", 1.8),
];

/// A stream of clustered clouds to a viewer, or into a file for one.
pub struct RerunStream {
    recording: RecordingStream,
    target: String,
    file: Option<RrdFile>,
    method: AnnotateConfig,
    /// Topics so far, with the coordinate frame of their first cloud.
    topics: BTreeMap<String, String>,
}

impl RerunStream {
    /// Opens a stream with a title, of clouds that a method clusters. A file appears under its name
    /// when the stream is finished.
    ///
    /// # Errors
    /// [`Error::Viewer`] if no viewer answers, [`Error::Io`] if the file cannot be created.
    pub fn open(target: &Target, title: &str, method: &AnnotateConfig) -> Result<Self> {
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
        Ok(RerunStream { recording, target, file, method, topics: BTreeMap::new() })
    }

    /// Shows one cloud; returns when it is sent, so that nothing piles up.
    ///
    /// # Errors
    /// [`Error::Viewer`] if the viewer is gone or the file cannot be written.
    pub fn log(&mut self, frame: &ClusteredFrame) -> Result<()> {
        let logged = self.log_frame(frame);
        self.flush(logged)
    }

    /// Shows an explanation with its answer in words over the cloud that was shown last.
    ///
    /// # Errors
    /// [`Error::Viewer`] if the viewer is gone or the file cannot be written.
    pub fn explain(
        &mut self,
        frame: &ClusteredFrame,
        found: &Explanation,
        answer: &str,
    ) -> Result<()> {
        let topic = topic_path(frame.key.topic);
        let logger = FrameLogger { recording: &self.recording, topic, frame };
        self.flush(logger.log_explanation(found, answer))
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
            self.topics.insert(frame.key.topic.to_owned(), frame.key.frame_id.to_owned());
            self.log_static(&topic)?;
            send_blueprint(&self.recording, &self.topics)?;
        }
        let recording = &self.recording;
        recording.set_time_sequence("frame", frame.key.number as i64);
        recording.set_timestamp_nanos_since_epoch("stamp", frame.key.stamp_ns);
        recording.set_timestamp_nanos_since_epoch("message_log_time", frame.header.log_time as i64);
        let suspicion = triage_frame(frame, &self.method, &triage::TriageParams::default()).score;
        FrameLogger { recording, topic, frame }.log_all(suspicion)
    }

    /// Logs what holds for all clouds of a topic: colours, names, sizes of points.
    fn log_static(&self, topic: &EntityPath) -> RecordingStreamResult<()> {
        let log = |below: &str, entity: &dyn AsComponents| {
            self.recording.log_static(topic.join(&below.into()), entity)
        };
        let context = archetypes::AnnotationContext::new(instance_ids());
        self.recording.log_static(topic.clone(), &context)?;
        let classes = class_ids(&self.method.taxonomy);
        log("cloud/class", &archetypes::AnnotationContext::new(classes))?;
        for (cloud, radius) in RADII {
            let points = archetypes::Points3D::update_fields()
                .with_radii([Radius::new_ui_points(radius)])
                .with_point_shading(PointShading::Flat);
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
