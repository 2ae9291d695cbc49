//! Why there is no cloud.

use super::spelling::did_you_mean;

/// Why a recording or a folder has none of the clouds that were asked for.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NoCloud {
    /// No topic has clouds that can be read.
    #[error("no cloud topic that can be read; {}", listed(topics, damage.as_deref()))]
    NoReadableTopic {
        /// The topics that are there, each with its type and why it cannot be read.
        topics: Vec<String>,
        /// What is wrong with the recording, if something is.
        damage: Option<String>,
    },

    /// The topic that is named has no clouds, or is not there.
    #[error(
        "no readable cloud topic `{topic}`; there is: {}{}",
        readable.join(", "),
        did_you_mean(topic, readable)
    )]
    NoSuchTopic {
        /// The topic asked for.
        topic: String,
        /// The topics with clouds that can be read.
        readable: Vec<String>,
    },

    /// The topic that is named has clouds that cannot be read.
    #[error("the topic `{topic}` cannot be read: {reason}")]
    UnreadableTopic {
        /// The topic asked for.
        topic: String,
        /// Why, and what to do.
        reason: String,
    },

    /// A topic of clouds without a message.
    #[error("no cloud on `{topic}`")]
    EmptyTopic {
        /// The topic.
        topic: String,
    },

    /// No topic has a frame of that number.
    #[error("there is no frame {frame}: {}", counts_of(counts))]
    NoFrame {
        /// The number asked for, from 0.
        frame: u64,
        /// The topics and how many clouds each has.
        counts: Vec<(String, u64)>,
    },

    /// A frame that the index counts and that is not there.
    #[error("frame {frame} is counted but not there: the recording is damaged")]
    LostFrame {
        /// The number asked for, from 0.
        frame: u64,
    },

    /// The frames and times that were asked for hold no cloud.
    #[error("no cloud lies in the frames and times asked for{}", times_of(*times_ns))]
    NothingSelected {
        /// First and last log time of the recording in nanoseconds, if they are known.
        times_ns: Option<(u64, u64)>,
    },

    /// No cloud has a field that is asked for.
    #[error(
        "no cloud has the field `{field}`; fields: {}{}",
        present.join(", "),
        did_you_mean(field, present)
    )]
    NoSuchField {
        /// The field asked for.
        field: String,
        /// The fields of the first cloud.
        present: Vec<String>,
    },

    /// A folder without a labelled scan of those that were asked for.
    #[error("no labelled scan of what is asked for")]
    NoLabelledScan,

    /// A folder without a recording.
    #[error("a folder without an .mcap file")]
    NoRecording,
}

impl NoCloud {
    /// Whether arguments ask for what the recording does not have, and others may not.
    pub fn is_of_arguments(&self) -> bool {
        matches!(
            self,
            NoCloud::NoSuchTopic { .. }
                | NoCloud::NoFrame { .. }
                | NoCloud::NothingSelected { .. }
                | NoCloud::NoSuchField { .. }
        )
    }
}

fn times_of(times_ns: Option<(u64, u64)>) -> String {
    let Some((start, end)) = times_ns else { return String::new() };
    let [start_s, end_s] = [start, end].map(seconds_text);
    let length_s = seconds_text(end.saturating_sub(start));
    format!("; the recording is {length_s} s long, from @{start_s} to @{end_s}")
}

/// Nanoseconds as seconds, exactly.
fn seconds_text(ns: u64) -> String {
    const NS_PER_S: u64 = 1_000_000_000;
    let text = format!("{}.{:09}", ns / NS_PER_S, ns % NS_PER_S);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn listed(topics: &[String], damage: Option<&str>) -> String {
    let damage = damage.map_or(String::new(), |damage| format!("; {damage}"));
    match topics {
        [] => format!("it has no topic at all{damage}"),
        topics => format!("its topics:\n  {}{damage}", topics.join("\n  ")),
    }
}

fn counts_of(counts: &[(String, u64)]) -> String {
    let each = counts.iter().map(|(topic, count)| match count {
        0 => format!("{topic} has no cloud"),
        1 => format!("{topic} has 1 cloud, numbered 0"),
        count => format!("{topic} has {count} clouds, numbered 0 to {}", count - 1),
    });
    each.collect::<Vec<_>>().join("; ")
}
