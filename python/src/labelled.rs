//! Clouds with truth, for the functions that score something.

use std::path::{Path, PathBuf};

use divmerge::Error as LibraryError;
use divmerge::annotate::AnnotateConfig;
use divmerge::error::FrameError;
use divmerge::frames::{LabelledFrames, LabelledOptions, TruthSource};
use pyo3::prelude::*;

use crate::errors::{Error, raised, wrong};
use crate::parameters::{names, path, text, whole};
use crate::triage::numbers;

/// Names of the arguments about clouds with truth.
pub const LABELLED: &[&str] =
    &["topic", "sequences", "start", "stop", "labels", "true_class_field", "true_instance_field"];

/// Which clouds, and where their truth is.
#[derive(Default)]
pub struct LabelledClouds {
    /// Their topic, if that is said.
    pub topic: Option<String>,
    sequences: Vec<String>,
    start: usize,
    stop: Option<usize>,
    labels: Option<PathBuf>,
    class: Option<String>,
    instance: Option<String>,
}

impl LabelledClouds {
    /// Sets one of the arguments [`LABELLED`].
    pub fn set(&mut self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        match name {
            "topic" => self.topic = Some(text(name, value)?),
            "sequences" => self.sequences = names(name, value)?,
            "start" => self.start = whole(name, value)?,
            "stop" => self.stop = Some(whole(name, value)?),
            "labels" => self.labels = Some(path(name, value)?),
            "true_class_field" => self.class = Some(text(name, value)?),
            _ => self.instance = Some(text(name, value)?),
        }
        Ok(())
    }

    /// The topics that are named.
    pub fn topics(&self) -> Vec<String> {
        self.topic.iter().cloned().collect()
    }

    /// Opens the clouds, with the columns that the method needs.
    pub fn open(
        &self,
        py: Python<'_>,
        input: &Path,
        method: &AnnotateConfig,
    ) -> PyResult<LabelledFrames> {
        let options = LabelledOptions {
            topic: self.topic.clone(),
            sequences: self.sequences.clone(),
            frames: numbers(self.start, self.stop)?,
            truth: self.truth()?,
            classes: method.seen_classes(),
            remission: method.wants_remission(),
            assemble: method.assemble,
        };
        py.detach(|| LabelledFrames::open(input, options)).map_err(raised)
    }

    fn truth(&self) -> PyResult<TruthSource> {
        let TruthSource::Fields { class, instance } = TruthSource::default() else {
            unreachable!("the usual truth is in fields");
        };
        match (&self.labels, &self.class, &self.instance) {
            (None, _, _) => Ok(TruthSource::Fields {
                class: self.class.clone().unwrap_or(class),
                instance: self.instance.clone().unwrap_or(instance),
            }),
            (Some(folder), None, None) => Ok(TruthSource::Files(folder.clone())),
            _ => Err(wrong("labels", "not together with true_class_field, true_instance_field")),
        }
    }

    /// An error for Python; one about missing truth says where truth can be.
    pub fn raised(error: LibraryError) -> PyErr {
        match &error {
            LibraryError::Unreadable { problem: FrameError::MissingField { .. }, .. } => {
                Error::new_err(format!(
                    "{error}; true_class_field and true_instance_field name the fields of the \
                     truth, labels a folder of label files"
                ))
            }
            _ => raised(error),
        }
    }
}
