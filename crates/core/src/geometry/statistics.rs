//! Figures that sum up a list: median, mean and deviation, the most frequent value.

use std::cmp::Ordering;

/// The median of a list, which is reordered: of an even number of values the upper of the two in
/// the middle. `None` of an empty list. O(n).
pub fn median(values: &mut [f64]) -> Option<f64> {
    median_by(values, f64::total_cmp)
}

/// The [`median`] of values in any order.
pub fn median_by<T: Copy>(values: &mut [T], order: impl FnMut(&T, &T) -> Ordering) -> Option<T> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable_by(middle, order).1)
}

/// Mean and standard deviation (of the population); 0 of an empty list.
pub fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    (mean, variance.sqrt())
}

/// The most frequent value, of several the least; `None` of an empty list. O(n log n).
pub fn most_frequent<T: Ord + Copy>(values: impl IntoIterator<Item = T>) -> Option<T> {
    let mut sorted: Vec<T> = values.into_iter().collect();
    sorted.sort_unstable();
    let runs = sorted.chunk_by(|a, b| a == b);
    let longest = runs.reduce(|longest, run| if run.len() > longest.len() { run } else { longest });
    longest.map(|run| run[0])
}

/// The candidate with the most votes, of several the first; `None` without one.
pub fn most_voted<T, V: PartialOrd>(votes: impl Iterator<Item = (T, V)>) -> Option<T> {
    let most = votes.reduce(|most, next| if next.1 > most.1 { next } else { most });
    most.map(|(candidate, _)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_by_hand() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median_by(&mut [4, 1, 3, 2], i32::cmp), Some(3));
        assert_eq!(median(&mut []), None);
    }

    #[test]
    fn mean_and_deviation_by_hand() {
        assert_eq!(mean_and_deviation(&[1.0, 3.0]), (2.0, 1.0));
        assert_eq!(mean_and_deviation(&[]), (0.0, 0.0));
    }

    #[test]
    fn ties_go_to_the_least_and_to_the_first() {
        assert_eq!(most_frequent([5, 2, 5, 2, 9]), Some(2));
        assert_eq!(most_frequent(Vec::<u8>::new()), None);
        assert_eq!(most_voted([('a', 1.0), ('b', 2.0), ('c', 2.0)].into_iter()), Some('b'));
    }
}
