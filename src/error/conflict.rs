//! Why an output cannot be made of an input.

use std::path::PathBuf;

use super::frame::FrameError;
use super::spelling::did_you_mean;
use crate::text::grouped;

/// Why an output cannot be made of an input.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Conflict {
    /// The output is the input.
    #[error("the output is the input itself, which is never touched")]
    SameFile,

    /// A topic that would be added is there.
    #[error("already has a topic {topic}: take the recording it was made from")]
    TopicExists {
        /// The topic.
        topic: String,
    },

    /// The motion of the sensor is to come from where none is recorded.
    #[error("no motion of the sensor on {source_name}: {}", motions_there(source_name, there))]
    NoMotion {
        /// Where it was looked for.
        source_name: String,
        /// The topics that say poses.
        there: Vec<String>,
    },

    /// Suspicions beside clouds that are no messages of ROS.
    #[error(
        "{topic} has messages in `{encoding}`, and suspicions are written as ROS's DiagnosticArray \
         only: ask for a report or a table"
    )]
    NotRos {
        /// The topic of the clouds.
        topic: String,
        /// Encoding of their messages.
        encoding: String,
    },

    /// The type of boxes that was asked for does not exist beside the clouds.
    #[error("no such boxes beside {clouds}: {problem}; leave the type of the boxes out")]
    NoSuchBoxes {
        /// Type of the clouds' messages.
        clouds: &'static str,
        /// What does not exist.
        problem: Box<FrameError>,
    },

    /// More channels than a recording can have.
    #[error(
        "no room for what is added: its {} channels and those for its {} cloud topics are more \
         than the 65,535 of an MCAP file; `--topic T`, which may be repeated, annotates some of \
         them",
        grouped(*channels as u64),
        grouped(*topics as u64)
    )]
    TooManyChannels {
        /// Channels that it has.
        channels: usize,
        /// Topics whose clouds are annotated.
        topics: usize,
    },

    /// Annotated clouds of another format in the place of the clouds.
    #[error("its clouds are {clouds}, in place of which {written} cannot stand")]
    OtherFormat {
        /// Type of the clouds' messages.
        clouds: &'static str,
        /// Type of the annotated clouds' messages.
        written: &'static str,
    },

    /// Messages that are not ROS's in a recording of ROS.
    #[error(
        "its profile is `{profile}`, so it gets ROS messages only: readers such as rosbags refuse \
         a file with protobuf among them; leave the flavor foxglove out"
    )]
    Profile {
        /// The recording's profile.
        profile: String,
    },

    /// Messages that are to be put together to turns, with something that belongs to each of them.
    #[error("messages cannot be put together to turns with {with}: leave that or --assemble out")]
    Turns {
        /// What belongs to single messages.
        with: &'static str,
    },

    /// A run is to be continued that had other parameters.
    #[error(
        "the run that was cut off had another {}; without --resume the output is made anew",
        differences.join(", ")
    )]
    OtherParameters {
        /// Names of the parameters that differ.
        differences: Vec<String>,
    },

    /// A run is to be continued that saw another cloud.
    #[error(
        "cloud {number} of {topic} is not the one that the run was cut off with; without --resume \
         the output is made anew"
    )]
    OtherCloud {
        /// Topic of the cloud.
        topic: String,
        /// Number of the cloud on its topic, from 0.
        number: u64,
    },

    /// A recording that has changed since its slices were planned.
    #[error(
        "has {bytes} bytes, and had {planned_bytes} when its slices were planned: plan them anew"
    )]
    Changed {
        /// Bytes of the recording.
        bytes: u64,
        /// Bytes that it had.
        planned_bytes: u64,
    },

    /// Two recordings whose outputs would have one name.
    #[error("it and {} would both become {}: plan them apart", other.display(), name.display())]
    SameName {
        /// The other recording.
        other: PathBuf,
        /// Where both go.
        name: PathBuf,
    },
}

/// Where poses are recorded instead, and the nearest spelling.
fn motions_there(wanted: &str, there: &[String]) -> String {
    match there {
        [] => {
            "no topic of the recording says poses; `--ego-motion estimate` takes the motion from \
               the clouds"
                .to_owned()
        }
        some => {
            let near = did_you_mean(wanted, some);
            format!("poses are on {}{near}", some.join(", "))
        }
    }
}
