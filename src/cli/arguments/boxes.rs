//! Arguments of `--method boxes`.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use clap::error::ErrorKind::{ArgumentConflict, MissingRequiredArgument};

use super::values::{not_negative, number};
use crate::Taxonomy;
use crate::cli::exit::WrongUsage;
use crate::frames::{BoxSource, FrameBoxes};
use crate::parameters::ParameterSet;

/// Where detection boxes are, and how they are used.
#[derive(Args)]
pub struct BoxArguments {
    /// Boxes for `--method boxes`, in the clouds' frame: `topic:NAME` a MarkerArray or
    /// Detection3DArray of the recording, matched by stamp (else the nearest within half a cloud
    /// period); `kitti:DIR` KITTI label files NNNNNN.txt, numbered as the clouds, with
    /// --boxes-calibration
    #[arg(long, value_name = "SOURCE", value_parser = box_source)]
    boxes: Option<BoxesFrom>,

    /// KITTI calibration of all clouds, or a folder with NNNNNN.txt for each
    #[arg(long, value_name = "PATH", requires = "boxes")]
    boxes_calibration: Option<PathBuf>,

    /// Maximum distance of a point outside its box in metres [default: 0.1]
    #[arg(long, value_name = "M", value_parser = not_negative, requires = "boxes")]
    boxes_margin: Option<f64>,

    /// Minimum score of a box [default: 0; boxes without a score have 1]
    #[arg(long, value_name = "S", value_parser = number)]
    #[arg(allow_hyphen_values = true, requires = "boxes")]
    least_score: Option<f64>,
}

/// Where boxes are, without the calibration.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum BoxesFrom {
    /// A topic of the recording.
    Topic(String),
    /// A folder of KITTI label files.
    Kitti(PathBuf),
}

impl BoxArguments {
    /// The files and folders that are read.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let labels = match &self.boxes {
            Some(BoxesFrom::Kitti(labels)) => Some(labels),
            _ => None,
        };
        labels.into_iter().chain(&self.boxes_calibration).map(PathBuf::as_path)
    }

    /// Where the boxes are. `needs_boxes`: whether method `boxes` runs.
    pub fn source(&self, needs_boxes: bool) -> Result<Option<BoxSource>, WrongUsage> {
        let wrong = |kind, problem: &str| Err(WrongUsage(kind, problem.to_owned()));
        let Some(boxes) = &self.boxes else {
            return match needs_boxes {
                false => Ok(None),
                true => wrong(
                    MissingRequiredArgument,
                    "--method boxes needs boxes: --boxes topic:NAME, or --boxes kitti:DIR with \
                     --boxes-calibration PATH",
                ),
            };
        };
        if !needs_boxes {
            let problem = "--boxes is for --method boxes; no other method uses boxes";
            return wrong(ArgumentConflict, problem);
        }
        match (boxes.clone(), self.boxes_calibration.clone()) {
            (BoxesFrom::Topic(topic), None) => Ok(Some(BoxSource::Topic(topic))),
            (BoxesFrom::Kitti(labels), Some(calibration)) => {
                Ok(Some(BoxSource::Kitti { labels, calibration }))
            }
            (BoxesFrom::Kitti(_), None) => wrong(
                MissingRequiredArgument,
                "--boxes kitti:DIR needs --boxes-calibration PATH: KITTI's boxes are in a camera's \
                 frame",
            ),
            (BoxesFrom::Topic(_), Some(_)) => wrong(
                ArgumentConflict,
                "--boxes-calibration is for --boxes kitti:DIR; boxes of a topic are in the clouds' \
                 frame",
            ),
        }
    }

    /// Sets margin and minimum score, if they were given. Only method `boxes` runs with them.
    pub fn set(&self, parameters: &mut ParameterSet) -> Result<()> {
        let given =
            [("method.margin", self.boxes_margin), ("method.least_score", self.least_score)];
        for (path, value) in given {
            if let Some(value) = value {
                parameters.set(path, &value.into()).map_err(crate::Error::from)?;
            }
        }
        Ok(())
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

fn box_source(text: &str) -> Result<BoxesFrom, String> {
    match text.split_once(':') {
        Some(("topic", name)) if !name.is_empty() => Ok(BoxesFrom::Topic(name.to_owned())),
        Some(("kitti", folder)) if !folder.is_empty() => Ok(BoxesFrom::Kitti(folder.into())),
        _ => Err("use topic:NAME or kitti:DIR".into()),
    }
}
