//! Arguments of `--method boxes`.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::error::ErrorKind;
use clap::{Args, CommandFactory};
use divmerge::Taxonomy;
use divmerge::baselines::AnyBaseline;
use divmerge::io::{BoxSource, FrameBoxes};
use divmerge::pipeline::Config;

use crate::arguments::{not_negative, number};

/// Where detection boxes are, and how they are used.
#[derive(Args)]
pub struct BoxArguments {
    /// Boxes for `--method boxes`, all in the clouds' frame: `topic:NAME` a MarkerArray or Detection3DArray of the
    /// recording (a cloud's are those with its stamp, else the nearest within half a cloud period); `kitti:DIR`
    /// KITTI label files NNNNNN.txt by the number of the cloud, with --boxes-calibration
    #[arg(long, value_name = "SOURCE", value_parser = box_source)]
    boxes: Option<BoxesFrom>,

    /// KITTI's calibration for all clouds, or a folder of one for each, NNNNNN.txt
    #[arg(long, value_name = "PATH", requires = "boxes")]
    boxes_calibration: Option<PathBuf>,

    /// How far outside a box a point may lie in metres [default: 0.1]
    #[arg(long, value_name = "M", value_parser = not_negative, requires = "boxes")]
    boxes_margin: Option<f64>,

    /// Leave out boxes less sure than this [default: 0; boxes without a score have 1]
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true, requires = "boxes")]
    least_score: Option<f64>,
}

/// The source of boxes as it is written.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum BoxesFrom {
    /// A topic of the recording.
    Topic(String),
    /// A folder of KITTI label files.
    Kitti(PathBuf),
}

impl BoxArguments {
    /// Where boxes are. Ends the program with exit code 2 if that and the methods, of which one is or is not `boxes`,
    /// do not fit each other.
    pub fn source(&self, of_boxes: bool) -> Option<BoxSource> {
        use ErrorKind::{ArgumentConflict, MissingRequiredArgument};
        let calibration = self.boxes_calibration.clone();
        match (of_boxes, &self.boxes, calibration) {
            (true, Some(BoxesFrom::Topic(topic)), None) => Some(BoxSource::Topic(topic.clone())),
            (true, Some(BoxesFrom::Kitti(labels)), Some(calibration)) => {
                Some(BoxSource::Kitti { labels: labels.clone(), calibration })
            }
            (true, None, _) => wrong_usage(
                MissingRequiredArgument,
                "--method boxes needs boxes: --boxes topic:NAME, or --boxes kitti:DIR with --boxes-calibration \
                 PATH",
            ),
            (true, Some(BoxesFrom::Kitti(_)), None) => wrong_usage(
                MissingRequiredArgument,
                "--boxes kitti:DIR needs --boxes-calibration PATH: KITTI's boxes are in a camera's frame",
            ),
            (true, Some(BoxesFrom::Topic(_)), Some(_)) => wrong_usage(
                ArgumentConflict,
                "--boxes-calibration is for --boxes kitti:DIR; boxes of a topic are in the clouds' frame",
            ),
            (false, Some(_), _) => wrong_usage(
                ArgumentConflict,
                "--boxes is for --method boxes; no other method looks at boxes",
            ),
            (false, None, _) => None,
        }
    }

    /// The same arguments as words of a command line; nothing for those that were left out.
    pub fn words(&self) -> Vec<String> {
        let source = self.boxes.as_ref().map(|source| match source {
            BoxesFrom::Topic(name) => format!("topic:{name}"),
            BoxesFrom::Kitti(folder) => format!("kitti:{}", folder.display()),
        });
        let calibration = self.boxes_calibration.as_ref().map(|path| path.display().to_string());
        let arguments = [
            ("--boxes", source),
            ("--boxes-calibration", calibration),
            ("--boxes-margin", self.boxes_margin.map(|margin| margin.to_string())),
            ("--least-score", self.least_score.map(|score| score.to_string())),
        ];
        let said =
            arguments.into_iter().filter_map(|(name, value)| Some([name.to_owned(), value?]));
        said.flatten().collect()
    }

    /// Puts what is said of the boxes into the parameters, if it is boxes that cut.
    pub fn set(&self, config: &mut Config) {
        if let Some(AnyBaseline::Boxes(boxes)) = &mut config.baseline {
            boxes.margin = self.boxes_margin.unwrap_or(boxes.margin);
            boxes.least_score = self.least_score.unwrap_or(boxes.least_score);
        }
    }

    /// Opens the boxes for a recording.
    pub fn open(
        source: Option<&BoxSource>,
        recording: &Path,
        taxonomy: &Taxonomy,
    ) -> Result<FrameBoxes> {
        Ok(match source {
            Some(source) => FrameBoxes::open(source, recording, taxonomy)?,
            None => FrameBoxes::Nothing,
        })
    }
}

/// Ends the program with exit code 2.
fn wrong_usage(kind: ErrorKind, problem: &str) -> ! {
    crate::Cli::command().error(kind, problem).exit()
}

fn box_source(text: &str) -> Result<BoxesFrom, String> {
    match text.split_once(':') {
        Some(("topic", name)) if !name.is_empty() => Ok(BoxesFrom::Topic(name.to_owned())),
        Some(("kitti", folder)) if !folder.is_empty() => Ok(BoxesFrom::Kitti(folder.into())),
        _ => Err("use topic:NAME or kitti:DIR".into()),
    }
}
