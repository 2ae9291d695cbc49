//! Classes of points that were found elsewhere, for the clouds of a recording: in files, or on a
//! topic beside the clouds.

use std::path::{Path, PathBuf};

use super::key::CloudKey;
use super::topic_classes::ClassTopic;
use crate::datasets::class_files::ClassFiles;
use crate::error::Result;
use divmerge_core::cloud::PointClasses;
use divmerge_core::cloud::taxonomy::Taxonomy;

/// Where classes are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ClassSource {
    /// A folder of files, one for each cloud.
    Files(PathBuf),
    /// A topic of the recording.
    Topic(String),
}

/// The classes of a recording, looked up by cloud.
#[derive(Debug, PartialEq)]
pub enum FrameClasses {
    /// Those of files.
    Files(ClassFiles),
    /// Those of a topic.
    Topic(Box<ClassTopic>),
}

impl FrameClasses {
    /// Opens the classes for a recording. What is more than so many nanoseconds from a cloud's
    /// stamp is not of that cloud.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], and [`crate::error::Error::Classes`] if there are none.
    pub fn open(
        source: &ClassSource,
        recording: &Path,
        taxonomy: &Taxonomy,
        tolerance_ns: u64,
    ) -> Result<Self> {
        match source {
            ClassSource::Files(folder) => {
                ClassFiles::open(folder, taxonomy, tolerance_ns).map(FrameClasses::Files)
            }
            ClassSource::Topic(topic) => {
                let topic = ClassTopic::open(recording, topic, tolerance_ns)?;
                Ok(FrameClasses::Topic(Box::new(topic)))
            }
        }
    }

    /// The classes of a cloud of so many rows and columns.
    ///
    /// # Errors
    /// [`FrameError::NoClasses`](crate::error::FrameError::NoClasses) if there are none for it;
    /// [`crate::error::Error::Classes`] if there are more or fewer than it has points, or they
    /// cannot be read, so that every other cloud is likely to meet the same.
    pub fn of(&self, cloud: &CloudKey, shape: [usize; 2]) -> Result<PointClasses> {
        match self {
            FrameClasses::Files(files) => {
                files.of(cloud.topic, cloud.number, cloud.stamp_ns, shape[0] * shape[1])
            }
            FrameClasses::Topic(topic) => topic.of(cloud, shape),
        }
    }

    /// The topic of the recording that they are on, if they are on one.
    pub fn topic(&self) -> Option<&str> {
        match self {
            FrameClasses::Files(_) => None,
            FrameClasses::Topic(topic) => Some(topic.topic()),
        }
    }

    /// How far the stamp of a message may be from that of its cloud, nanoseconds; of a topic alone.
    pub fn tolerance_ns(&self) -> Option<u64> {
        match self {
            FrameClasses::Files(_) => None,
            FrameClasses::Topic(topic) => Some(topic.tolerance_ns()),
        }
    }

    /// Where they are and how they are told apart, with the name of the folder.
    pub fn source(&self) -> String {
        match self {
            FrameClasses::Files(files) => files.source(),
            FrameClasses::Topic(topic) => topic.source(),
        }
    }

    /// What they are, without the name of a file: `labels` or `topic:/predictions`.
    pub fn describe(&self) -> String {
        match self {
            FrameClasses::Files(_) => "labels".to_owned(),
            FrameClasses::Topic(topic) => format!("topic:{}", topic.topic()),
        }
    }
}
