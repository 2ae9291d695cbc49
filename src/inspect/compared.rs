//! What a second setting makes different.

use serde_json::{Value, json};

use super::run::Run;
use crate::evaluate::difference::{Difference, differences};

/// The differences between two runs of one cloud, those of the most points first, with their number
/// by kind.
pub(super) fn compared(first: &Run, second: &Run) -> Value {
    let [a, b] = [first, second].map(|run| &run.stages.labels.instance);
    let found = differences(a, b);
    let counts = counts_by_name(found.iter().map(|one| one.change.name()));
    let row = |one: &Difference| {
        json!({
            "change": one.change.name(),
            "first": one.first,
            "second": one.second,
            "points": one.points,
            "example": one.example,
        })
    };
    let points = a.iter().zip(b).filter(|(a, b)| (**a == 0) != (**b == 0)).count();
    json!({
        "differences": found.iter().map(row).collect::<Vec<_>>(),
        "counts": counts,
        "instances": [first.stages.instances.len(), second.stages.instances.len()],
        "points_with_and_without": points,
    })
}

/// How often each name comes, in the order in which they first come.
pub(super) fn counts_by_name<'a>(names: impl Iterator<Item = &'a str>) -> Vec<(&'a str, usize)> {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for name in names {
        match counts.iter_mut().find(|(other, _)| *other == name) {
            Some((_, count)) => *count += 1,
            None => counts.push((name, 1)),
        }
    }
    counts
}
