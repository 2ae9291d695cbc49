//! What is wrong with one cloud, or with a message beside it.

use std::path::PathBuf;

use divmerge_core::CloudError;

use super::spelling::did_you_mean;
use crate::text::seconds;

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
        problem: Unsupported,
    },

    /// A cloud lacks a field that was asked for.
    #[error(
        "no field `{name}` in the cloud; it has: {present}{}",
        did_you_mean(name, &present.split(", ").collect::<Vec<_>>())
    )]
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
        problem: MissingClasses,
    },
}

/// What of a message is not supported.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Unsupported {
    /// CDR other than the plain one.
    #[error(
        "encapsulation {:02x} {:02x}; only plain CDR (00 00 and 00 01) can be read", bytes[0],
        bytes[1]
    )]
    Encapsulation {
        /// First bytes of the message.
        bytes: [u8; 2],
    },

    /// An image of something else than integers of one channel.
    #[error("encoding `{encoding}`; classes are read from mono8, 8UC1, mono16, 16UC1 and 32SC1")]
    ImageEncoding {
        /// Its encoding.
        encoding: String,
    },

    /// A big-endian cloud in a format that is little endian.
    #[error("it cannot hold numbers in big endian, where it has little endian alone")]
    BigEndian,

    /// A cloud with a pose in a format without one.
    #[error("it cannot hold points in another pose than that of their frame")]
    Pose,

    /// Boxes for a cloud with a pose.
    #[error("its points have a pose in their frame, to which boxes are not transformed")]
    BoxesOfPosedCloud,

    /// A type of boxes that an encoding does not have.
    #[error("the type does not exist in {encoding}")]
    NoSuchType {
        /// The encoding.
        encoding: &'static str,
    },
}

/// Why there are no classes for a cloud.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MissingClasses {
    /// No file is named by the cloud's number.
    #[error("{}: no file {number:06}; {files} files, {first} to {last}", folder.display())]
    FileOfNumber {
        /// Folder of the files.
        folder: PathBuf,
        /// Number of the cloud.
        number: u64,
        /// How many files there are.
        files: usize,
        /// Number of the first file.
        first: u64,
        /// Number of the last file.
        last: u64,
    },

    /// No file is named by a stamp near the cloud's.
    #[error("{}: no file of stamp {}; the nearest is {} s away", folder.display(),
        seconds(*stamp_ns), seconds(*nearest_ns))]
    FileOfStamp {
        /// Folder of the files.
        folder: PathBuf,
        /// Stamp of the cloud, nanoseconds since 1970.
        stamp_ns: i64,
        /// From there to the nearest file's stamp, nanoseconds.
        nearest_ns: i64,
    },

    /// No message of the cloud's coordinate frame has a stamp near the cloud's.
    #[error("nothing on {topic} within {} s of stamp {}: {nearest}", seconds(*tolerance_ns),
        seconds(*stamp_ns))]
    Message {
        /// Topic of the classes.
        topic: String,
        /// Stamp of the cloud, nanoseconds since 1970.
        stamp_ns: i64,
        /// How far a message may be from it, nanoseconds.
        tolerance_ns: i64,
        /// What is there instead.
        nearest: NearestClasses,
    },
}

/// What a topic of classes has near a cloud.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NearestClasses {
    /// A message too far away.
    #[error("the nearest is {} s away", seconds(*away_ns))]
    TooFar {
        /// Between the stamps, nanoseconds.
        away_ns: i64,
    },

    /// Messages of another coordinate frame.
    #[error("its messages are in frame `{messages}`, the cloud in `{cloud}`")]
    OtherFrame {
        /// Frame of the messages.
        messages: String,
        /// Frame of the cloud.
        cloud: String,
    },

    /// Nothing.
    #[error("it has no message at all")]
    Nothing,
}

/// Result of what is done with one cloud.
pub type Result<T> = std::result::Result<T, FrameError>;
