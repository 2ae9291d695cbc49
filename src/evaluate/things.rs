//! How well true things are found whatever the classes: whole, and by their association.
//!
//! Both are for things alone, whose truth has an id each. Found instances are counted among the
//! points that are given: leave out those of ignored classes and of things without an id.

use rustc_hash::FxHashMap;

/// The largest IoU of a true thing with a found instance, and its association.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThingScore {
    /// Its id.
    pub id: u32,
    /// Number of its points.
    pub points: usize,
    /// The largest IoU of a found instance with it.
    pub iou: f64,
    /// S_assoc (3DUIS, Nunes et al. 2022): sum over the found instances of the points of both times
    /// their IoU, divided by its points.
    pub association: f64,
}

impl ThingScore {
    /// Whether one instance is most of it, and it most of that instance.
    pub fn is_whole(&self) -> bool {
        self.iou > 0.5
    }
}

/// The score of each true thing of `min_points` points or more, by id. Ids count from 1; 0 is none.
///
/// # Panics
/// If the two differ in length.
pub fn thing_scores(truth: &[u32], found: &[u32], min_points: usize) -> Vec<ThingScore> {
    assert_eq!(truth.len(), found.len(), "one true and one found instance per point");
    let mut sizes: FxHashMap<u32, usize> = FxHashMap::default();
    for &found in found.iter().filter(|&&found| found != 0) {
        *sizes.entry(found).or_default() += 1;
    }
    let pairs = truth.iter().copied().zip(found.iter().copied());
    let mut pairs: Vec<(u32, u32)> = pairs.filter(|pair| pair.0 != 0).collect();
    pairs.sort_unstable();
    let things = pairs.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() >= min_points);
    let score = |thing: &[(u32, u32)]| {
        let points = thing.len();
        let parts = thing.chunk_by(|a, b| a == b).filter(|part| part[0].1 != 0);
        let both = parts.map(|part| {
            let union = points + sizes[&part[0].1] - part.len();
            (part.len() as f64, part.len() as f64 / union as f64)
        });
        let (iou, association) =
            both.fold((0.0_f64, 0.0), |(most, sum), (both, iou)| (most.max(iou), sum + both * iou));
        ThingScore { id: thing[0].0, points, iou, association: association / points as f64 }
    };
    things.map(score).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        // Thing 1: 3 of 4 points in 5, which holds one point more: IoU 3 / 5. Thing 2 in halves:
        // IoU 1 / 2 each is not enough. Thing 3: one point.
        let truth = [1, 1, 1, 1, 0, 2, 2, 2, 2, 3];
        let found = [5, 5, 5, 0, 5, 6, 6, 7, 7, 8];
        let scores = thing_scores(&truth, &found, 2);
        assert_eq!(scores.len(), 2);
        assert!((scores[0].iou - 0.6).abs() < 1e-12 && scores[0].is_whole());
        assert!((scores[0].association - 3.0 * 0.6 / 4.0).abs() < 1e-12);
        assert!(!scores[1].is_whole());
        assert!((scores[1].association - 0.5).abs() < 1e-12);
        assert_eq!(thing_scores(&truth, &found, 1).iter().filter(|one| one.is_whole()).count(), 2);
    }

    #[test]
    fn what_is_not_found_has_no_score() {
        let found = thing_scores(&[9, 9], &[0, 0], 1);
        assert_eq!(found, [ThingScore { id: 9, points: 2, iou: 0.0, association: 0.0 }]);
    }
}
