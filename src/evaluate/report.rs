//! Panoptic figures as semantic-kitti-api's `evaluate_panoptic.py` reports them (ALGORITHM section
//! 9).

use serde::Serialize;

use super::panoptic::{ClassQuality, MIN_POINTS, Panoptic, PanopticQuality, pairwise_sum};
use divmerge_core::cloud::taxonomy::Taxonomy;

/// The panoptic figures of a set of frames, from 0 to 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PanopticReport {
    /// Means over all classes that count; absent ones are 0, as the API has it.
    pub all: PanopticQuality,
    /// Means over the things.
    pub things: PanopticQuality,
    /// Means over the stuff.
    pub stuff: PanopticQuality,
    /// PQ-dagger (Porzi et al. 2019): the mean of the PQ of things and the IoU of stuff.
    pub pq_dagger: f64,
    /// The same means over the classes that are present in the truth, which are not the
    /// benchmark's.
    pub present: PresentMeans,
    /// Each class that counts, by number.
    pub classes: Vec<NamedQuality>,
}

/// Means over the classes of which truth has [`MIN_POINTS`] points or more.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PresentMeans {
    /// Over all of them.
    pub all: PanopticQuality,
    /// Over the things.
    pub things: PanopticQuality,
    /// Over the stuff.
    pub stuff: PanopticQuality,
    /// Number of things that are present.
    pub thing_count: usize,
    /// Number of stuff classes that are present.
    pub stuff_count: usize,
}

/// The figures of a class with its name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedQuality {
    /// Name in the taxonomy.
    pub name: String,
    /// Whether its objects are counted.
    pub is_thing: bool,
    /// Points that truth gives to it.
    pub true_points: u64,
    /// Its figures.
    #[serde(flatten)]
    pub quality: ClassQuality,
}

impl PanopticReport {
    /// Number of things among the classes that count.
    pub fn things_count(&self) -> usize {
        self.classes.iter().filter(|class| class.is_thing).count()
    }

    /// The figures of some scores, whose class numbers are those of a taxonomy.
    pub fn new(scores: &Panoptic, taxonomy: &Taxonomy) -> Self {
        let classes = taxonomy.classes();
        let is_thing = |class: usize| classes[class].is_thing;
        let named = (0..classes.len()).filter(|&class| !classes[class].is_ignored).map(|class| {
            NamedQuality {
                name: classes[class].name.clone(),
                is_thing: is_thing(class),
                true_points: scores.true_points(class),
                quality: scores.class(class),
            }
        });
        let named: Vec<NamedQuality> = named.collect();
        let is_present = |class: usize| scores.true_points(class) >= MIN_POINTS;
        let count = |is_thing: bool| {
            let of_kind = named.iter().filter(|class| class.is_thing == is_thing);
            of_kind.filter(|class| class.true_points >= MIN_POINTS).count()
        };
        let present = PresentMeans {
            all: scores.mean(is_present),
            things: scores.mean(|class| is_present(class) && is_thing(class)),
            stuff: scores.mean(|class| is_present(class) && !is_thing(class)),
            thing_count: count(true),
            stuff_count: count(false),
        };
        let of_things = named.iter().filter(|class| class.is_thing).map(|class| class.quality.pq);
        let of_stuff = named.iter().filter(|class| !class.is_thing).map(|class| class.quality.iou);
        let figures: Vec<f64> = of_things.chain(of_stuff).collect();
        PanopticReport {
            all: scores.mean(|_| true),
            things: scores.mean(is_thing),
            stuff: scores.mean(|class| !is_thing(class)),
            pq_dagger: pairwise_sum(&figures) / (figures.len() as f64).max(1.0),
            present,
            classes: named,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dagger_takes_the_iou_of_stuff() {
        let taxonomy = Taxonomy::semantic_kitti();
        let [car, road] = ["car", "road"].map(|name| taxonomy.class_named(name).unwrap());
        let mut scores = Panoptic::of(&taxonomy, 1);
        // A car in two halves, and a road of which four points in ten are taken for the car.
        let truth = [vec![car; 10], vec![road; 10]].concat();
        let found = [vec![car; 14], vec![road; 6]].concat();
        let true_id = [vec![1; 10], vec![0; 10]].concat();
        let found_id = [vec![1; 6], vec![2; 8], vec![0; 6]].concat();
        scores.add(&found, &found_id, &truth, &true_id);
        let report = PanopticReport::new(&scores, &taxonomy);
        // The car: 6 of 10 matched, one segment spurious. The road: 6 of 10 matched.
        let car_pq = 0.6 / 1.5;
        assert!((report.things.pq - car_pq / 8.0).abs() < 1e-12);
        assert!((report.stuff.pq - 0.6 / 11.0).abs() < 1e-12);
        assert!((report.pq_dagger - (car_pq + 0.6) / 19.0).abs() < 1e-12);
        assert!((report.all.pq - (car_pq + 0.6) / 19.0).abs() < 1e-12);
        assert_eq!(report.classes.len(), 19);
    }

    #[test]
    fn classes_that_are_not_in_the_truth_do_not_count_among_those_present() {
        let taxonomy = Taxonomy::semantic_kitti();
        let [car, road, person] =
            ["car", "road", "person"].map(|name| taxonomy.class_named(name).unwrap());
        let mut scores = Panoptic::of(&taxonomy, 1);
        // A car found whole, a road of which half is named a person, and too few points of one.
        let truth = [vec![car; 60], vec![road; 60], vec![person; 49]].concat();
        let found = [vec![car; 60], vec![road; 30], vec![person; 79]].concat();
        let id = [vec![1; 60], vec![0; 60], vec![2; 49]].concat();
        let found_id = [vec![1; 60], vec![0; 30], vec![2; 79]].concat();
        scores.add(&found, &found_id, &truth, &id);
        let present = PanopticReport::new(&scores, &taxonomy).present;
        assert_eq!((present.thing_count, present.stuff_count), (1, 1));
        assert!((present.things.pq - 1.0).abs() < 1e-12);
        assert!(present.stuff.pq.abs() < 1e-12 && (present.stuff.miou - 0.5).abs() < 1e-12);
        assert!((present.all.pq - 0.5).abs() < 1e-12);
    }
}
