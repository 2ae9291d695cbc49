//! Which instance each track continues in: the assignment of most affinity (Kuhn 1955, Munkres
//! 1957), which is crate `pathfinding`'s.

use std::collections::BTreeMap;

use pathfinding::kuhn_munkres::kuhn_munkres;
use pathfinding::matrix::Matrix;

use crate::geometry::disjoint_sets::DisjointSets;

/// A track and an instance of a frame by their numbers, and how well they agree, above 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pair {
    pub track: usize,
    pub instance: usize,
    pub affinity: f64,
}

/// By instance the track that it is given, each track to one at most, so that the sum of the
/// affinities is largest. Pairs that share no track and no instance, even by others, are solved
/// apart.
pub(super) fn assign(tracks: usize, instances: usize, pairs: &[Pair]) -> Vec<Option<usize>> {
    let mut sets = DisjointSets::new(tracks + instances);
    for pair in pairs {
        sets.join(pair.track, tracks + pair.instance);
    }
    let mut groups: BTreeMap<usize, Vec<Pair>> = BTreeMap::new();
    for pair in pairs {
        groups.entry(sets.root(pair.track)).or_default().push(*pair);
    }
    let mut track_of = vec![None; instances];
    for group in groups.values() {
        for (track, instance) in assign_group(group) {
            track_of[instance] = Some(track);
        }
    }
    track_of
}

fn assign_group(pairs: &[Pair]) -> Vec<(usize, usize)> {
    if let [Pair { track, instance, .. }] = *pairs {
        return vec![(track, instance)];
    }
    let tracks = sorted(pairs.iter().map(|pair| pair.track));
    let instances = sorted(pairs.iter().map(|pair| pair.instance));
    // The crate wants no more rows than columns.
    let turned = tracks.len() > instances.len();
    let (rows, columns) = if turned { (&instances, &tracks) } else { (&tracks, &instances) };
    let mut weights = Matrix::new(rows.len(), columns.len(), 0_i64);
    for &Pair { track, instance, affinity } in pairs {
        let (row, column) = if turned { (instance, track) } else { (track, instance) };
        let place =
            (rows.partition_point(|&at| at < row), columns.partition_point(|&at| at < column));
        weights[place] = (affinity * 1e6).round() as i64;
    }
    let (_, chosen) = kuhn_munkres(&weights);
    let chosen = chosen.into_iter().enumerate().filter(|&place| weights[place] > 0);
    let named = chosen.map(|(row, column)| match turned {
        true => (columns[column], rows[row]),
        false => (rows[row], columns[column]),
    });
    named.collect()
}

fn sorted(numbers: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut numbers: Vec<usize> = numbers.collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(track: usize, instance: usize, affinity: f64) -> Pair {
        Pair { track, instance, affinity }
    }

    #[test]
    fn the_sum_is_largest_not_the_first() {
        // Taking 0.9 first leaves track 1 without an instance.
        let pairs = [pair(0, 0, 0.9), pair(0, 1, 0.8), pair(1, 0, 0.7)];
        assert_eq!(assign(2, 2, &pairs), [Some(1), Some(0)]);
        let alone = [pair(1, 2, 0.3)];
        assert_eq!(assign(2, 3, &alone), [None, None, Some(1)]);
    }

    #[test]
    fn more_tracks_than_instances_and_the_reverse() {
        let many = [pair(0, 0, 0.2), pair(1, 0, 0.6), pair(2, 0, 0.4)];
        assert_eq!(assign(3, 1, &many), [Some(1)]);
        let few = [pair(0, 0, 0.2), pair(0, 1, 0.6), pair(0, 2, 0.4)];
        assert_eq!(assign(1, 3, &few), [None, Some(0), None]);
        assert_eq!(assign(0, 2, &[]), [None, None]);
    }
}
