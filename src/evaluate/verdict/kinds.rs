//! The verdicts that there are; the module above says when each holds.

use serde::Serialize;

/// The verdict on a true object or a found instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It has a match.
    Correct,
    /// It would have a match but for the class.
    WrongClass,
    /// A true object in several parts, or one of these parts.
    OverSegmented,
    /// A true object in one instance with something else, or that instance.
    UnderSegmented,
    /// A true object of whose points half or more have no instance.
    Missed,
    /// A found instance of whose points more than half are of no thing.
    Spurious,
}

impl Verdict {
    /// All of them.
    pub const ALL: [Verdict; 6] = [
        Verdict::Correct,
        Verdict::WrongClass,
        Verdict::OverSegmented,
        Verdict::UnderSegmented,
        Verdict::Missed,
        Verdict::Spurious,
    ];

    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Correct => "correct",
            Verdict::WrongClass => "wrong class",
            Verdict::OverSegmented => "over-segmented",
            Verdict::UnderSegmented => "under-segmented",
            Verdict::Missed => "missed",
            Verdict::Spurious => "spurious",
        }
    }
}
