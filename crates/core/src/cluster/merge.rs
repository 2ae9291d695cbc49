//! The merge step: components become instances on the votes alone (Alg. 2; ALGORITHM section 5).

use std::collections::VecDeque;
use std::ops::Range;

use super::params::{Accumulation, ClusterParams};
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
struct Entry {
    label: u32,
    positive: u32,
    negative: u32,
}

impl Entry {
    /// V+ / (V+ + V-) > ratio, without the division of zero by zero.
    fn exceeds(&self, ratio: f64) -> bool {
        let total = f64::from(self.positive) + f64::from(self.negative);
        self.positive > 0 && f64::from(self.positive) > ratio * total
    }

    fn plus(&self, other: &Entry) -> Entry {
        Entry {
            label: self.label,
            positive: self.positive + other.positive,
            negative: self.negative + other.negative,
        }
    }
}

/// Merges components.
///
/// Unassigned labels in ascending order; the first opens an instance and a queue; a popped target t
/// asks every unassigned query q, ascending; where V+\[t\]\[q\] outweighs V-\[t\]\[q\], q joins the
/// instance and the queue, and rows are added up. A label assigned once is never asked again, so a
/// row keeps only entries towards unassigned labels. Time and memory grow with the borders, not
/// with m squared.
pub fn merge(votes: &Votes, params: &ClusterParams) -> Merge {
    let rows = Rows::new(votes);
    let merge =
        Merge { instance_of_component: vec![0; votes.components as usize], ..Merge::default() };
    let mut assigner = Assigner { rows: &rows, merge, ratio: params.merge_ratio };
    match params.accumulation {
        Accumulation::IntoQuery => assigner.merge_into_queries(),
        Accumulation::IntoOpener => assigner.merge_into_openers(),
    }
    assigner.merge
}

/// The rows of V+ and V-, one behind the other, each ascending by label.
struct Rows {
    entries: Vec<Entry>,
    /// Row k is entries\[start\[k - 1\]..start\[k\]\].
    start: Vec<usize>,
}

impl Rows {
    fn new(votes: &Votes) -> Self {
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

    fn of(&self, label: u32) -> &[Entry] {
        &self.entries[self.start[label as usize - 1]..self.start[label as usize]]
    }
}

/// A component waiting to ask others, and what it has inherited: a part of one list.
struct Target {
    label: u32,
    inherited: Range<usize>,
}

struct Assigner<'a> {
    rows: &'a Rows,
    merge: Merge,
    ratio: f64,
}

impl Assigner<'_> {
    /// The row of a target is added to the rows of the queries that join.
    ///
    /// All queries that join one target have inherited the same when their turn comes: its entries
    /// towards labels that are still unassigned, which are those that it asked in vain. A component
    /// without votes of its own on such a label would ask it in vain as well, so an entry is handed
    /// on only while some that have votes on it have yet to ask.
    fn merge_into_queries(&mut self) {
        let components = self.merge.instance_of_component.len() as u32;
        let mut askers: Vec<u32> =
            (1..=components).map(|label| self.rows.of(label).len() as u32).collect();
        let (mut queue, mut inherited) = (VecDeque::new(), Vec::new());
        for opener in 1..=components {
            if self.instance_of(opener) != 0 {
                continue;
            }
            self.open(opener);
            inherited.clear();
            queue.push_back(Target { label: opener, inherited: 0..0 });
            while let Some(target) = queue.pop_front() {
                let rows = self.rows;
                for entry in rows.of(target.label) {
                    askers[entry.label as usize - 1] -= 1;
                }
                self.ask(&target, &askers, &mut inherited, &mut queue);
            }
        }
    }

    /// A target asks the labels in its row; `askers` tells how many components with votes on a
    /// label have yet to.
    fn ask(
        &mut self,
        target: &Target,
        askers: &[u32],
        inherited: &mut Vec<Entry>,
        queue: &mut VecDeque<Target>,
    ) {
        let (first, joined) = (inherited.len(), queue.len());
        let rows = self.rows;
        let mut next = target.inherited.start;
        for own in rows.of(target.label) {
            let below = |entry: &Entry| entry.label < own.label;
            while next < target.inherited.end && below(&inherited[next]) {
                self.hand_on(inherited[next], askers, inherited);
                next += 1;
            }
            let is_inherited = next < target.inherited.end && inherited[next].label == own.label;
            let query = if is_inherited { own.plus(&inherited[next]) } else { *own };
            next += usize::from(is_inherited);
            if self.instance_of(query.label) != 0 {
                continue;
            }
            if query.exceeds(self.ratio) {
                self.join(target.label, &query);
                queue.push_back(Target { label: query.label, inherited: 0..0 });
            } else {
                self.hand_on(query, askers, inherited);
            }
        }
        for place in next..target.inherited.end {
            self.hand_on(inherited[place], askers, inherited);
        }
        if queue.len() == joined {
            inherited.truncate(first);
        }
        let handed_on = first..inherited.len();
        queue.range_mut(joined..).for_each(|query| query.inherited = handed_on.clone());
    }

    fn hand_on(&self, entry: Entry, askers: &[u32], inherited: &mut Vec<Entry>) {
        if askers[entry.label as usize - 1] > 0 && self.instance_of(entry.label) == 0 {
            inherited.push(entry);
        }
    }

    /// The rows of those who join are added to the row of the opener while it asks; all others ask
    /// with their own.
    fn merge_into_openers(&mut self) {
        let mut queue = VecDeque::new();
        for opener in 1..=self.merge.instance_of_component.len() as u32 {
            if self.instance_of(opener) != 0 {
                continue;
            }
            self.open(opener);
            self.ask_growing(opener, &mut queue);
            while let Some(target) = queue.pop_front() {
                let rows = self.rows;
                for query in rows.of(target) {
                    if self.instance_of(query.label) == 0 && query.exceeds(self.ratio) {
                        self.join(target, query);
                        queue.push_back(query.label);
                    }
                }
            }
        }
    }

    /// The row of those who join is added to the row being scanned; labels that were passed are not
    /// asked again.
    fn ask_growing(&mut self, opener: u32, queue: &mut VecDeque<u32>) {
        let mut row = self.rows.of(opener).to_vec();
        let mut next = 0;
        while let Some(&query) = row.get(row.partition_point(|entry| entry.label <= next)) {
            next = query.label;
            if self.instance_of(query.label) == 0 && query.exceeds(self.ratio) {
                self.join(opener, &query);
                queue.push_back(query.label);
                row = self.sum(&row, self.rows.of(query.label));
            }
        }
    }

    /// Two rows added entry by entry, less the entries towards labels already assigned.
    fn sum(&self, a: &[Entry], b: &[Entry]) -> Vec<Entry> {
        let mut total = Vec::with_capacity(a.len() + b.len());
        let (mut i, mut j) = (0, 0);
        while i < a.len() || j < b.len() {
            let entry = if j == b.len() || (i < a.len() && a[i].label < b[j].label) {
                i += 1;
                a[i - 1]
            } else if i == a.len() || b[j].label < a[i].label {
                j += 1;
                b[j - 1]
            } else {
                (i, j) = (i + 1, j + 1);
                a[i - 1].plus(&b[j - 1])
            };
            if self.instance_of(entry.label) == 0 {
                total.push(entry);
            }
        }
        total
    }

    fn instance_of(&self, label: u32) -> u32 {
        self.merge.instance_of_component[label as usize - 1]
    }

    /// A label that nothing joined opens the next instance.
    fn open(&mut self, label: u32) {
        self.merge.count += 1;
        self.assign(label);
    }

    fn assign(&mut self, label: u32) {
        self.merge.instance_of_component[label as usize - 1] = self.merge.count;
    }

    fn join(&mut self, target: u32, query: &Entry) {
        self.assign(query.label);
        self.merge.steps.push(MergeStep {
            target,
            query: query.label,
            positive: u64::from(query.positive),
            negative: u64::from(query.negative),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn votes(components: u32, pairs: &[(u32, u32, u32, u32)]) -> Votes {
        let pairs =
            pairs.iter().map(|&(a, b, positive, negative)| Vote { a, b, positive, negative });
        Votes { components, pairs: pairs.collect() }
    }

    #[test]
    fn inherited_votes_carry_a_merge() {
        // 3 asks 4 with its own 2:3 and loses; with the 4:2 that 1 has towards 4 ... 1 asks 4
        // first.
        let own = votes(3, &[(1, 2, 4, 0), (2, 3, 2, 3), (1, 3, 4, 5)]);
        assert_eq!(merge(&own, &ClusterParams::paper()).instance_of_component, [1, 1, 2]);
        // 2 inherits 1's 3:2 towards 3, so that 2:3 becomes 5:5, a tie, which is no majority.
        let tie = votes(3, &[(1, 2, 4, 0), (2, 3, 3, 2), (1, 3, 2, 3)]);
        assert_eq!(merge(&tie, &ClusterParams::paper()).instance_of_component, [1, 1, 2]);
        let carried = votes(3, &[(1, 2, 4, 0), (2, 3, 4, 2), (1, 3, 2, 3)]);
        let merged = merge(&carried, &ClusterParams::paper());
        assert_eq!(merged.instance_of_component, [1, 1, 1]);
        assert_eq!((merged.steps[1].positive, merged.steps[1].negative), (6, 5));
    }

    #[test]
    fn the_opener_gathers_votes_in_the_released_code() {
        // 1 asks 2 (yes), then 3 with 1's 0:0 plus 2's 1:1: one half exceeds 0.4.
        let gathered = votes(3, &[(1, 2, 2, 0), (2, 3, 1, 1)]);
        let merged = merge(&gathered, &ClusterParams::authors());
        assert_eq!(merged.instance_of_component, [1, 1, 1]);
        assert_eq!(merged.steps[1].target, 1);
        // Labels that were passed are not asked again by the opener; 3 asks 2 with its own row.
        let passed = votes(3, &[(1, 3, 2, 0), (1, 2, 0, 9), (2, 3, 2, 0)]);
        assert_eq!(merge(&passed, &ClusterParams::authors()).steps[1].target, 3);
    }

    /// Alg. 2 with its matrices: the instance of each component.
    fn with_matrices(votes: &Votes) -> Vec<u32> {
        let m = votes.components as usize;
        let (mut plus, mut minus) = (vec![vec![0; m]; m], vec![vec![0; m]; m]);
        for vote in &votes.pairs {
            let (a, b) = (vote.a as usize - 1, vote.b as usize - 1);
            (plus[a][b], plus[b][a]) = (vote.positive, vote.positive);
            (minus[a][b], minus[b][a]) = (vote.negative, vote.negative);
        }
        let mut instance = vec![0; m];
        let mut count = 0;
        for opener in 0..m {
            if instance[opener] != 0 {
                continue;
            }
            count += 1;
            instance[opener] = count;
            let mut queue = VecDeque::from([opener]);
            while let Some(target) = queue.pop_front() {
                for query in 0..m {
                    if instance[query] == 0 && plus[target][query] > minus[target][query] {
                        instance[query] = count;
                        queue.push_back(query);
                        for i in 0..m {
                            plus[query][i] += plus[target][i];
                            minus[query][i] += minus[target][i];
                        }
                    }
                }
            }
        }
        instance
    }

    proptest::proptest! {
        /// Dense enough that rows are handed on over many merges, and close enough that they
        /// decide.
        #[test]
        fn agrees_with_matrices(
            m in 2..24_u32,
            cells in proptest::collection::vec((0..4_u8, 0..5_u32, 0..5_u32), 24 * 24),
        ) {
            let pairs = (1..=m).flat_map(|a| (a + 1..=m).map(move |b| (a, b)));
            let cell = |(a, b): (u32, u32)| (a, b, cells[(a * 24 + b) as usize % cells.len()]);
            let pairs = pairs.map(cell).filter(|(.., (kept, ..))| *kept == 0);
            let pairs: Vec<_> = pairs.map(|(a, b, (_, plus, minus))| (a, b, plus, minus)).collect();
            let votes = votes(m, &pairs);
            let merged = merge(&votes, &ClusterParams::paper());
            proptest::prop_assert_eq!(merged.instance_of_component, with_matrices(&votes));
        }
    }

    #[test]
    fn no_votes_no_merge() {
        let merged = merge(&votes(2, &[]), &ClusterParams::paper());
        assert_eq!(merged.instance_of_component, [1, 2]);
        assert_eq!(merge(&votes(0, &[]), &ClusterParams::paper()).count, 0);
    }
}
