//! How well objects are found where nothing is known of their classes (ALGORITHM section 10).
//!
//! Points without a label leave first, on both sides: those whose raw class is 0 or 1 where the
//! taxonomy ignores it (SemanticKITTI's "unlabeled" and "outlier"), and those of things without an
//! id. What is left of the truth are things with ids, and background.
//!
//! - Found whole: the share of things of `min_points` points or more with a found instance of an
//!   IoU above 0.5. Mean IoU: the mean over them of their largest IoU. S_assoc: the mean over them
//!   of the sum over found instances of the points of both times their IoU, divided by the points
//!   of the thing (3DUIS, Nunes et al. 2022).
//! - Precision and recall: a match is a thing and a found instance with an IoU above 0.5, of any
//!   size; an unmatched thing is missed from `min_points` points on, and so is an unmatched found
//!   instance spurious of which more than half lies on things. Instances of walls and bushes, for
//!   which the truth has no ids, are neither.

use serde::Serialize;

use super::overlaps::{FrameOverlaps, TrueObject};
use super::things::thing_scores;
use divmerge_core::cloud::taxonomy::Taxonomy;
use rustc_hash::{FxHashMap, FxHashSet};

/// Sums over scans.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ObjectSums {
    things: u64,
    whole: u64,
    iou: f64,
    association: f64,
    matched: u64,
    missed: u64,
    spurious: u64,
}

/// How well objects are found, from 0 to 1; `None` for a mean over nothing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectScores {
    /// True things of the minimum size or more.
    pub things: u64,
    /// Share of them with a found instance of an IoU above 0.5.
    pub found_whole: Option<f64>,
    /// Mean over them of the largest IoU of a found instance.
    pub mean_iou: Option<f64>,
    /// Mean over them of their association.
    pub s_assoc: Option<f64>,
    /// Share of matches among found instances on things, at an IoU of 0.5.
    pub precision: Option<f64>,
    /// Share of matches among true things, at an IoU of 0.5.
    pub recall: Option<f64>,
}

/// The truth of a scan of N points.
#[derive(Debug, Clone, Copy)]
pub struct ObjectTruth<'a> {
    /// N: raw class id.
    pub raw: &'a [u16],
    /// N: class number.
    pub class: &'a [u16],
    /// N: instance, 0 for none.
    pub instance: &'a [u32],
}

impl ObjectSums {
    /// Adds a scan; `found` has an instance for each point, 0 for none.
    ///
    /// # Panics
    /// If columns differ in length.
    pub fn add(&mut self, found: &[u32], truth: ObjectTruth, taxonomy: &Taxonomy, min_points: u64) {
        let (found, objects) = labelled_points(found, truth, taxonomy);
        let mut number: FxHashMap<TrueObject, u32> = FxHashMap::default();
        let ids = objects.iter().map(|object| {
            let next = number.len() as u32 + 1;
            object.map_or(0, |object| *number.entry(object).or_insert(next))
        });
        let ids: Vec<u32> = ids.collect();
        for score in thing_scores(&ids, &found, 1) {
            let is_large = score.points as u64 >= min_points;
            self.matched += u64::from(score.is_whole());
            self.missed += u64::from(is_large && !score.is_whole());
            if is_large {
                self.things += 1;
                self.whole += u64::from(score.is_whole());
                self.iou += score.iou;
                self.association += score.association;
            }
        }
        self.spurious += spurious(&FrameOverlaps::new(&found, &objects), min_points);
    }

    /// The scores of all scans.
    pub fn scores(&self) -> ObjectScores {
        let share = |part: f64, all: u64| (all > 0).then(|| part / all as f64);
        let matched = self.matched as f64;
        ObjectScores {
            things: self.things,
            found_whole: share(self.whole as f64, self.things),
            mean_iou: share(self.iou, self.things),
            s_assoc: share(self.association, self.things),
            precision: share(matched, self.matched + self.spurious),
            recall: share(matched, self.matched + self.missed),
        }
    }
}

/// Of the points that have a label: found instances and true objects.
fn labelled_points(
    found: &[u32],
    truth: ObjectTruth,
    taxonomy: &Taxonomy,
) -> (Vec<u32>, Vec<Option<TrueObject>>) {
    let ObjectTruth { raw, class, instance } = truth;
    assert!(
        [raw.len(), class.len(), instance.len()] == [found.len(); 3],
        "columns of different length"
    );
    let classes = taxonomy.classes();
    let point = |at: usize| {
        let class = &classes[usize::from(class[at])];
        let is_unlabelled = raw[at] <= 1 && class.is_ignored;
        let is_labelled = !is_unlabelled && (!class.is_thing || instance[at] != 0);
        let object = class.is_thing.then_some((raw[at], instance[at]));
        is_labelled.then_some((found[at], object))
    };
    (0..found.len()).filter_map(point).unzip()
}

/// Unmatched found instances of at least so many points of which more than half lies on things.
fn spurious(overlaps: &FrameOverlaps, min_points: u64) -> u64 {
    let matched: FxHashSet<u32> = overlaps.matches().into_values().collect();
    let mut on_things: FxHashMap<u32, u64> = FxHashMap::default();
    for (&(_, id), &shared) in &overlaps.both {
        *on_things.entry(id).or_default() += shared;
    }
    let is_spurious = |(id, points): (&u32, &u64)| {
        let on_things = on_things.get(id).copied().unwrap_or(0);
        *points >= min_points && 2 * on_things > *points && !matched.contains(id)
    };
    overlaps.found.iter().filter(|&found| is_spurious(found)).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sums of one scan given as runs of (points, raw class, true instance, found instance).
    fn sums(runs: &[(usize, u16, u32, u32)], min_points: u64) -> ObjectSums {
        let taxonomy = Taxonomy::semantic_kitti();
        let column = |of: fn(&(usize, u16, u32, u32)) -> u32| -> Vec<u32> {
            runs.iter().flat_map(|run| vec![of(run); run.0]).collect()
        };
        let raw: Vec<u16> = column(|run| run.1.into()).iter().map(|&raw| raw as u16).collect();
        let class = taxonomy.known_class_numbers(&raw).unwrap();
        let (instance, found) = (column(|run| run.2), column(|run| run.3));
        let truth = ObjectTruth { raw: &raw, class: &class, instance: &instance };
        let mut sums = ObjectSums::default();
        sums.add(&found, truth, &taxonomy, min_points);
        sums
    }

    #[test]
    fn by_hand() {
        let sums = sums(
            &[
                // A car: 6 of 10 points in instance 1, which holds 2 points of a wall: IoU 6 / 12.
                (6, 10, 1, 1),
                (4, 10, 1, 0),
                (2, 50, 0, 1),
                // A moving car, whole but for a point that has no label.
                (9, 252, 2, 2),
                (1, 1, 2, 2),
                // A person in halves of 4 and 4: one of them spurious, both if they count from 4.
                (4, 30, 3, 3),
                (4, 30, 3, 4),
                // Too small to be missed, but found; and too small and not found.
                (3, 30, 4, 5),
                (3, 30, 5, 0),
                // A car without an id, and a wall, of which nothing is said.
                (20, 10, 0, 6),
                (20, 50, 0, 7),
            ],
            5,
        );
        assert_eq!((sums.things, sums.whole, sums.matched), (3, 1, 2));
        // Instance 1 lies on the car by 6 of its 8 points.
        assert_eq!((sums.missed, sums.spurious), (2, 1));
        let scores = sums.scores();
        let near = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 1e-12;
        assert!(near(scores.found_whole, 1.0 / 3.0));
        assert!(near(scores.mean_iou, (0.5 + 1.0 + 0.5) / 3.0));
        assert!(near(scores.s_assoc, (6.0 * 0.5 / 10.0 + 1.0 + 0.5) / 3.0));
        assert!(near(scores.precision, 2.0 / 3.0) && near(scores.recall, 2.0 / 4.0));
    }

    #[test]
    fn halves_are_spurious_from_the_minimum_size_on() {
        let halves = [(4, 30, 3, 3), (4, 30, 3, 4)];
        assert_eq!(sums(&halves, 4).spurious, 2);
        assert_eq!(sums(&halves, 5).spurious, 0);
    }

    #[test]
    fn a_mean_over_nothing_is_no_number() {
        let scores = sums(&[(60, 50, 0, 1)], 50).scores();
        assert_eq!((scores.things, scores.found_whole, scores.precision), (0, None, None));
    }
}
