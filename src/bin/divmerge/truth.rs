//! Clouds with truth: the arguments of all commands that score something.

use std::path::PathBuf;

use anyhow::{Result, anyhow};
use clap::Args;
use divmerge::annotate::{Method, Semantics};
use divmerge::evaluate::panoptic::MIN_POINTS;
use divmerge::io::{LabelledFrames, LabelledOptions, SeenClasses, TruthSource};
use divmerge::replay::FrameRange;

use crate::arguments::frames;

/// Clouds with truth, and which objects count.
#[derive(Args)]
pub struct TruthArguments {
    #[command(flatten)]
    pub clouds: CloudArguments,

    /// Unmatched objects of fewer points are neither spurious nor missed
    #[arg(long, default_value_t = MIN_POINTS, value_name = "POINTS")]
    pub min_points: u64,
}

impl TruthArguments {
    /// Opens the clouds for a method that gets its objects from there.
    pub fn open(&self, method: &Method) -> Result<LabelledFrames> {
        self.clouds.open(method)
    }
}

/// Clouds with truth.
#[derive(Args)]
pub struct CloudArguments {
    /// A recording (MCAP) whose clouds carry truth or have label files, or a folder in SemanticKITTI's form:
    /// sequences/NN/velodyne/*.bin, sequences/NN/labels/*.label
    pub input: PathBuf,

    /// The cloud topic of a recording [default: the first with clouds]
    #[arg(long, value_name = "T")]
    pub topic: Option<String>,

    /// Only these sequences of a folder, such as 00,04
    #[arg(long, value_delimiter = ',', value_name = "NN,...")]
    sequences: Vec<String>,

    /// Only these clouds, numbered from 0: 5..10 (10 is left out), 5.., ..10 or 5
    #[arg(long, value_name = "A..B", value_parser = frames, default_value = "0..")]
    frames: FrameRange,

    #[command(flatten)]
    truth: SourceArguments,
}

impl CloudArguments {
    /// Opens the clouds for a method that gets its objects from there.
    pub fn open(&self, method: &Method) -> Result<LabelledFrames> {
        let options = LabelledOptions {
            topic: self.topic.clone(),
            sequences: self.sequences.clone(),
            frames: self.frames,
            truth: match &self.truth.labels {
                Some(folder) => TruthSource::Files(folder.clone()),
                None => TruthSource::Fields {
                    class: self.truth.true_class_field.clone(),
                    instance: self.truth.true_instance_field.clone(),
                },
            },
            classes: match &method.semantics {
                Semantics::Auto => SeenClasses::Auto,
                Semantics::Field(name) => SeenClasses::Field(name.clone()),
                _ => SeenClasses::Nothing,
            },
            remission: method.wants_remission(),
        };
        Ok(LabelledFrames::open(&self.input, options)?)
    }
}

/// An error, and where truth is looked for if it has not been found.
pub fn with_hint(error: divmerge::Error) -> anyhow::Error {
    let is_missing =
        matches!(&error, divmerge::Error::Truth { problem, .. } if problem.starts_with("no field"));
    match is_missing {
        true => anyhow!(
            "{error}\n  truth is looked for in the fields --true-class-field and --true-instance-field, or with \
             --labels in a folder of label files"
        ),
        false => error.into(),
    }
}

/// Where the truth of a recording is.
#[derive(Args)]
pub struct SourceArguments {
    /// Field of the true class in a recording
    #[arg(long, value_name = "NAME", default_value = "label")]
    pub true_class_field: String,

    /// Field of the true instance in a recording
    #[arg(long, value_name = "NAME", default_value = "true_instance")]
    pub true_instance_field: String,

    /// A recording's truth is in this folder: NNNNNN.label, by the number of the cloud
    #[arg(long, value_name = "DIR", conflicts_with_all = ["true_class_field", "true_instance_field"])]
    pub labels: Option<PathBuf>,
}
