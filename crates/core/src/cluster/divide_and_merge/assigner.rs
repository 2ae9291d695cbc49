//! The state of the merge step: rows of votes, and which component belongs to which instance.

use super::votes::{Vote, Votes};

/// One decision of the merge: `query` joined the instance of `target`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MergeStep {
    /// The component whose row decided.
    pub target: u32,
    /// The component that joined.
    pub query: u32,
    /// V+ of the pair at that moment, with what the row had inherited.
    pub positive: u64,
    /// V- of the pair at that moment.
    pub negative: u64,
}

/// The instances of the merge step.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Merge {
    /// m: instance of each component from 1, in the order in which instances were opened; component
    /// k is at k - 1.
    pub instance_of_component: Vec<u32>,
    /// Number of instances.
    pub count: u32,
    /// Every merge in the order in which it happened.
    pub steps: Vec<MergeStep>,
}

/// Votes of one component towards one other. Sums of them are no more than all votes of a frame.
#[derive(Debug, Clone, Copy)]
pub(in crate::cluster) struct Entry {
    pub label: u32,
    pub positive: u32,
    pub negative: u32,
}

impl Entry {
    /// V+ / (V+ + V-) > ratio, without the division of zero by zero.
    pub fn exceeds(&self, ratio: f64) -> bool {
        let total = f64::from(self.positive) + f64::from(self.negative);
        self.positive > 0 && f64::from(self.positive) > ratio * total
    }

    pub fn plus(&self, other: &Entry) -> Entry {
        Entry {
            label: self.label,
            positive: self.positive + other.positive,
            negative: self.negative + other.negative,
        }
    }
}

/// The rows of V+ and V-, one behind the other, each ascending by label.
pub(in crate::cluster) struct Rows {
    entries: Vec<Entry>,
    /// Row k is entries\[start\[k - 1\]..start\[k\]\].
    start: Vec<usize>,
}

impl Rows {
    pub fn new(votes: &Votes) -> Self {
        let mut start = vec![0; votes.components as usize + 2];
        for vote in &votes.pairs {
            start[vote.a as usize + 1] += 1;
            start[vote.b as usize + 1] += 1;
        }
        for label in 1..start.len() {
            start[label] += start[label - 1];
        }
        let mut entries = vec![Entry { label: 0, positive: 0, negative: 0 }; 2 * votes.pairs.len()];
        let mut add = |row: u32, label: u32, vote: &Vote| {
            let next = &mut start[row as usize];
            let (positive, negative) = (vote.positive, vote.negative);
            entries[*next] = Entry { label, positive, negative };
            *next += 1;
        };
        // Pairs are sorted by (a, b). So come the labels below a row's own, and then those above.
        for vote in &votes.pairs {
            add(vote.b, vote.a, vote);
        }
        for vote in &votes.pairs {
            add(vote.a, vote.b, vote);
        }
        Rows { entries, start }
    }

    pub fn of(&self, label: u32) -> &[Entry] {
        &self.entries[self.start[label as usize - 1]..self.start[label as usize]]
    }
}

/// Instances while components are assigned to them.
pub(in crate::cluster) struct Assigner<'a> {
    pub rows: &'a Rows,
    pub merge: Merge,
    pub ratio: f64,
}

impl Assigner<'_> {
    pub fn instance_of(&self, label: u32) -> u32 {
        self.merge.instance_of_component[label as usize - 1]
    }

    /// A label that nothing joined opens the next instance.
    pub fn open(&mut self, label: u32) {
        self.merge.count += 1;
        self.assign(label);
    }

    fn assign(&mut self, label: u32) {
        self.merge.instance_of_component[label as usize - 1] = self.merge.count;
    }

    pub fn join(&mut self, target: u32, query: &Entry) {
        self.assign(query.label);
        self.merge.steps.push(MergeStep {
            target,
            query: query.label,
            positive: u64::from(query.positive),
            negative: u64::from(query.negative),
        });
    }
}
