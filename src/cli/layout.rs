//! The layout for viewers beside an annotated recording.

use std::path::Path;

use anyhow::Result;

use crate::annotate::{AnnotationReport, Form, TopicReport};
use crate::cli::exit::RefusedOutput;
use crate::cli::output::{OutputFile, Outputs};
use crate::frames::{INSTANCES, OBJECTS};
use crate::recording::STANDARD_STREAM;
use crate::view::{ShownTopic, viewer_layout};

/// A layout file for Lichtblick and Foxglove.
pub struct Layout {
    /// `None` if it is not written.
    file: Option<OutputFile>,
}

impl Layout {
    /// The layout beside an output. It is not written beside a stream.
    pub fn beside(
        output: &Path,
        is_written: bool,
        outputs: &mut Outputs,
    ) -> Result<Self, RefusedOutput> {
        let is_written = is_written && output != STANDARD_STREAM;
        let path = is_written.then(|| output.with_extension("layout.json"));
        let file = path.map(|path| outputs.file_in_made_folder(&path)).transpose()?;
        Ok(Layout { file })
    }

    /// Writes it for the annotated topics.
    pub fn write(&self, report: &AnnotationReport) -> Result<()> {
        if let Some(file) = &self.file {
            file.write(viewer_layout(&shown(report)).as_bytes())?;
        }
        Ok(())
    }
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
