//! The assignment of rows to columns of most weight (Kuhn 1955, Munkres 1957), which is crate
//! `pathfinding`'s, for few pairs of many.

use std::collections::BTreeMap;

use pathfinding::kuhn_munkres::kuhn_munkres;
use pathfinding::matrix::Matrix;

use super::disjoint_sets::DisjointSets;

/// Weights are compared in steps of this.
const STEP: f64 = 1e-12;

/// By row the column that it is assigned, each column to one row at most, so that the sum of the
/// weights is largest. `pairs` are (row, column, weight above 0 to 1), each pair once.
///
/// Pairs that share no row and no column, even by others, are solved apart, each group in the cube
/// of its size.
///
/// ```
/// use divmerge_core::geometry::assignment::assign;
///
/// // Taking 0.9 first leaves row 1 without a column.
/// let pairs = [(0, 0, 0.9), (0, 1, 0.8), (1, 0, 0.7)];
/// assert_eq!(assign(2, 2, &pairs), [Some(1), Some(0)]);
/// ```
pub fn assign(rows: usize, columns: usize, pairs: &[(usize, usize, f64)]) -> Vec<Option<usize>> {
    let mut sets = DisjointSets::new(rows + columns);
    for &(row, column, _) in pairs {
        sets.join(row, rows + column);
    }
    let mut groups: BTreeMap<usize, Vec<(usize, usize, f64)>> = BTreeMap::new();
    for &pair in pairs {
        groups.entry(sets.root(pair.0)).or_default().push(pair);
    }
    let mut column_of = vec![None; rows];
    for (row, column) in groups.values().flat_map(|group| assign_group(group)) {
        column_of[row] = Some(column);
    }
    column_of
}

fn assign_group(pairs: &[(usize, usize, f64)]) -> Vec<(usize, usize)> {
    if let [(row, column, _)] = *pairs {
        return vec![(row, column)];
    }
    let rows = distinct(pairs.iter().map(|pair| pair.0));
    let columns = distinct(pairs.iter().map(|pair| pair.1));
    // The crate wants no more rows than columns.
    let is_turned = rows.len() > columns.len();
    let (short, long) = if is_turned { (&columns, &rows) } else { (&rows, &columns) };
    let mut weights = Matrix::new(short.len(), long.len(), 0_i64);
    for &(row, column, weight) in pairs {
        let (a, b) = if is_turned { (column, row) } else { (row, column) };
        let place = (short.partition_point(|&at| at < a), long.partition_point(|&at| at < b));
        weights[place] = (weight / STEP).round() as i64;
    }
    let (_, chosen) = kuhn_munkres(&weights);
    let chosen = chosen.into_iter().enumerate().filter(|&place| weights[place] > 0);
    let named = chosen.map(|(a, b)| match is_turned {
        true => (long[b], short[a]),
        false => (short[a], long[b]),
    });
    named.collect()
}

fn distinct(numbers: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut numbers: Vec<usize> = numbers.collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_apart_and_none() {
        assert_eq!(assign(2, 3, &[(1, 2, 0.3)]), [None, Some(2)]);
        let two_groups = [(0, 0, 0.1), (2, 3, 0.6), (2, 1, 0.5), (1, 3, 0.4)];
        assert_eq!(assign(3, 4, &two_groups), [Some(0), Some(3), Some(1)]);
        assert_eq!(assign(0, 2, &[]), []);
    }

    #[test]
    fn more_rows_than_columns_and_the_reverse() {
        let many = [(0, 0, 0.2), (1, 0, 0.6), (2, 0, 0.4)];
        assert_eq!(assign(3, 1, &many), [None, Some(0), None]);
        let few = [(0, 0, 0.2), (0, 1, 0.6), (0, 2, 0.4)];
        assert_eq!(assign(1, 3, &few), [Some(1)]);
    }
}
