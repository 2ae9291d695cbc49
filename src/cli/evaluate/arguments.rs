//! The arguments of `divmerge evaluate`.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::arguments::truth::SourceArguments;
use crate::evaluate::panoptic::MIN_POINTS;

/// Score instances against the truth, as semantic-kitti-api does
///
/// Takes an annotated recording (IN) whose clouds have fields of truth, as simulated drives do, or
/// label files (--labels). Every annotated topic is scored on its own.
///
/// Or takes two folders (--truth, --predictions) with `sequences/NN/`: truth in `labels/`,
/// predictions of any method in `predictions/` (or `labels/`), one `.label` file for each scan:
/// class in the low 16 bits of a word, instance in the high.
///
/// The scores are those of evaluate_panoptic.py: a segment's id is its whole word, points of
/// ignored true classes are removed first, and absent classes count as 0 in the means.
///
/// Every scan needs truth and a prediction with the same number of points, and every class must be
/// in the taxonomy. Otherwise the problems are named and nothing is scored.
#[derive(Args)]
pub struct Arguments {
    /// An annotated recording (MCAP)
    #[arg(
        value_name = "IN",
        required_unless_present = "truth",
        conflicts_with_all = ["truth", "predictions", "sequences"]
    )]
    pub(super) input: Option<PathBuf>,

    /// Score only this cloud topic of the recording; may be repeated [default: all annotated
    /// topics]
    #[arg(long, value_name = "T", requires = "input")]
    pub(super) topic: Vec<String>,

    #[command(flatten)]
    pub(super) of_recording: SourceArguments,

    /// Field of the found class in a recording
    #[arg(long, default_value = "semantic", value_name = "NAME")]
    pub(super) class_field: String,

    /// Field of the found instance in a recording [default: with --over-time `track` where clouds
    /// have it, else `instance`]
    #[arg(long, value_name = "NAME")]
    pub(super) instance_field: Option<String>,

    /// Folder of the truth: sequences/NN/labels/*.label
    #[arg(long, value_name = "ROOT", requires = "predictions", conflicts_with = "labels")]
    pub(super) truth: Option<PathBuf>,

    /// Folder of the predictions: sequences/NN/predictions/*.label
    #[arg(long, value_name = "ROOT", requires = "truth")]
    pub(super) predictions: Option<PathBuf>,

    /// Score only these sequences, such as 00,04 [default: those with truth]
    #[arg(long, value_delimiter = ',', value_name = "NN,...")]
    pub(super) sequences: Vec<String>,

    /// Unmatched segments of fewer points are neither spurious nor missed
    #[arg(long, default_value_t = MIN_POINTS, value_name = "POINTS")]
    pub(super) min_points: u64,

    /// Classes: a YAML file in semantic-kitti-api's form [default: SemanticKITTI]
    #[arg(long, value_name = "FILE")]
    pub(super) taxonomy: Option<PathBuf>,

    /// Also score over- and under-segmentation entropy (OSE, USE), independent of classes; folders
    /// of truth need the scans: sequences/NN/velodyne/*.bin
    #[arg(long)]
    pub(super) entropy: bool,

    /// Also score instance ids that persist from frame to frame of a sequence or topic: LSTQ with
    /// its association and classification parts (Aygün et al. 2021), HOTA on sets of points, id
    /// switches, and ids kept through occlusions of two seconds
    #[arg(long)]
    pub(super) over_time: bool,

    /// Write the scores to this JSON file, in full precision
    #[arg(long, value_name = "FILE")]
    pub(super) json: Option<PathBuf>,

    /// Replace an existing file
    #[arg(long, requires = "json")]
    pub(super) force: bool,
}

impl Arguments {
    /// The files and folders that are read.
    pub(super) fn files(&self) -> impl Iterator<Item = &Path> {
        let Arguments { input, truth, predictions, taxonomy, of_recording, .. } = self;
        let files = [input, truth, predictions, taxonomy, &of_recording.labels];
        files.into_iter().flatten().map(PathBuf::as_path)
    }
}
