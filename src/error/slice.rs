//! Why slices do not make up a recording.

use std::path::PathBuf;

use divmerge_recording::Damage;

/// Why slices do not make up a recording, or a file is no slice.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SliceProblem {
    /// No slice at all.
    #[error("no slice to be joined")]
    Nothing,

    /// A slice of a stream.
    #[error("a slice is read from a file, not from a stream")]
    OfStream,

    /// A recording that is no slice.
    #[error("no slice: `divmerge annotate --slice` makes those")]
    NoSlice,

    /// A slice that another version wrote.
    #[error("a slice of another version: {reason}")]
    OtherVersion {
        /// What cannot be read of it.
        reason: String,
    },

    /// A file that is no plan.
    #[error("no plan of `divmerge plan`: {reason}")]
    NoPlan {
        /// What cannot be read of it.
        reason: String,
    },

    /// A slice that the plan does not have.
    #[error("a slice that is not in the plan")]
    NotPlanned,

    /// Slices are missing.
    #[error("{}", missing(names, *count))]
    Missing {
        /// Names of the missing slices; the first ones if there are many.
        names: Vec<PathBuf>,
        /// How many are missing.
        count: usize,
    },

    /// A slice is there twice.
    #[error(
        "slice {} is there twice: {} and {}", slice.display(), files[0].display(),
        files[1].display()
    )]
    Twice {
        /// Name of the slice.
        slice: PathBuf,
        /// The two files.
        files: [PathBuf; 2],
    },

    /// Two slices of different plans.
    #[error("{} and {} are slices of different plans", files[0].display(), files[1].display())]
    OtherPlan {
        /// The two files.
        files: [PathBuf; 2],
    },

    /// Two slices that were annotated with different parameters.
    #[error(
        "{} and {} were not annotated alike: they differ in {}", files[0].display(),
        files[1].display(), differences.join(", ")
    )]
    OtherParameters {
        /// The two files.
        files: [PathBuf; 2],
        /// Names of the parameters that differ.
        differences: Vec<String>,
    },

    /// A slice that is damaged.
    #[error("damaged: {damage}; annotate it again")]
    Damaged {
        /// The damage.
        damage: Damage,
    },

    /// A slice that is cut off.
    #[error("cut off: {damage}; annotate it again")]
    CutOff {
        /// How it ends.
        damage: Damage,
    },

    /// Checkpoints that cannot be read.
    #[error("checkpoints: {reason}")]
    Checkpoints {
        /// What cannot be read of them.
        reason: String,
    },

    /// Messages that are not those of the checkpoints.
    #[error("its messages are not those of its checkpoints; annotate it again")]
    OtherMessages,

    /// A cloud of the recording that no slice has.
    #[error("no slice has cloud {number} of {topic}")]
    LacksCloud {
        /// Topic of the cloud.
        topic: String,
        /// Number of the cloud on its topic, from 0.
        number: u64,
    },

    /// Another cloud in the place of the one that comes next in the recording.
    #[error("cloud {} of {} was not annotated here: cloud {} of {} comes next",
        expected.1, expected.0, found.1, found.0
    )]
    OtherCloud {
        /// Topic and number of the cloud in the recording.
        expected: (String, u64),
        /// Topic and number of the cloud in the slice.
        found: (String, u64),
    },

    /// A cloud whose message is not the one that was annotated.
    #[error(
        "cloud {number} of {topic} is not the one that was annotated: the recording has changed"
    )]
    ChangedCloud {
        /// Topic of the cloud.
        topic: String,
        /// Number of the cloud on its topic, from 0.
        number: u64,
    },

    /// A cloud that the recording does not have.
    #[error("cloud {number} of {topic} was annotated, and is not there in the recording")]
    ExtraCloud {
        /// Topic of the cloud.
        topic: String,
        /// Number of the cloud on its topic, from 0.
        number: u64,
    },
}

fn missing(names: &[PathBuf], count: usize) -> String {
    let more = match count.saturating_sub(names.len()) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let what = if count == 1 { "slice is" } else { "slices are" };
    let names: Vec<String> = names.iter().map(|name| name.display().to_string()).collect();
    format!("{count} {what} missing: {}{more}", names.join(", "))
}
