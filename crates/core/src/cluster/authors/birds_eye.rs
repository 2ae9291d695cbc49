//! The released code's bird's-eye merge: one pass, in which the last writer wins.

use crate::cluster::divide_and_merge::regions::InstanceRegion;

/// One pass over all pairs i < j; j takes i's label and the union of the two boxes.
pub fn last_writer_wins(
    mut regions: Vec<Option<InstanceRegion>>,
    may_merge: impl Fn(usize, usize) -> bool,
    margin: f64,
) -> Vec<u32> {
    let mut label: Vec<usize> = (0..regions.len()).collect();
    for i in 0..regions.len() {
        let Some(first) = regions[i].clone() else {
            continue;
        };
        for j in i + 1..regions.len() {
            if let Some(second) = &mut regions[j]
                && may_merge(i, j)
                && first.overlaps(second, margin)
            {
                label[j] = label[i];
                absorb(second, &first);
            }
        }
    }
    numbered(&label)
}

/// The box of the first becomes part of the second's.
fn absorb(second: &mut InstanceRegion, first: &InstanceRegion) {
    for axis in 0..2 {
        second.low[axis] = second.low[axis].min(first.low[axis]);
        second.high[axis] = second.high[axis].max(first.high[axis]);
    }
}

/// Numbers labels from 1 in the order in which they first appear.
fn numbered(labels: &[usize]) -> Vec<u32> {
    let mut number = vec![0; labels.len()];
    let mut next = 0;
    labels
        .iter()
        .map(|&label| {
            if number[label] == 0 {
                next += 1;
                number[label] = next;
            }
            number[label]
        })
        .collect()
}
