//! What is odd about clouds: one warning for each topic and kind, however many clouds it concerns.

use std::collections::BTreeMap;

use crate::frames::EncodedCloud;

/// What was found odd about the clouds of a run.
#[derive(Debug, Default)]
pub(super) struct CloudWarnings {
    /// By topic and kind. Those of clouds that could not be read begin with [`UNREADABLE`].
    found: BTreeMap<(String, String), Found>,
}

/// What clouds are that could not be read.
const UNREADABLE: &str = "could not be read";

#[derive(Debug)]
struct Found {
    count: u64,
    /// What is wrong with the first of the clouds, and where that lies.
    problem: String,
    place: String,
}

impl CloudWarnings {
    /// Takes something odd about a cloud; `kind` is what several clouds are said to be, such as
    /// `without points`.
    pub(super) fn take(&mut self, cloud: &EncodedCloud, kind: &str, problem: &str) {
        let key = (cloud.topic.to_string(), kind.to_owned());
        let new = || Found { count: 0, problem: problem.to_owned(), place: cloud.place() };
        self.found.entry(key).or_insert_with(new).count += 1;
    }

    /// Takes a cloud that could not be read. Problems are of one kind that differ only in numbers.
    pub(super) fn take_unreadable(&mut self, cloud: &EncodedCloud, problem: &str) {
        let kind = problem.split(|letter: char| letter == ':' || letter.is_ascii_digit()).next();
        self.take(cloud, &format!("{UNREADABLE}, {}", kind.unwrap_or_default()), problem);
    }

    /// The warnings, by topic and kind.
    pub(super) fn into_lines(self) -> impl Iterator<Item = String> {
        self.found.into_iter().map(|((topic, kind), found)| {
            let Found { count, problem, place } = found;
            match (count, kind.starts_with(UNREADABLE)) {
                (1, true) => format!("{topic}: a cloud {UNREADABLE}: {problem} ({place})"),
                (1, false) => format!("{topic}: {problem} ({place})"),
                (_, true) => {
                    format!("{topic}: {count} clouds {UNREADABLE}; the first: {problem} ({place})")
                }
                (_, false) => {
                    format!("{topic}: {count} clouds {kind}; the first: {problem} ({place})")
                }
            }
        })
    }
}
