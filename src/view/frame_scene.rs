//! Clustered and explained clouds, and their scenes.

use std::path::Path;

use super::colour_tracker::ColourTracker;
use super::look::Theme;
use super::scene::FrameScene;
use crate::annotate::{AnnotateConfig, Clustered, cluster};
use crate::diagnose::explain::{ClusteredCloud, ExplanationReport, Subject, explain};
use crate::error::Result;
use crate::frames::EncodedCloud;
use crate::messages::clouds::CloudMessage;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::pipeline::{Config, Stages};

/// A clustered cloud message and its intensities.
#[derive(Debug, Clone)]
pub struct ClusteredMessage<'a> {
    /// The message.
    pub message: &'a EncodedCloud,
    /// Its cloud, clustered.
    pub clustered: Clustered,
    intensity: Option<Vec<f32>>,
}

impl<'a> ClusteredMessage<'a> {
    /// Decodes and clusters a message.
    ///
    /// # Errors
    /// Those of [`cluster`], and of decoding the message.
    pub fn new(message: &'a EncodedCloud, method: &AnnotateConfig) -> Result<Self> {
        let wire = message.decode()?;
        let clustered = cluster(&wire, &message.key(&wire), method)?;
        Ok(ClusteredMessage { message, clustered, intensity: intensity(&wire) })
    }

    /// The scene of a figure. The recording starts at `start_ns`; `colours` keeps the colours of
    /// instances from frame to frame.
    pub fn scene<'s>(
        &'s self,
        method: &'s AnnotateConfig,
        start_ns: u64,
        colours: &mut ColourTracker,
    ) -> FrameScene<'s> {
        let Clustered { cloud, stages, semantics, taxonomy, .. } = &self.clustered;
        let seconds = self.message.log_time_ns().saturating_sub(start_ns) as f64 * 1e-9;
        FrameScene {
            cloud,
            stages,
            classes: taxonomy.as_ref().map_or(&[], Taxonomy::classes),
            intensity: self.intensity.as_deref(),
            merge_ratio: method.pipeline.cluster.merge_ratio,
            colour_numbers: colours.colour_numbers(&stages.instances),
            heading: format!("{}  ·  {seconds:.3} s", self.message.frames()),
            remark: format!(
                "{}  ·  {}",
                self.message.topic,
                describe_run(stages, semantics, &method.pipeline)
            ),
            theme: Theme::default(),
        }
    }
}

/// A run in the heading of a figure: its range image, where objects came from, and how they were
/// clustered.
pub fn describe_run(stages: &Stages, semantics: &str, config: &Config) -> String {
    let image = &stages.image;
    format!(
        "range image {} × {} ({})  ·  objects: {semantics}  ·  {}",
        image.rows(),
        image.columns(),
        image.projection.describe(),
        config.describe(),
    )
}

/// N: intensity of the points of a message, if it has a field for it.
pub fn intensity(wire: &CloudMessage) -> Option<Vec<f32>> {
    ["intensity", "reflectivity"].into_iter().find_map(|name| {
        let values = wire.column_f64(name).ok()?;
        Some(values.into_iter().map(|value| value as f32).collect())
    })
}

/// Explains one or two points of a cloud of `file`, without a search for parameter changes.
pub fn explanation_report(
    file: &Path,
    message: &EncodedCloud,
    semantics: &str,
    frame: &ClusteredCloud,
    subject: Subject,
) -> ExplanationReport {
    ExplanationReport {
        file: file.to_owned(),
        topic: message.topic.to_string(),
        frame: message.number,
        first_frame: Some(message.first_number()).filter(|&first| first < message.number),
        log_time_ns: message.log_time_ns(),
        preset: frame.config.preset,
        semantics: semantics.to_owned(),
        instances: frame.stages.instances.len(),
        away: Vec::new(),
        explanation: explain(frame, subject),
        votes_per_border_pair: 2,
        what_if: None,
    }
}

/// The scene of an explanation's figure.
pub fn explained_scene<'a>(
    frame: &ClusteredCloud<'a>,
    report: &ExplanationReport,
) -> FrameScene<'a> {
    FrameScene {
        cloud: frame.cloud,
        stages: frame.stages,
        classes: &[],
        intensity: None,
        merge_ratio: frame.config.cluster.merge_ratio,
        colour_numbers: Vec::new(),
        heading: format!("frame {} of {}", report.frame, report.topic),
        remark: format!("objects: {}  ·  preset {}", report.semantics, report.preset),
        theme: Theme::default(),
    }
}
