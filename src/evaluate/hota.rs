//! Higher order tracking accuracy (Luiten et al., "HOTA: A Higher Order Metric for Evaluating
//! Multi-Object Tracking", IJCV 2020; arXiv 2009.07736), on sets of points.
//!
//! In a frame the similarity of a true object and a found instance is the IoU of their points. An
//! object is paired with one instance at most, as their authors' TrackEval does it: so that the sum
//! of similarity times alignment is largest, where the alignment of two ids is the IoU of the
//! frames in which they could be paired. At a threshold a from 0.05 to 0.95 in steps of 0.05, a
//! pair of a similarity of at least a is a true positive. Then
//!
//! - DetA = TP / (TP + FN + FP);
//! - AssA = mean over the true positives c of TPA(c) / (TPA(c) + FNA(c) + FPA(c)), of the frames
//!   with its true id, its found id, and both as a true positive;
//! - HOTA = the root of DetA times AssA.
//!
//! All three are means over the thresholds. Classes are not compared. What the paper leaves open:
//!
//! - An object counts in frames where it has more points than a minimum. The points of smaller
//!   ones leave on both sides; a found instance counts where it has more than the minimum left.
//! - A found instance that is of no thing is a false positive.

use std::collections::BTreeMap;

use serde::Serialize;

use super::overlaps::{FrameOverlaps, TrueObject};
use divmerge_core::geometry::assignment::assign;

/// Number of thresholds.
const THRESHOLDS: usize = 19;
/// Similarities are compared with a threshold within this.
const EPSILON: f64 = f64::EPSILON;

/// HOTA and its two factors, from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Hota {
    /// Mean of the root of DetA times AssA.
    pub hota: f64,
    /// Mean accuracy of detection.
    pub det_a: f64,
    /// Mean accuracy of association.
    pub ass_a: f64,
}

/// Sums over any number of sequences, and the frames of the current one, some kilobytes each: which
/// ids are paired depends on all of them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HotaSums {
    min_points: u64,
    /// Of the current sequence.
    frames: Vec<Frame>,
    thresholds: [Sums; THRESHOLDS],
}

/// Sums of a threshold.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Sums {
    pairs: u64,
    objects: u64,
    found: u64,
    /// Of all pairs: frames with both ids as a pair by frames with either.
    association: f64,
}

/// What counts in a frame.
#[derive(Debug, Clone, PartialEq)]
struct Frame {
    objects: Vec<TrueObject>,
    found: Vec<u32>,
    /// Numbers of an object and an instance of the above, and their IoU above 0.
    similarities: Vec<(usize, usize, f64)>,
}

type IdPair = (TrueObject, u32);

impl HotaSums {
    /// Empty sums; true objects count where they have more points than `min_points`.
    pub fn new(min_points: u64) -> Self {
        HotaSums { min_points, ..HotaSums::default() }
    }

    /// Adds the next frame of a sequence.
    pub fn add(&mut self, overlaps: &FrameOverlaps) {
        self.frames.push(Frame::new(overlaps, self.min_points));
    }

    /// Ends a sequence: later ids are those of other objects.
    pub fn end_sequence(&mut self) {
        let frames = std::mem::take(&mut self.frames);
        let lives = Lives::new(&frames);
        let paired: Vec<Vec<(IdPair, f64)>> =
            frames.iter().map(|frame| frame.pairs(&lives)).collect();
        for (number, sums) in self.thresholds.iter_mut().enumerate() {
            let threshold = 0.05 * (number + 1) as f64;
            let mut together: BTreeMap<IdPair, u64> = BTreeMap::new();
            let all = paired.iter().flatten();
            for (pair, _) in all.filter(|pair| pair.1 >= threshold - EPSILON) {
                *together.entry(*pair).or_default() += 1;
            }
            for ((object, id), count) in together {
                let either = lives.objects[&object] + lives.found[&id] - count;
                sums.pairs += count;
                sums.association += (count * count) as f64 / either as f64;
            }
            sums.objects += lives.objects.values().sum::<u64>();
            sums.found += lives.found.values().sum::<u64>();
        }
    }

    /// The figures of all sequences that have ended.
    pub fn hota(&self) -> Hota {
        let mean = |figure: fn(&Sums) -> f64| {
            self.thresholds.iter().map(figure).sum::<f64>() / THRESHOLDS as f64
        };
        Hota {
            hota: mean(|sums| (sums.det_a() * sums.ass_a()).sqrt()),
            det_a: mean(Sums::det_a),
            ass_a: mean(Sums::ass_a),
        }
    }
}

impl Sums {
    fn det_a(&self) -> f64 {
        let either = self.objects + self.found - self.pairs;
        self.pairs as f64 / either.max(1) as f64
    }

    fn ass_a(&self) -> f64 {
        self.association / self.pairs.max(1) as f64
    }
}

/// Numbers of frames of each object and of each found id, and how often they could be paired.
struct Lives {
    objects: BTreeMap<TrueObject, u64>,
    found: BTreeMap<u32, u64>,
    /// Sum over the frames of the share that a pair has of the similarities of either.
    both: BTreeMap<IdPair, f64>,
}

impl Lives {
    fn new(frames: &[Frame]) -> Self {
        let mut lives =
            Lives { objects: BTreeMap::new(), found: BTreeMap::new(), both: BTreeMap::new() };
        for frame in frames {
            frame.objects.iter().for_each(|&id| *lives.objects.entry(id).or_default() += 1);
            frame.found.iter().for_each(|&id| *lives.found.entry(id).or_default() += 1);
            let mut of_object = vec![0.0; frame.objects.len()];
            let mut of_found = vec![0.0; frame.found.len()];
            for &(object, id, similarity) in &frame.similarities {
                of_object[object] += similarity;
                of_found[id] += similarity;
            }
            for &(object, id, similarity) in &frame.similarities {
                let share = similarity / (of_object[object] + of_found[id] - similarity);
                *lives.both.entry((frame.objects[object], frame.found[id])).or_default() += share;
            }
        }
        lives
    }

    /// Alignment of two ids over the whole sequence, 0 to 1.
    fn alignment(&self, (object, id): IdPair) -> f64 {
        let both = self.both.get(&(object, id)).copied().unwrap_or(0.0);
        both / ((self.objects[&object] + self.found[&id]) as f64 - both)
    }
}

impl Frame {
    fn new(overlaps: &FrameOverlaps, min_points: u64) -> Self {
        let counts = |object: &TrueObject| overlaps.objects[object] > min_points;
        let mut left = overlaps.found.clone();
        for ((_, id), shared) in overlaps.both.iter().filter(|both| !counts(&both.0.0)) {
            *left.get_mut(id).expect("a found id") -= shared;
        }
        left.retain(|_, points| *points > min_points);
        let mut objects: Vec<TrueObject> =
            overlaps.objects.keys().copied().filter(counts).collect();
        let mut found: Vec<u32> = left.keys().copied().collect();
        objects.sort_unstable();
        found.sort_unstable();
        let both = overlaps.both.iter().filter_map(|(&(object, id), &shared)| {
            let numbers = (objects.binary_search(&object).ok()?, found.binary_search(&id).ok()?);
            let either = overlaps.objects[&object] + left[&id] - shared;
            Some((numbers.0, numbers.1, shared as f64 / either as f64))
        });
        let mut similarities: Vec<(usize, usize, f64)> = both.collect();
        similarities.sort_unstable_by_key(|&(object, id, _)| (object, id));
        Frame { objects, found, similarities }
    }

    /// Ids that are paired, and their similarity.
    fn pairs(&self, lives: &Lives) -> Vec<(IdPair, f64)> {
        let weight = |&(object, id, similarity): &(usize, usize, f64)| {
            let alignment = lives.alignment((self.objects[object], self.found[id]));
            (object, id, similarity * alignment)
        };
        let weights: Vec<(usize, usize, f64)> = self.similarities.iter().map(weight).collect();
        let id_of = assign(self.objects.len(), self.found.len(), &weights);
        let pairs = self.similarities.iter().filter(|pair| id_of[pair.0] == Some(pair.1));
        pairs.map(|&(object, id, iou)| ((self.objects[object], self.found[id]), iou)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of frames drawn as true objects over found ids, a letter a point, `.` for none.
    fn hota(frames: &[[&str; 2]]) -> [f64; 3] {
        let mut sums = HotaSums::new(1);
        for [truth, found] in frames {
            let id = |letter: u8| if letter == b'.' { 0 } else { u32::from(letter) };
            let object = |letter: u8| (letter != b'.').then(|| (1, id(letter)));
            let found: Vec<u32> = found.bytes().map(id).collect();
            sums.add(&FrameOverlaps::new(&found, &truth.bytes().map(object).collect::<Vec<_>>()));
        }
        sums.end_sequence();
        let Hota { hota, det_a, ass_a } = sums.hota();
        [hota, det_a, ass_a]
    }

    fn is_near(found: [f64; 3], expected: [f64; 3]) -> bool {
        found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    #[test]
    fn perfect_and_empty() {
        assert!(is_near(hota(&[["aaabbb", "xxxyyy"]; 3]), [1.0; 3]));
        assert!(is_near(hota(&[["aaa...", "......"]]), [0.0; 3]));
        assert!(is_near(hota(&[]), [0.0; 3]));
    }

    #[test]
    fn an_id_that_changes_halves_the_association() {
        let found = hota(&[["aaaa", "xxxx"], ["aaaa", "yyyy"]]);
        assert!(is_near(found, [0.5_f64.sqrt(), 1.0, 0.5]), "{found:?}");
    }

    #[test]
    fn a_similarity_of_a_half_counts_up_to_its_threshold() {
        // IoU 2 / 4 at 10 of 19 thresholds; a spurious instance of stuff in the other frame.
        let found = hota(&[["aaaa", "xx.."], ["....", "yyyy"]]);
        let share = 10.0 / 19.0;
        let expected = [share * 0.5_f64.sqrt(), share * 0.5, share];
        assert!(is_near(found, expected), "{found:?}");
    }

    #[test]
    fn small_objects_leave_on_both_sides() {
        assert!(is_near(hota(&[["aaab", "xxxy"]]), [1.0; 3]));
        assert!(is_near(hota(&[["aaab", "xxxx"]]), [1.0; 3]));
    }

    #[test]
    fn the_ids_that_agree_longest_are_paired() {
        // In the last frame x and y have half of the object each; x had it before.
        let found = hota(&[["aaaa", "xxxx"], ["aaaa", "xxxx"], ["aaaa", "yyxx"]]);
        let [low, high] = [10.0 / 19.0, 9.0 / 19.0];
        // Three pairs and one false positive below a half, two pairs, a miss and two above.
        let det_a = low * 3.0 / 4.0 + high * 2.0 / 5.0;
        let ass_a = low + high * 2.0 / 4.0;
        assert!((found[1] - det_a).abs() < 1e-12 && (found[2] - ass_a).abs() < 1e-12, "{found:?}");
    }
}
