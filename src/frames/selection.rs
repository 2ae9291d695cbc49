//! Which clouds of a recording are looked at.

use std::collections::BTreeMap;
use std::ops::{Bound, RangeBounds};
use std::path::Path;

use super::topics::{CloudTopic, choose_topics, message_count};
use crate::error::{Error, NoCloud, Result};
use divmerge_recording::{MessageRange, Overview};

/// Which clouds of a recording are looked at. Default: all.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Cloud topics; none means all.
    pub topics: Vec<String>,
    /// Numbers of the clouds on each topic, from 0.
    pub frames: MessageRange,
    /// Earliest log time in nanoseconds since 1970.
    pub from_ns: Option<u64>,
    /// Log time in nanoseconds since 1970 from which on clouds are left out.
    pub to_ns: Option<u64>,
}

impl Default for Selection {
    fn default() -> Self {
        let frames = (Bound::Unbounded, Bound::Unbounded);
        Selection { topics: Vec::new(), frames, from_ns: None, to_ns: None }
    }
}

impl Selection {
    /// The clouds of these numbers.
    pub fn of_frames(frames: impl RangeBounds<u64>) -> Self {
        let frames = (frames.start_bound().cloned(), frames.end_bound().cloned());
        Selection { frames, ..Selection::default() }
    }

    /// Refuses a selection that the recording has nothing for, as far as its index tells.
    ///
    /// # Errors
    /// [`Error::NoCloud`], and those of [`Overview::read`].
    pub fn check(&self, input: &Path) -> Result<()> {
        let overview = Overview::read(input)?;
        self.refuse_missing(&overview, &choose_topics(&overview, &self.topics, None)?)
    }

    /// Refuses frames that no topic has.
    ///
    /// # Errors
    /// [`Error::NoCloud`] with what there is.
    pub(crate) fn refuse_missing(
        &self,
        overview: &Overview,
        clouds: &BTreeMap<u16, CloudTopic>,
    ) -> Result<()> {
        let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
        for (&channel, source) in clouds {
            *counts.entry(&source.topic).or_default() += message_count(overview, channel);
        }
        let is_missing = |&last: &u64| counts.values().all(|&count| count <= last);
        let Some(frame) = self.last_named().filter(is_missing) else {
            return Ok(());
        };
        let counts = counts.into_iter().map(|(topic, count)| (topic.to_owned(), count)).collect();
        let problem = NoCloud::NoFrame { frame, counts };
        Err(Error::NoCloud { path: overview.path.clone(), problem })
    }

    /// The first frame that is not passed over.
    pub(super) fn first(&self) -> u64 {
        match self.frames.0 {
            Bound::Included(first) => first,
            Bound::Excluded(before) => before.saturating_add(1),
            Bound::Unbounded => 0,
        }
    }

    /// The first of `count` frames that is not passed over, and the one behind the last.
    pub(super) fn clamped(&self, count: u64) -> (u64, u64) {
        let end = match self.frames.1 {
            Bound::Included(last) => last.saturating_add(1),
            Bound::Excluded(end) => end,
            Bound::Unbounded => count,
        };
        (self.first(), end.min(count))
    }

    /// The last frame that was named.
    fn last_named(&self) -> Option<u64> {
        match self.frames {
            (_, Bound::Excluded(end)) => end.checked_sub(1),
            (_, Bound::Included(last)) => Some(last),
            (Bound::Included(first), Bound::Unbounded) => Some(first),
            _ => None,
        }
    }
}
