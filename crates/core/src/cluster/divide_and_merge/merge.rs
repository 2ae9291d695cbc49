//! The merge step: components become instances on the votes alone (Alg. 2; ALGORITHM section 5).

use std::collections::VecDeque;
use std::ops::Range;

use super::assigner::{Assigner, Entry, Merge, Rows};
use super::votes::Votes;
use crate::cluster::params::{Accumulation, ClusterParams};

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

/// A component waiting to ask others, and what it has inherited: a part of one list.
struct Target {
    label: u32,
    inherited: Range<usize>,
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
