//! Which chunks of a recording a filter lets a reader skip or leave unopened.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Bound;

use crate::filter::{ReadFilter, is_past};
use crate::index::{Index, IndexedChunk};
use crate::overview::Overview;

/// A stretch of the file that is skipped: whole chunks with their message indexes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Gap {
    pub(crate) start: u64,
    pub(crate) end: u64,
    /// Messages in it by numbered channel.
    pub(crate) counts: BTreeMap<u16, u64>,
}

/// A chunk that is not opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct UnopenedChunk {
    /// Where its message indexes end.
    pub(crate) end: u64,
    /// How many channels those are of.
    pub(crate) channels: usize,
}

/// What a reader need not read or open.
#[derive(Debug, Default)]
pub(crate) struct Plan {
    /// Stretches of the file that are skipped, in order.
    pub(crate) gaps: VecDeque<Gap>,
    /// Chunks that are not opened, by where they begin.
    pub(crate) unopened: BTreeMap<u64, UnopenedChunk>,
    /// Bytes of the file that were read for this plan.
    pub(crate) bytes_read: u64,
}

impl Plan {
    /// The plan for a filter. Nothing is skipped where the index is missing, unchecked or unsound.
    pub(crate) fn new(overview: &Overview, filter: &ReadFilter) -> Self {
        if !overview.from_summary || filter.passes_everything() {
            return Plan::default();
        }
        let is_numbered = |channel: u16| filter.numbered.contains_key(&channel);
        let Some(index) = Index::read(&overview.path, overview.file_size, &is_numbered) else {
            return Plan::default();
        };
        let gaps = Planner { filter, topics: BTreeMap::new() }.gaps(&index.chunks);
        let unopened = index.chunks.iter().filter(|chunk| filter.may_stay_unopened(chunk));
        let unopened = unopened
            .map(|chunk| (chunk.start, UnopenedChunk { end: chunk.end, channels: chunk.channels }));
        Plan { gaps, unopened: unopened.collect(), bytes_read: index.bytes_read }
    }

    /// Whether every record is read and opened.
    pub(crate) fn is_empty(&self) -> bool {
        self.gaps.is_empty() && self.unopened.is_empty()
    }
}

struct Planner<'a> {
    filter: &'a ReadFilter,
    /// Messages of each topic so far.
    topics: BTreeMap<&'a str, u64>,
}

impl Planner<'_> {
    fn gaps(&mut self, chunks: &[IndexedChunk]) -> VecDeque<Gap> {
        let mut gaps: VecDeque<Gap> = VecDeque::new();
        // Behind the last chunk in the window no message needs a number.
        let last = chunks.iter().rposition(|chunk| self.filter.overlaps(chunk));
        for (number, chunk) in chunks.iter().enumerate() {
            let is_past = last.is_none_or(|last| number > last) || self.is_past_all_numbers();
            let counts: BTreeMap<u16, u64> =
                if is_past { BTreeMap::new() } else { chunk.counts.iter().copied().collect() };
            let is_needed = self.is_needed(chunk, &counts, is_past);
            self.count(&counts);
            if is_needed {
                continue;
            }
            match gaps.back_mut().filter(|gap| gap.end == chunk.start) {
                Some(gap) => {
                    gap.end = chunk.end;
                    for (channel, count) in counts {
                        *gap.counts.entry(channel).or_default() += count;
                    }
                }
                None => gaps.push_back(Gap { start: chunk.start, end: chunk.end, counts }),
            }
        }
        gaps
    }

    fn is_past_all_numbers(&self) -> bool {
        let filter = self.filter;
        !filter.others
            && !matches!(filter.numbers.1, Bound::Unbounded)
            && filter.numbered.values().all(|topic| is_past(&filter.numbers, self.seen(topic)))
    }

    /// Messages of a topic so far.
    fn seen(&self, topic: &str) -> u64 {
        self.topics.get(topic).copied().unwrap_or(0)
    }

    fn is_needed(&self, chunk: &IndexedChunk, counts: &BTreeMap<u16, u64>, is_past: bool) -> bool {
        let filter = self.filter;
        // A chunk without message indexes may hold anything that has no time.
        if !chunk.has_message_indexes() {
            return true;
        }
        if is_past || !filter.overlaps(chunk) {
            return false;
        }
        let mut of_topic: BTreeMap<&str, u64> = BTreeMap::new();
        for (channel, count) in counts {
            *of_topic.entry(&filter.numbered[channel]).or_default() += count;
        }
        filter.others || of_topic.iter().any(|(topic, &n)| filter.has_number(self.seen(topic), n))
    }

    fn count(&mut self, counts: &BTreeMap<u16, u64>) {
        for (channel, count) in counts {
            *self.topics.entry(&self.filter.numbered[channel]).or_default() += count;
        }
    }
}
