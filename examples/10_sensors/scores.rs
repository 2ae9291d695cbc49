//! How good instances and ground are.

use std::collections::BTreeMap;

use divmerge::Taxonomy;
use divmerge::cloud::Reason;
use divmerge::evaluate::panoptic::{MIN_POINTS, Panoptic};
use divmerge::pipeline::Stages;
use divmerge::simulate::SimulatedFrame;

/// Sums over frames.
pub struct Scores {
    quality: Panoptic,
    /// Ground taken for ground, and points taken for what they are not.
    ground: [f64; 2],
    /// Things found whole without classes, and all of them.
    whole: [u32; 2],
}

impl Default for Scores {
    fn default() -> Self {
        let quality = Panoptic::of(&Taxonomy::semantic_kitti(), MIN_POINTS);
        Scores { quality, ground: [0.0; 2], whole: [0; 2] }
    }
}

impl Scores {
    pub fn add(&mut self, frame: &SimulatedFrame, by_class: &Stages, by_ground: &Stages) {
        let class_of = Taxonomy::semantic_kitti().lookup();
        let fold =
            |raw: &[u16]| raw.iter().map(|&id| class_of[usize::from(id)]).collect::<Vec<_>>();
        let truth = frame.cloud.class.as_deref().expect("a simulated cloud has classes");
        let ids: Vec<u32> = frame.true_instance.iter().map(|&id| u32::from(id)).collect();
        let labels = &by_class.labels;
        self.quality.add(&fold(&labels.semantic), &labels.instance, &fold(truth), &ids);
        for (class, reason) in truth.iter().zip(&by_ground.labels.reason) {
            // Neither outliers nor vegetation.
            if ![0, 1, 70].contains(class) {
                let is_ground = [40, 44, 48, 49, 60, 72].contains(class);
                let found = *reason == Reason::Ground;
                self.ground[0] += f64::from(u8::from(is_ground && found));
                self.ground[1] += f64::from(u8::from(is_ground != found));
            }
        }
        self.count_whole(&ids, &by_ground.labels.instance);
    }

    /// Things of 50 points and more that share more than half of all points with an instance.
    fn count_whole(&mut self, truth: &[u32], found: &[u32]) {
        let mut sizes = [BTreeMap::new(), BTreeMap::new()];
        let mut both = BTreeMap::new();
        for (&truth, &found) in truth.iter().zip(found) {
            *sizes[0].entry(truth).or_insert(0_u32) += 1;
            *sizes[1].entry(found).or_insert(0_u32) += 1;
            *both.entry((truth, found)).or_insert(0_u32) += 1;
        }
        let [truths, founds] = sizes;
        let is_counted = |&(&id, &size): &(&u32, &u32)| id != 0 && size >= MIN_POINTS as u32;
        self.whole[1] += truths.iter().filter(is_counted).count() as u32;
        let is_whole = |((truth, found), shared): (&(u32, u32), &u32)| {
            let union = truths[truth] + founds[found] - shared;
            *truth != 0 && *found != 0 && truths[truth] >= MIN_POINTS as u32 && 2 * shared > union
        };
        self.whole[0] += both.iter().filter(|&pair| is_whole(pair)).count() as u32;
    }

    /// PQ of things in percent, F1 of the ground, share of things found whole without classes.
    pub fn cells(&self) -> String {
        let taxonomy = Taxonomy::semantic_kitti();
        let pq = self.quality.mean(|class| self.quality.is_thing_present(&taxonomy, class)).pq;
        let [hits, errors] = self.ground;
        let [whole, all] = self.whole.map(f64::from);
        format!(
            "{:.1} | {:.1} | {:.1}",
            100.0 * pq,
            100.0 * hits / (hits + 0.5 * errors),
            100.0 * whole / all
        )
    }
}
