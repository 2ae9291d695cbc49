//! The layout for viewers beside an annotated recording.

use std::path::{Path, PathBuf};

use anyhow::Result;
use divmerge::annotate::{AnnotationReport, Form, TopicReport};
use divmerge::frames::{INSTANCES, OBJECTS};
use divmerge::recording::{STANDARD_STREAM, write_file};
use divmerge::view::{ShownTopic, viewer_layout};

use crate::output::refuse_existing;

/// A layout file for Lichtblick and Foxglove.
pub struct Layout {
    /// Its name, if it is written.
    path: Option<PathBuf>,
    force: bool,
}

impl Layout {
    /// The layout beside an output. It is not written beside a stream.
    pub fn beside(output: &Path, is_written: bool, force: bool) -> Result<Self> {
        let is_written = is_written && output != STANDARD_STREAM;
        let path = is_written.then(|| output.with_extension("layout.json"));
        if let Some(path) = &path {
            refuse_existing(path, force)?;
        }
        Ok(Layout { path, force })
    }

    /// Writes it for the annotated topics.
    pub fn write(&self, report: &AnnotationReport) -> Result<()> {
        if let Some(path) = &self.path {
            write_file(path, viewer_layout(&shown(report)).as_bytes(), self.force)?;
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
