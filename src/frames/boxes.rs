//! Detection boxes for the clouds of a recording: from a topic beside them, or from KITTI's label
//! files.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use super::key::CloudKey;
use super::topic_boxes::{FrameDetections, TopicBoxes};
use crate::datasets::kitti_boxes::KittiBoxes;
use crate::error::Result;
use divmerge_core::cloud::taxonomy::Taxonomy;

/// Where boxes are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BoxSource {
    /// On a topic of the recording: `visualization_msgs/msg/MarkerArray` or
    /// `vision_msgs/msg/Detection3DArray`.
    Topic(String),
    /// In files of KITTI's object benchmark, one for each cloud.
    Kitti {
        /// Folder of the label files, `NNNNNN.txt` by the number of the cloud.
        labels: PathBuf,
        /// One calibration for all clouds, or a folder of one for each, `NNNNNN.txt`.
        calibration: PathBuf,
    },
}

/// The boxes of a recording, looked up by cloud.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum FrameBoxes {
    /// No boxes.
    #[default]
    Nothing,
    /// Those of a topic.
    Topic(TopicBoxes),
    /// Those of files.
    Kitti(KittiBoxes),
}

impl FrameBoxes {
    /// Opens the boxes for a recording. Those of a topic are all read, and nothing else of the
    /// recording is kept but its median cloud periods; files are read when their cloud comes.
    ///
    /// # Errors
    /// [`crate::error::Error::Boxes`] if there is no such topic or file, or a message cannot be
    /// read; those of [`RecordingReader`](divmerge_recording::RecordingReader).
    pub fn open(source: &BoxSource, recording: &Path, taxonomy: &Taxonomy) -> Result<Self> {
        match source {
            BoxSource::Topic(topic) => {
                TopicBoxes::read(recording, topic, taxonomy).map(FrameBoxes::Topic)
            }
            BoxSource::Kitti { labels, calibration } => {
                KittiBoxes::open(labels, calibration, taxonomy).map(FrameBoxes::Kitti)
            }
        }
    }

    /// The boxes of a cloud.
    ///
    /// # Errors
    /// [`crate::error::Error::Boxes`] if its boxes are of another coordinate frame or its files
    /// cannot be used. Every other cloud is then likely to meet the same.
    pub fn of(&self, cloud: &CloudKey) -> Result<FrameDetections<'_>> {
        match self {
            FrameBoxes::Nothing => Ok(FrameDetections::default()),
            FrameBoxes::Topic(boxes) => boxes.of(cloud),
            FrameBoxes::Kitti(boxes) => {
                let found = boxes.of(cloud.number)?;
                let path = boxes.label_file(cloud.number);
                let missing = found.is_none().then(|| format!("no label file {}", path.display()));
                let detections = Cow::Owned(found.unwrap_or_default());
                Ok(FrameDetections { detections, missing })
            }
        }
    }

    /// What they are, without the name of a file: `topic:/detections` or `kitti`. `None` where none
    /// are asked for.
    pub fn describe(&self) -> Option<String> {
        match self {
            FrameBoxes::Nothing => None,
            FrameBoxes::Topic(boxes) => Some(format!("topic:{}", boxes.topic())),
            FrameBoxes::Kitti(_) => Some("kitti".to_owned()),
        }
    }
}
