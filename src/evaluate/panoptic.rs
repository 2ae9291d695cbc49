//! Panoptic quality after semantic-kitti-api's rules (Kirillov et al. 2019; Behley et al. 2020;
//! ALGORITHM section 9).

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use divmerge_core::cloud::taxonomy::Taxonomy;

/// An unmatched segment counts as false from this many points on; a match counts whatever its size.
pub const MIN_POINTS: u64 = 50;

/// Sums over any number of frames, from which the figures are computed.
#[derive(Debug, Clone, PartialEq)]
pub struct Panoptic {
    classes: usize,
    ignored: Vec<bool>,
    min_points: u64,
    iou_sum: Vec<f64>,
    true_positives: Vec<u64>,
    false_positives: Vec<u64>,
    false_negatives: Vec<u64>,
    /// classes x classes points, \[predicted\]\[true\].
    confusion: Vec<u64>,
}

/// The figures of one class.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClassQuality {
    /// Panoptic quality, SQ times RQ.
    pub pq: f64,
    /// Segmentation quality: mean IoU of the matches.
    pub sq: f64,
    /// Recognition quality: F1 of the matches.
    pub rq: f64,
    /// Intersection over union of the class's points, whatever the instances.
    pub iou: f64,
    /// Matches.
    pub true_positives: u64,
    /// Predicted segments without a match.
    pub false_positives: u64,
    /// True segments without a match.
    pub false_negatives: u64,
}

/// Means over classes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PanopticQuality {
    /// Panoptic quality.
    pub pq: f64,
    /// Segmentation quality.
    pub sq: f64,
    /// Recognition quality.
    pub rq: f64,
    /// Mean IoU.
    pub miou: f64,
}

/// Class and id of a segment.
type SegmentKey = (u16, u32);

impl Panoptic {
    /// Empty sums over `classes` class numbers; points of ignored true classes are left out.
    pub fn new(classes: usize, is_ignored: impl Fn(usize) -> bool, min_points: u64) -> Self {
        Panoptic {
            classes,
            ignored: (0..classes).map(is_ignored).collect(),
            min_points,
            iou_sum: vec![0.0; classes],
            true_positives: vec![0; classes],
            false_positives: vec![0; classes],
            false_negatives: vec![0; classes],
            confusion: vec![0; classes * classes],
        }
    }

    /// Empty sums over the classes of a taxonomy.
    pub fn of(taxonomy: &Taxonomy, min_points: u64) -> Self {
        let classes = taxonomy.classes();
        Self::new(classes.len(), |class| classes[class].is_ignored, min_points)
    }

    /// Adds a frame of N points: class numbers and segment ids, true and predicted.
    ///
    /// A segment is the set of points with one id in one class. The API takes the whole 32-bit
    /// label word as the id, so that two raw ids folded into one class are two segments; here they
    /// are if their ids differ.
    ///
    /// # Panics
    /// If the columns differ in length or a class number is out of range.
    pub fn add(
        &mut self,
        predicted_class: &[u16],
        predicted_id: &[u32],
        true_class: &[u16],
        true_id: &[u32],
    ) {
        let points = true_class.len();
        assert!(
            [predicted_class.len(), predicted_id.len(), true_id.len()] == [points; 3],
            "columns of different length"
        );
        let mut true_size: FxHashMap<SegmentKey, u64> = FxHashMap::default();
        let mut predicted_size: FxHashMap<SegmentKey, u64> = FxHashMap::default();
        let mut common: FxHashMap<(u16, u32, u32), u64> = FxHashMap::default();
        for point in 0..points {
            let (predicted, truth) = (predicted_class[point], true_class[point]);
            if self.ignored[usize::from(truth)] {
                continue;
            }
            self.confusion[usize::from(predicted) * self.classes + usize::from(truth)] += 1;
            *true_size.entry((truth, true_id[point])).or_default() += 1;
            *predicted_size.entry((predicted, predicted_id[point])).or_default() += 1;
            if predicted == truth {
                let pair = (truth, true_id[point], predicted_id[point]);
                *common.entry(pair).or_default() += 1;
            }
        }
        self.match_segments(true_size, predicted_size, common);
    }

    fn match_segments(
        &mut self,
        mut true_size: FxHashMap<SegmentKey, u64>,
        mut predicted_size: FxHashMap<SegmentKey, u64>,
        common: FxHashMap<(u16, u32, u32), u64>,
    ) {
        let mut matches: Vec<(u16, u32, u32, f64)> = common
            .into_iter()
            .filter_map(|((class, truth, predicted), intersection)| {
                let union =
                    true_size[&(class, truth)] + predicted_size[&(class, predicted)] - intersection;
                let iou = intersection as f64 / union as f64;
                (iou > 0.5).then_some((class, truth, predicted, iou))
            })
            .collect();
        // The order of a sum of floats decides its last digit: segments ascending, as the API sums.
        matches.sort_by_key(|&(class, truth, predicted, _)| (class, truth, predicted));
        for of_class in matches.chunk_by(|a, b| a.0 == b.0) {
            let ious: Vec<f64> = of_class.iter().map(|found| found.3).collect();
            self.iou_sum[usize::from(of_class[0].0)] += pairwise_sum(&ious);
        }
        for (class, truth, predicted, _) in matches {
            self.true_positives[usize::from(class)] += 1;
            true_size.remove(&(class, truth));
            predicted_size.remove(&(class, predicted));
        }
        let unmatched = |sizes: FxHashMap<SegmentKey, u64>, false_segments: &mut Vec<u64>| {
            for ((class, _), size) in sizes {
                false_segments[usize::from(class)] += u64::from(size >= self.min_points);
            }
        };
        unmatched(true_size, &mut self.false_negatives);
        unmatched(predicted_size, &mut self.false_positives);
    }

    /// Figures of one class number.
    pub fn class(&self, class: usize) -> ClassQuality {
        let tp = self.true_positives[class] as f64;
        let (fp, fn_) = (self.false_positives[class] as f64, self.false_negatives[class] as f64);
        const EPSILON: f64 = 1e-15;
        let sq = self.iou_sum[class] / tp.max(EPSILON);
        let rq = tp / (tp + 0.5 * fp + 0.5 * fn_).max(EPSILON);
        let of = |predicted: usize, truth: usize| self.confusion[predicted * self.classes + truth];
        let intersection = of(class, class) as f64;
        let predicted: u64 = (0..self.classes).map(|truth| of(class, truth)).sum();
        let truth: u64 = (0..self.classes).map(|predicted| of(predicted, class)).sum();
        let union = (predicted + truth) as f64 - intersection;
        ClassQuality {
            pq: sq * rq,
            sq,
            rq,
            iou: intersection / union.max(EPSILON),
            true_positives: self.true_positives[class],
            false_positives: self.false_positives[class],
            false_negatives: self.false_negatives[class],
        }
    }

    /// Points that truth gives to a class (ignored classes: none).
    pub fn true_points(&self, class: usize) -> u64 {
        (0..self.classes).map(|predicted| self.confusion[predicted * self.classes + class]).sum()
    }

    /// Whether a class number is a thing of which truth has [`MIN_POINTS`] points or more.
    pub fn is_thing_present(&self, taxonomy: &Taxonomy, class: usize) -> bool {
        taxonomy.classes()[class].is_thing && self.true_points(class) >= MIN_POINTS
    }

    /// Mean IoU over the classes of which truth or prediction has points, including "no class" in
    /// predictions.
    pub fn mean_iou_of_present(&self) -> f64 {
        let of = |predicted: usize, truth: usize| self.confusion[predicted * self.classes + truth];
        let is_present = |class: &usize| {
            (0..self.classes).any(|other| of(*class, other) > 0 || of(other, *class) > 0)
        };
        let present: Vec<f64> =
            (0..self.classes).filter(is_present).map(|class| self.class(class).iou).collect();
        pairwise_sum(&present) / (present.len() as f64).max(1.0)
    }

    /// Means over the classes that `includes` accepts; ignored classes are never among them, absent
    /// ones count 0.
    pub fn mean(&self, includes: impl Fn(usize) -> bool) -> PanopticQuality {
        let chosen = (0..self.classes).filter(|&class| !self.ignored[class] && includes(class));
        let chosen: Vec<ClassQuality> = chosen.map(|class| self.class(class)).collect();
        let mean = |figure: fn(&ClassQuality) -> f64| {
            pairwise_sum(&chosen.iter().map(figure).collect::<Vec<_>>())
                / (chosen.len() as f64).max(1.0)
        };
        PanopticQuality {
            pq: mean(|quality| quality.pq),
            sq: mean(|quality| quality.sq),
            rq: mean(|quality| quality.rq),
            miou: mean(|quality| quality.iou),
        }
    }
}

/// The sum in NumPy's order, on which the API's last digits depend: up to seven numbers one by one,
/// up to 128 in eight interleaved sums, more in halves (pairwise summation; Higham 1993).
pub fn pairwise_sum(values: &[f64]) -> f64 {
    const LANES: usize = 8;
    const BLOCK: usize = 128;
    if values.len() < LANES {
        return values.iter().sum();
    }
    if values.len() > BLOCK {
        let half = values.len() / 2;
        let (low, high) = values.split_at(half - half % LANES);
        return pairwise_sum(low) + pairwise_sum(high);
    }
    let (lanes, rest) = values.as_chunks::<LANES>();
    let mut sums = lanes[0];
    for lane in &lanes[1..] {
        sums.iter_mut().zip(lane).for_each(|(sum, value)| *sum += value);
    }
    let pair = |i: usize| sums[i] + sums[i + 1];
    let sum = (pair(0) + pair(2)) + (pair(4) + pair(6));
    rest.iter().fold(sum, |sum, value| sum + value)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums of 1 / (k + 1) for k below 7, 20, 128 and 300, as printed by
    /// `numpy.sum(1 / (numpy.arange(n) + 1.0))`.
    #[test]
    fn sums_end_in_the_digits_of_numpy() {
        let sum =
            |count: u32| pairwise_sum(&(1..=count).map(|k| 1.0 / f64::from(k)).collect::<Vec<_>>());
        assert_eq!(sum(7), 2.5928571428571425);
        assert_eq!(sum(20), 3.597739657143682);
        assert_eq!(sum(128), 5.433147092589173);
        assert_eq!(sum(300), 6.282663880299504);
    }

    /// He et al.'s worked example as semantic-kitti-api's self-test has it: ignored class 0, grass,
    /// sky, person, dog; unmatched segments count from one point on.
    #[test]
    fn known_answer() {
        let (mut truth, mut truth_id, mut found, mut found_id) = (vec![], vec![], vec![], vec![]);
        let mut put = |points: usize, t: (u16, u32), p: (u16, u32)| {
            truth.extend(vec![t.0; points]);
            truth_id.extend(vec![t.1; points]);
            found.extend(vec![p.0; points]);
            found_id.extend(vec![p.1; points]);
        };
        put(50, (0, 0), (0, 0));
        put(40, (1, 0), (1, 0));
        put(10, (1, 0), (2, 0));
        put(40, (2, 0), (2, 0));
        put(10, (2, 0), (1, 0));
        put(50, (4, 22), (3, 35)); // a dog taken for a person
        put(150, (3, 33), (3, 8)); // three persons, of whom two are found
        put(50, (3, 42), (3, 8));
        put(100, (3, 11), (3, 95));
        let mut scores = Panoptic::new(5, |class| class == 0, 1);
        scores.add(&found, &found_id, &truth, &truth_id);
        let mean = scores.mean(|_| true);
        assert_eq!(mean.pq, 0.47916666666666663);
        assert_eq!(mean.sq, 0.5520833333333333);
        assert_eq!(mean.rq, 0.6666666666666666);
        assert_eq!(mean.miou, 0.5476190476190476);
    }

    #[test]
    fn small_unmatched_segments_do_not_count_but_small_matches_do() {
        let mut scores = Panoptic::new(2, |class| class == 0, MIN_POINTS);
        // 10 points matched; 49 points missed.
        let truth_id: Vec<u32> = [vec![1; 10], vec![2; 49]].concat();
        let found_id: Vec<u32> = [vec![7; 10], (100..149).collect()].concat();
        scores.add(&[1; 59], &found_id, &[1; 59], &truth_id);
        let quality = scores.class(1);
        assert_eq!((quality.true_positives, quality.false_negatives), (1, 0));
        assert_eq!(quality.pq, 1.0);
    }

    #[test]
    fn half_is_no_match() {
        let mut scores = Panoptic::new(2, |class| class == 0, 1);
        scores.add(&[1; 4], &[1, 1, 2, 2], &[1; 4], &[5; 4]);
        let quality = scores.class(1);
        assert_eq!((quality.false_positives, quality.false_negatives), (2, 1));
    }
}
