//! The merge step: components become instances on the votes alone (Alg. 2; ALGORITHM section 5).

use std::collections::VecDeque;

use super::params::{Accumulation, ClusterParams};
use super::votes::Votes;

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
    /// m: instance of each component from 1, in the order in which instances were opened; component k is
    /// at k - 1.
    pub instance_of_component: Vec<u32>,
    /// Number of instances.
    pub count: u32,
    /// Every merge in the order in which it happened.
    pub steps: Vec<MergeStep>,
}

/// Votes of one component towards one other.
#[derive(Debug, Clone, Copy)]
struct Entry {
    label: u32,
    positive: u64,
    negative: u64,
}

impl Entry {
    /// V+ / (V+ + V-) > ratio, without the division of zero by zero.
    fn exceeds(&self, ratio: f64) -> bool {
        let total = (self.positive + self.negative) as f64;
        self.positive > 0 && self.positive as f64 > ratio * total
    }
}

/// A component's row of V+ and V-, ascending by label.
type Row = Vec<Entry>;

/// Merges components.
///
/// Unassigned labels in ascending order; the first opens an instance and a queue; a popped target t asks
/// every unassigned query q, ascending; where V+\[t\]\[q\] outweighs V-\[t\]\[q\], q joins the instance
/// and the queue, and rows are added up. A label assigned once is never asked again, so a row keeps only
/// entries towards unassigned labels. Time and memory grow with the borders, not with m squared.
pub fn merge(votes: &Votes, params: &ClusterParams) -> Merge {
    let mut rows = rows(votes);
    let mut merge =
        Merge { instance_of_component: vec![0; votes.components as usize], ..Merge::default() };
    let mut queue = VecDeque::new();
    for opener in 1..=votes.components {
        if merge.instance_of(opener) != 0 {
            continue;
        }
        merge.count += 1;
        merge.assign(opener);
        queue.push_back(opener);
        while let Some(target) = queue.pop_front() {
            let row = std::mem::take(&mut rows[target as usize - 1]);
            let into_target = params.accumulation == Accumulation::IntoOpener;
            if into_target && target == opener {
                scan_growing(target, row, &mut rows, &mut merge, &mut queue, params);
            } else {
                scan(target, row, &mut rows, &mut merge, &mut queue, params);
            }
        }
    }
    merge
}

impl Merge {
    fn instance_of(&self, label: u32) -> u32 {
        self.instance_of_component[label as usize - 1]
    }

    fn assign(&mut self, label: u32) {
        self.instance_of_component[label as usize - 1] = self.count;
    }

    fn join(&mut self, target: u32, query: &Entry) {
        self.assign(query.label);
        self.steps.push(MergeStep {
            target,
            query: query.label,
            positive: query.positive,
            negative: query.negative,
        });
    }
}

fn rows(votes: &Votes) -> Vec<Row> {
    let mut rows: Vec<Row> = vec![Row::new(); votes.components as usize];
    let mut add = |row: u32, label: u32, vote: &super::votes::Vote| {
        rows[row as usize - 1].push(Entry {
            label,
            positive: u64::from(vote.positive),
            negative: u64::from(vote.negative),
        });
    };
    for vote in &votes.pairs {
        add(vote.a, vote.b, vote);
        add(vote.b, vote.a, vote);
    }
    // Pairs are sorted by (a, b): entries below the row's own label came in order, those above too, but
    // not one after the other.
    for row in &mut rows {
        row.sort_unstable_by_key(|entry| entry.label);
    }
    rows
}

/// The row of `target` stays as it is; with [`Accumulation::IntoQuery`] it is handed to those who join.
fn scan(
    target: u32,
    row: Row,
    rows: &mut [Row],
    merge: &mut Merge,
    queue: &mut VecDeque<u32>,
    params: &ClusterParams,
) {
    for query in &row {
        if merge.instance_of(query.label) == 0 && query.exceeds(params.merge_ratio) {
            merge.join(target, query);
            queue.push_back(query.label);
            if params.accumulation == Accumulation::IntoQuery {
                let own = std::mem::take(&mut rows[query.label as usize - 1]);
                rows[query.label as usize - 1] = sum(&own, &row, merge);
            }
        }
    }
}

/// The row of those who join is added to the row being scanned; labels that were passed are not asked
/// again.
fn scan_growing(
    target: u32,
    mut row: Row,
    rows: &mut [Row],
    merge: &mut Merge,
    queue: &mut VecDeque<u32>,
    params: &ClusterParams,
) {
    let mut next = 0;
    while let Some(&query) = row.get(row.partition_point(|entry| entry.label <= next)) {
        next = query.label;
        if merge.instance_of(query.label) == 0 && query.exceeds(params.merge_ratio) {
            merge.join(target, &query);
            queue.push_back(query.label);
            row = sum(&row, &rows[query.label as usize - 1], merge);
        }
    }
}

/// Two rows added entry by entry, less the entries towards labels already assigned.
fn sum(a: &[Entry], b: &[Entry], merge: &Merge) -> Row {
    let mut total = Row::with_capacity(a.len() + b.len());
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
            Entry {
                label: a[i - 1].label,
                positive: a[i - 1].positive + b[j - 1].positive,
                negative: a[i - 1].negative + b[j - 1].negative,
            }
        };
        if merge.instance_of(entry.label) == 0 {
            total.push(entry);
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::super::votes::Vote;
    use super::*;

    fn votes(components: u32, pairs: &[(u32, u32, u32, u32)]) -> Votes {
        let pairs =
            pairs.iter().map(|&(a, b, positive, negative)| Vote { a, b, positive, negative });
        Votes { components, pairs: pairs.collect() }
    }

    #[test]
    fn inherited_votes_carry_a_merge() {
        // 3 asks 4 with its own 2:3 and loses; with the 4:2 that 1 has towards 4 ... 1 asks 4 first.
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

    #[test]
    fn no_votes_no_merge() {
        let merged = merge(&votes(2, &[]), &ClusterParams::paper());
        assert_eq!(merged.instance_of_component, [1, 2]);
        assert_eq!(merge(&votes(0, &[]), &ClusterParams::paper()).count, 0);
    }
}
