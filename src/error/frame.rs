//! What is wrong with one cloud, or with a message beside it.

use divmerge_core::CloudError;

/// What is wrong with one cloud. It is skipped, and the run goes on.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// Columns that make no cloud, or a cloud whose frame is not known to stand upright.
    #[error(transparent)]
    Cloud(#[from] CloudError),

    /// A message that is not what its schema says.
    #[error("malformed {message}: {problem}")]
    Malformed {
        /// Message type.
        message: &'static str,
        /// What is wrong, with the numbers.
        problem: String,
    },

    /// A message in an encoding or layout that is well formed but cannot be read here.
    #[error("unsupported {message}: {problem}")]
    Unsupported {
        /// Message type.
        message: &'static str,
        /// What is not supported.
        problem: String,
    },

    /// A cloud lacks a field that was asked for.
    #[error("no field `{name}` in the cloud; it has: {present}")]
    MissingField {
        /// The field asked for.
        name: String,
        /// The fields that are there, comma separated.
        present: String,
    },

    /// More or fewer labels than points.
    #[error("{labels} labels for {points} points")]
    LabelCount {
        /// Labels.
        labels: usize,
        /// Points of the cloud.
        points: usize,
    },

    /// No classes for one of the clouds.
    #[error("no classes for cloud {number}: {problem}")]
    NoClasses {
        /// Number of the cloud on its topic, from 0.
        number: u64,
        /// What was looked for, and what is there.
        problem: String,
    },
}

/// Result of what is done with one cloud.
pub type Result<T> = std::result::Result<T, FrameError>;
