//! Clouds with truth, for the commands that score something.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;

use super::values::frames;
use crate::annotate::AnnotateConfig;
use crate::cli::exit::NotThere;
use crate::error::{Error, FrameError};
use crate::evaluate::panoptic::MIN_POINTS;
use crate::frames::{LabelledFrames, LabelledOptions, TruthSource};
use crate::recording::MessageRange;

/// Clouds with truth, and the minimum size of objects that count.
#[derive(Args)]
pub struct TruthArguments {
    #[command(flatten)]
    pub clouds: CloudArguments,

    /// Unmatched objects of fewer points are neither spurious nor missed
    #[arg(long, default_value_t = MIN_POINTS, value_name = "POINTS")]
    pub min_points: u64,
}

/// Clouds with truth.
#[derive(Args)]
pub struct CloudArguments {
    /// A recording (MCAP) whose clouds have fields of truth or label files, or a folder in
    /// SemanticKITTI's form: sequences/NN/velodyne/*.bin, sequences/NN/labels/*.label
    pub input: PathBuf,

    /// Cloud topic of a recording [default: the first with clouds]
    #[arg(long, value_name = "T")]
    pub topic: Option<String>,

    /// Only these sequences of a folder, such as 00,04 [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NN,...")]
    sequences: Vec<String>,

    /// Only these clouds, numbered from 0: 5..10 (without 10), 5.., ..10 or 5
    #[arg(long, value_name = "A..B", value_parser = frames, default_value = "0..")]
    frames: MessageRange,

    #[command(flatten)]
    truth: SourceArguments,
}

impl CloudArguments {
    /// The files and folders that are read.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(self.input.as_path()).chain(self.truth.labels.as_deref())
    }

    /// Adds where truth can be to an error about missing truth.
    pub fn with_hint(&self, error: Error) -> anyhow::Error {
        match &error {
            Error::Unreadable { problem: FrameError::MissingField { name, .. }, .. } => {
                let hint = if self.truth.names(name) { TRUTH_HINT } else { "" };
                NotThere(format!("{error}{hint}")).into()
            }
            _ => error.into(),
        }
    }

    /// Opens the clouds, with the columns that the method needs.
    pub fn open(&self, method: &AnnotateConfig) -> Result<LabelledFrames> {
        let options = LabelledOptions {
            topic: self.topic.clone(),
            sequences: self.sequences.clone(),
            frames: self.frames,
            truth: self.truth.source(),
            classes: method.seen_classes(),
            remission: method.wants_remission(),
            assemble: method.assemble,
        };
        Ok(LabelledFrames::open(&self.input, options)?)
    }
}

/// Where truth can be.
pub const TRUTH_HINT: &str = "\n  name the fields with --true-class-field and \
                              --true-instance-field, or a folder of label files with --labels";

/// The usual fields of the truth.
const CLASS_FIELD: &str = "label";
const INSTANCE_FIELD: &str = "true_instance";

/// Where the truth of a recording is.
#[derive(Args)]
pub struct SourceArguments {
    /// Field of the true class in a recording
    #[arg(long, value_name = "NAME", default_value = CLASS_FIELD)]
    pub true_class_field: String,

    /// Field of the true instance in a recording
    #[arg(long, value_name = "NAME", default_value = INSTANCE_FIELD)]
    pub true_instance_field: String,

    /// Folder of a recording's truth: NNNNNN.label, numbered as the clouds
    #[arg(long, value_name = "DIR")]
    #[arg(conflicts_with_all = ["true_class_field", "true_instance_field"])]
    pub labels: Option<PathBuf>,
}

impl SourceArguments {
    /// Where the truth is.
    pub fn source(&self) -> TruthSource {
        match &self.labels {
            Some(folder) => TruthSource::Files(folder.clone()),
            None => TruthSource::Fields {
                class: self.true_class_field.clone(),
                instance: self.true_instance_field.clone(),
            },
        }
    }

    /// Whether somebody said where the truth is.
    pub fn is_said(&self) -> bool {
        let usual = [CLASS_FIELD, INSTANCE_FIELD];
        self.labels.is_some() || [&*self.true_class_field, &*self.true_instance_field] != usual
    }

    /// Whether a field is one of the truth.
    pub fn names(&self, field: &str) -> bool {
        field == self.true_class_field || field == self.true_instance_field
    }
}
