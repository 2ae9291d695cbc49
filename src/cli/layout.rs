//! The layouts for viewers beside an annotated recording, and how to look at it.

use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::annotate::{AnnotationReport, Form, TopicReport};
use crate::cli::exit::RefusedOutput;
use crate::cli::output::{OutputFile, Outputs};
use crate::cli::viewer;
use crate::frames::{INSTANCES, OBJECTS};
use crate::messages::clouds::CloudFormat;
use crate::recording::STANDARD_STREAM;
use crate::text::path_word;
use crate::view::{ShownTopic, viewer_layout};

/// Which layouts are written beside a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WantedLayouts {
    /// One for Lichtblick and Foxglove.
    pub json: bool,
    /// One for Rerun.
    pub rerun: bool,
}

impl WantedLayouts {
    /// The layouts beside an output, by their paths. There are none beside a stream.
    pub fn paths(self, output: &Path) -> [Option<PathBuf>; 2] {
        let path = |is_wanted: bool, ending: &str| {
            (is_wanted && output != STANDARD_STREAM).then(|| output.with_extension(ending))
        };
        [path(self.json, "layout.json"), path(self.rerun, "rbl")]
    }
}

/// The layout files beside a recording.
pub struct Layout {
    /// For Lichtblick and Foxglove.
    json: Option<OutputFile>,
    /// For Rerun.
    rerun: Option<OutputFile>,
}

impl Layout {
    /// The layouts beside an output.
    pub fn beside(
        output: &Path,
        wanted: WantedLayouts,
        outputs: &mut Outputs,
    ) -> Result<Self, RefusedOutput> {
        let mut file =
            |path: Option<PathBuf>| path.map(|path| outputs.file_in_made_folder(&path)).transpose();
        let [json, rerun] = wanted.paths(output);
        Ok(Layout { json: file(json)?, rerun: file(rerun)? })
    }

    /// Writes them for the annotated topics.
    pub fn write(&self, report: &AnnotationReport) -> Result<()> {
        let topics = shown(report);
        if let Some(file) = &self.json {
            file.write(viewer_layout(&topics).as_bytes())?;
        }
        if let Some(file) = &self.rerun {
            file.write(&viewer::blueprint(&report.output, &topics)?)?;
        }
        Ok(())
    }

    /// How to look at the recording, so that its colours are seen.
    pub fn how_to_look(&self, report: &AnnotationReport) -> String {
        let output = path_word(&report.output);
        let is_alone = report.form != Form::Beside.describe();
        let is_drawn = report.topics.values().any(|topic| is_drawn_by_rerun(topic.format));
        let rerun = match &self.rerun {
            _ if !is_drawn => {
                "a stock Rerun draws no clouds in this encoding, `divmerge view` does".to_owned()
            }
            Some(file) => format!("`rerun {output} {}`", path_word(file.path())),
            None if is_alone => format!("`rerun {output}`"),
            None => {
                let topic = report.topics.keys().next().map_or("T", String::as_str);
                let blueprint = if viewer::IS_BUILT { " (or use --blueprint)" } else { "" };
                format!("in Rerun, hide {topic}, which covers {topic}{INSTANCES}{blueprint}")
            }
        };
        let json = self
            .json
            .as_ref()
            .map(|file| format!("; in Lichtblick and Foxglove, import {}", path_word(file.path())));
        format!("{rerun}{}", json.unwrap_or_default())
    }
}

/// Whether a stock Rerun (0.36) draws clouds of a format.
fn is_drawn_by_rerun(format: CloudFormat) -> bool {
    matches!(format, CloudFormat::Ros2 | CloudFormat::LivoxRos2 | CloudFormat::FoxgloveProtobuf)
}

/// The topics to show.
fn shown(report: &AnnotationReport) -> Vec<ShownTopic> {
    let topic = |(topic, of_topic): (&String, &TopicReport)| ShownTopic {
        cloud: topic.clone(),
        instances: match report.form == Form::InPlace.describe() {
            true => topic.clone(),
            false => format!("{topic}{INSTANCES}"),
        },
        objects: format!("{topic}{OBJECTS}"),
        has_packed_colours: !of_topic.format.is_foxglove(),
        frame_id: of_topic.frame_id.clone(),
    };
    report.topics.iter().map(topic).collect()
}
