//! Differences between the instances of two runs over one cloud, neither of which is the truth.

use rustc_hash::FxHashMap;
use serde::Serialize;

use divmerge_core::geometry::disjoint_sets::DisjointSets;

/// How instances of two runs differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Change {
    /// One of the first run is several of the second.
    Split,
    /// Several of the first run are one of the second.
    Joined,
    /// Several of the first run are divided into several others.
    Recut,
    /// One of the first run is one of the second, with other points.
    Reshaped,
    /// It has no counterpart in the second run.
    OnlyFirst,
    /// It has no counterpart in the first run.
    OnlySecond,
}

impl Change {
    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Change::Split => "split",
            Change::Joined => "joined",
            Change::Recut => "recut",
            Change::Reshaped => "reshaped",
            Change::OnlyFirst => "only in the first",
            Change::OnlySecond => "only in the second",
        }
    }
}

/// Instances that differ, with those of the other run that they lie in.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// How they differ.
    pub change: Change,
    /// Instances of the first run, ascending.
    pub first: Vec<u32>,
    /// Instances of the second run, ascending.
    pub second: Vec<u32>,
    /// Number of points in any of these instances but not in both of the pair with the most points
    /// in common.
    pub points: u64,
    /// Index of one of these points.
    pub example: u32,
}

/// An instance: whether it is of the second run, and its number.
type Node = (bool, u32);

/// The differences between two runs over N points, those of the most points first. 0 is no
/// instance.
///
/// Instances belong together if more than half of one of them lies in the other.
///
/// # Panics
/// If the two differ in length.
pub fn differences(first: &[u32], second: &[u32]) -> Vec<Difference> {
    assert_eq!(first.len(), second.len(), "runs over clouds of different size");
    let mut shared: FxHashMap<(u32, u32), u64> = FxHashMap::default();
    let mut size: FxHashMap<Node, u64> = FxHashMap::default();
    for pair in first.iter().copied().zip(second.iter().copied()) {
        *shared.entry(pair).or_default() += 1;
        *size.entry((false, pair.0)).or_default() += 1;
        *size.entry((true, pair.1)).or_default() += 1;
    }
    let mut nodes: Vec<Node> = size.keys().copied().filter(|node| node.1 != 0).collect();
    nodes.sort_unstable();
    let place: FxHashMap<Node, usize> = nodes.iter().copied().zip(0..).collect();
    let mut sets = DisjointSets::new(nodes.len());
    for (&(a, b), &points) in shared.iter().filter(|&(&(a, b), _)| a != 0 && b != 0) {
        let (a, b) = ((false, a), (true, b));
        if 2 * points > size[&a].min(size[&b]) {
            sets.join(place[&a], place[&b]);
        }
    }
    let number = sets.numbered();
    let mut groups = vec![Group::default(); number.iter().max().map_or(0, |&n| n as usize)];
    for (&(is_second, id), &number) in nodes.iter().zip(&number) {
        let group = &mut groups[number as usize - 1];
        if is_second { group.second.push(id) } else { group.first.push(id) }
    }
    let group_of = |node: Node| (node.1 != 0).then(|| number[place[&node]] as usize - 1);
    for (&(a, b), &points) in &shared {
        let (own, other) = (group_of((false, a)), group_of((true, b)));
        for group in [own, other.filter(|_| own != other)].into_iter().flatten() {
            groups[group].add((a, b), points, own == other);
        }
    }
    let mut differing = vec![None; groups.len()];
    for (point, pair) in (0_u32..).zip(first.iter().copied().zip(second.iter().copied())) {
        for group in [group_of((false, pair.0)), group_of((true, pair.1))].into_iter().flatten() {
            if groups[group].best.is_none_or(|(best, _)| best != pair) {
                differing[group].get_or_insert(point);
            }
        }
    }
    let found = groups.into_iter().zip(differing);
    let mut found: Vec<Difference> =
        found.filter_map(|(group, example)| Some(group.difference(example?))).collect();
    found.sort_by_key(|found| (std::cmp::Reverse(found.points), found.example));
    found
}

/// Instances that belong together.
#[derive(Debug, Clone, Default)]
struct Group {
    first: Vec<u32>,
    second: Vec<u32>,
    points: u64,
    /// The pair with the most points in common, and how many.
    best: Option<((u32, u32), u64)>,
}

impl Group {
    fn add(&mut self, pair: (u32, u32), points: u64, is_inside: bool) {
        self.points += points;
        let key = |(pair, points): ((u32, u32), u64)| (points, std::cmp::Reverse(pair));
        if is_inside && self.best.is_none_or(|best| key(best) < key((pair, points))) {
            self.best = Some((pair, points));
        }
    }

    fn difference(self, example: u32) -> Difference {
        let change = match (self.first.len(), self.second.len()) {
            (_, 0) => Change::OnlyFirst,
            (0, _) => Change::OnlySecond,
            (1, 1) => Change::Reshaped,
            (1, _) => Change::Split,
            (_, 1) => Change::Joined,
            _ => Change::Recut,
        };
        let points = self.points - self.best.map_or(0, |(_, points)| points);
        let Group { first, second, .. } = self;
        Difference { change, first, second, points, example }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Change, instances of both sides, points, example.
    type Row = (Change, Vec<u32>, Vec<u32>, u64, u32);

    fn of(first: &[u32], second: &[u32]) -> Vec<Row> {
        let found = differences(first, second).into_iter();
        found.map(|d| (d.change, d.first, d.second, d.points, d.example)).collect()
    }

    #[test]
    fn other_numbers_are_no_difference() {
        assert!(of(&[1, 1, 2, 0], &[7, 7, 3, 0]).is_empty());
        assert!(of(&[], &[]).is_empty());
    }

    #[test]
    fn split_joined_and_recut() {
        let split = of(&[1, 1, 1, 1, 1], &[1, 1, 1, 2, 2]);
        assert_eq!(split, [(Change::Split, vec![1], vec![1, 2], 2, 3)]);
        let joined = of(&[1, 1, 1, 2, 2], &[4, 4, 4, 4, 4]);
        assert_eq!(joined, [(Change::Joined, vec![1, 2], vec![4], 2, 3)]);
        // The end of 1 goes with 2: a border that was moved.
        let moved = of(&[1, 1, 1, 2, 2], &[1, 1, 2, 2, 2]);
        let expected = [
            (Change::Reshaped, vec![1], vec![1], 1, 2),
            (Change::Reshaped, vec![2], vec![2], 1, 2),
        ];
        assert_eq!(moved, expected);
        // Most of 1 goes with 2, and the rest is alone.
        let recut = of(&[1, 1, 1, 1, 1, 1, 2, 2], &[5, 5, 6, 6, 6, 6, 6, 6]);
        assert_eq!(recut, [(Change::Recut, vec![1, 2], vec![5, 6], 4, 0)]);
    }

    #[test]
    fn lost_and_new_ones_and_the_worst_first() {
        let found = of(&[1, 1, 0, 0, 0, 3, 3, 3], &[0, 0, 2, 2, 2, 3, 3, 0]);
        let expected = [
            (Change::OnlySecond, vec![], vec![2], 3, 2),
            (Change::OnlyFirst, vec![1], vec![], 2, 0),
            (Change::Reshaped, vec![3], vec![3], 1, 7),
        ];
        assert_eq!(found, expected);
    }

    proptest::proptest! {
        /// Swapping the runs swaps the sides and leaves the points.
        #[test]
        fn symmetric(runs in proptest::collection::vec((0..5_u32, 0..5_u32), 0..60)) {
            let (first, second): (Vec<u32>, Vec<u32>) = runs.into_iter().unzip();
            let there = differences(&first, &second);
            let mut back = differences(&second, &first);
            for found in &mut back {
                std::mem::swap(&mut found.first, &mut found.second);
            }
            let key = |d: &Difference| (d.first.clone(), d.second.clone(), d.points);
            let sorted = |all: &[Difference]| {
                let mut keys: Vec<_> = all.iter().map(key).collect();
                keys.sort();
                keys
            };
            assert_eq!(sorted(&there), sorted(&back));
        }
    }
}
