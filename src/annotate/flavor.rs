//! In which messages an annotation is written.

use crate::error::{Error, Result};
use crate::io::{CloudFormat, Overview};

/// In which messages an annotation is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Flavor {
    /// Each topic's as its clouds are.
    #[default]
    Auto,
    /// Foxglove's, in protobuf.
    Foxglove,
}

impl Flavor {
    /// Format of the annotated clouds of a topic.
    pub fn format(self, clouds: CloudFormat) -> CloudFormat {
        match self {
            Flavor::Auto => clouds,
            Flavor::Foxglove => CloudFormat::FoxgloveProtobuf,
        }
    }

    /// Whether a recording may have such messages.
    ///
    /// # Errors
    /// [`Error::Conflict`] where other messages than ROS's are asked for in a recording of ROS.
    pub(super) fn check(self, overview: &Overview) -> Result<()> {
        let profile = overview.profile.as_str();
        if self == Flavor::Auto || !matches!(profile, "ros1" | "ros2") {
            return Ok(());
        }
        let problem = format!(
            "its profile is `{profile}`, so it gets ROS messages only: readers such as rosbags refuse a file with \
             protobuf among them; leave the flavor foxglove out"
        );
        Err(Error::Conflict { path: overview.path.clone(), problem })
    }
}
