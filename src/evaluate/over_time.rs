//! Association over frames where ids are meant to last: LSTQ (Aygün et al., "4D Panoptic LiDAR
//! Segmentation", CVPR 2021, section 4; arXiv 2102.12472).
//!
//! A tube is the set of all points that have one id in a sequence. With TPA(s, t) the number of
//! points that a true tube t and a found tube s share,
//!
//! - S_assoc = mean over the true tubes t of things of 1 / |t| times the sum over s of TPA(s, t)
//!   IoU(s, t), whatever the class of s: an object that is found whole in every frame but under two
//!   ids of equal shares has a half;
//! - S_cls = mean IoU of the classes, those that neither truth nor prediction has left out;
//! - LSTQ = the root of S_assoc times S_cls.
//!
//! What the paper leaves open is as in the evaluation its authors published:
//!
//! - Points whose true class is ignored leave first, on both sides.
//! - A true object counts only in the frames where it has *more* points than the minimum (50), and
//!   its tube is made of these frames; a found tube is made of all frames, less the points whose
//!   found class is ignored.
//! - Id 0 is no instance. A true tube's id belongs to its class, a found one's does not.
//! - "No class" is one of the classes of S_cls, with an IoU of 0, as soon as a point is predicted
//!   so.

use rustc_hash::FxHashMap;
use serde::Serialize;

use super::panoptic::Panoptic;
use divmerge_core::cloud::taxonomy::Taxonomy;

/// Sums over any number of sequences.
#[derive(Debug, Clone, PartialEq)]
pub struct OverTime {
    is_ignored: Vec<bool>,
    is_thing: Vec<bool>,
    min_points: u64,
    /// By class: sum over its tubes.
    association: Vec<f64>,
    tubes: Vec<u64>,
    sequence: Sequence,
}

/// Points of the tubes of the current sequence.
#[derive(Debug, Clone, PartialEq, Default)]
struct Sequence {
    truth: FxHashMap<(u16, u32), u64>,
    found: FxHashMap<u32, u64>,
    both: FxHashMap<(u16, u32, u32), u64>,
}

/// LSTQ and its two factors, from 0 to 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Lstq {
    /// The root of the product of the other two.
    pub lstq: f64,
    /// Association.
    pub s_assoc: f64,
    /// Classification.
    pub s_cls: f64,
    /// Classes that have true tubes.
    pub classes: Vec<ClassAssociation>,
}

/// Association without classes, from 0 to 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TubeAssociation {
    /// S_assoc.
    pub s_assoc: f64,
    /// By true class.
    pub classes: Vec<ClassAssociation>,
}

/// Association of a class's objects.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClassAssociation {
    /// Name in the taxonomy.
    pub name: String,
    /// Mean over its true tubes.
    pub s_assoc: f64,
    /// True tubes.
    pub tubes: u64,
}

impl OverTime {
    /// Empty sums; true objects count where they have more points than `min_points`.
    pub fn of(taxonomy: &Taxonomy, min_points: u64) -> Self {
        let classes = taxonomy.classes();
        OverTime {
            is_ignored: classes.iter().map(|class| class.is_ignored).collect(),
            is_thing: classes.iter().map(|class| class.is_thing).collect(),
            min_points,
            association: vec![0.0; classes.len()],
            tubes: vec![0; classes.len()],
            sequence: Sequence::default(),
        }
    }

    /// Adds the next frame of a sequence, N points: class numbers, and instances of which 0 is
    /// none.
    ///
    /// # Panics
    /// If the columns differ in length or a class number is out of range.
    pub fn add(
        &mut self,
        found_class: &[u16],
        found_instance: &[u32],
        true_class: &[u16],
        true_instance: &[u32],
    ) {
        let points = true_class.len();
        let lengths = [found_class.len(), found_instance.len(), true_instance.len()];
        assert!(lengths == [points; 3], "columns of different length");
        let mut sizes: FxHashMap<(u16, u32), u64> = FxHashMap::default();
        let mut both: FxHashMap<(u16, u32, u32), u64> = FxHashMap::default();
        for point in 0..points {
            let (class, found) = (true_class[point], found_instance[point]);
            if self.is_ignored[usize::from(class)] {
                continue;
            }
            if found != 0 && !self.is_ignored[usize::from(found_class[point])] {
                *self.sequence.found.entry(found).or_default() += 1;
            }
            let truth = true_instance[point];
            if truth != 0 && self.is_thing[usize::from(class)] {
                *sizes.entry((class, truth)).or_default() += 1;
                if found != 0 {
                    *both.entry((class, truth, found)).or_default() += 1;
                }
            }
        }
        sizes.retain(|_, size| *size > self.min_points);
        both.retain(|&(class, truth, _), _| sizes.contains_key(&(class, truth)));
        for (tube, size) in sizes {
            *self.sequence.truth.entry(tube).or_default() += size;
        }
        for (pair, shared) in both {
            *self.sequence.both.entry(pair).or_default() += shared;
        }
    }

    /// Ends a sequence: later ids are those of other objects.
    pub fn end_sequence(&mut self) {
        let Sequence { truth, found, both } = std::mem::take(&mut self.sequence);
        let mut pairs: Vec<((u16, u32, u32), u64)> = both.into_iter().collect();
        pairs.sort_unstable();
        for &(class, _) in truth.keys() {
            self.tubes[usize::from(class)] += 1;
        }
        for of_tube in pairs.chunk_by(|a, b| (a.0.0, a.0.1) == (b.0.0, b.0.1)) {
            let (class, id, _) = of_tube[0].0;
            let size = truth[&(class, id)];
            let term = |&((.., other), shared): &((u16, u32, u32), u64)| {
                let other = found.get(&other).copied().unwrap_or(0);
                (other > 0).then(|| {
                    let union = (size + other) as f64 - shared as f64;
                    shared as f64 * (shared as f64 / union)
                })
            };
            let inner: f64 = of_tube.iter().filter_map(term).sum();
            self.association[usize::from(class)] += inner / size as f64;
        }
    }

    /// S_assoc of all sequences that have ended.
    pub fn s_assoc(&self) -> f64 {
        let all: u64 = self.tubes.iter().sum();
        self.association.iter().sum::<f64>() / all.max(1) as f64
    }

    /// The figures of all sequences that have ended; `scores` are of the same frames.
    pub fn lstq(&self, scores: &Panoptic, taxonomy: &Taxonomy) -> Lstq {
        let TubeAssociation { s_assoc, classes } = self.association(taxonomy);
        let s_cls = scores.mean_iou_of_present();
        Lstq { lstq: (s_assoc * s_cls).sqrt(), s_assoc, s_cls, classes }
    }

    /// The association of all sequences that have ended.
    pub fn association(&self, taxonomy: &Taxonomy) -> TubeAssociation {
        let present = (0..self.tubes.len()).filter(|&class| self.tubes[class] > 0);
        let classes = present.map(|class| ClassAssociation {
            name: taxonomy.classes()[class].name.clone(),
            s_assoc: self.association[class] / self.tubes[class] as f64,
            tubes: self.tubes[class],
        });
        TubeAssociation { s_assoc: self.s_assoc(), classes: classes.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lstq(frames: &[[Vec<u32>; 4]]) -> Lstq {
        let taxonomy = Taxonomy::semantic_kitti();
        let (mut time, mut scores) = (OverTime::of(&taxonomy, 1), Panoptic::of(&taxonomy, 1));
        for [found_class, found, true_class, truth] in frames {
            let class = |of: &[u32]| of.iter().map(|&class| class as u16).collect::<Vec<u16>>();
            let (found_class, true_class) = (class(found_class), class(true_class));
            time.add(&found_class, found, &true_class, truth);
            scores.add(&found_class, found, &true_class, truth);
        }
        time.end_sequence();
        time.lstq(&scores, &taxonomy)
    }

    /// The worked example of the published evaluation: a car and two trucks of five points each, of
    /// which the second truck is taken for a car and part of the first; five points are ignored.
    #[test]
    fn known_answer() {
        let (car, truck) = (1, 4);
        let five = |value: u32| vec![value; 5];
        let found_class = [five(0), five(car), five(truck), five(car)].concat();
        let found = [five(0), five(1), five(2), five(2)].concat();
        let true_class = [five(0), five(car), five(truck), five(truck)].concat();
        let truth = [five(0), five(1), five(1), five(2)].concat();
        let figures = lstq(&[[found_class, found, true_class, truth]]);
        assert_eq!((figures.s_assoc, figures.s_cls), (2.0 / 3.0, 0.5));
        assert_eq!(figures.lstq, (1.0_f64 / 3.0).sqrt());
        let classes: Vec<f64> = figures.classes.iter().map(|class| class.s_assoc).collect();
        assert_eq!(classes, [1.0, 0.5]);
    }

    #[test]
    fn an_id_that_changes_costs_a_half_and_so_it_does_in_the_next_frame() {
        let frame = |id: u32| [vec![1; 10], vec![id; 10], vec![1; 10], vec![7; 10]];
        assert_eq!(lstq(&[frame(3), frame(3)]).lstq, 1.0);
        let changed = lstq(&[frame(3), frame(4)]);
        assert_eq!((changed.s_assoc, changed.s_cls), (0.5, 1.0));
    }

    #[test]
    fn few_points_do_not_count_and_no_instance_is_none() {
        let of_one = [vec![1], vec![3], vec![1], vec![7]];
        assert_eq!(lstq(&[of_one]).classes, []);
        let lost = [vec![1; 4], vec![0; 4], vec![1; 4], vec![7; 4]];
        assert_eq!((lstq(std::slice::from_ref(&lost)).s_assoc, lstq(&[lost]).s_cls), (0.0, 1.0));
    }
}
