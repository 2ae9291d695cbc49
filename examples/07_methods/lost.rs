//! Table `lost`: every true object that preset `best` does not find or outlines clearly worse than another
//! method, where it is, and what became of it. Objects of fewer points than count are listed only where
//! another method finds them.

use std::collections::BTreeMap;

use divmerge::Taxonomy;
use divmerge::evaluate::panoptic::MIN_POINTS;
use divmerge::footprint::{convex_hull, minimum_area_rectangle};
use divmerge::simulate::{Scene, Sensor};

use crate::frames::{Frame, simulated};
use crate::methods::{self, Found, Method};
use crate::scores::head;

/// Prints the objects of the real drives, then those of the simulated cases.
pub fn tables(real: &[Frame]) {
    let methods = [methods::best(), methods::alpine(), methods::dbscan()];
    let columns =
        ["class", "points", "at x, y", "size", "largest overlaps of `best`", "also in it"];
    let iou = methods.iter().map(|method| format!("IoU {}", method.name));
    head("Frame", &columns.map(str::to_owned).into_iter().chain(iou).collect::<Vec<_>>());
    real.iter().for_each(|frame| rows(frame, &methods));
    for scene in [Scene::Parking, Scene::Crowd] {
        for sensor in Sensor::ALL {
            (1..=10).for_each(|seed| rows(&simulated(scene, sensor, seed), &methods));
        }
    }
    println!();
}

/// So much IoU more is clearly better.
const CLEARLY: f64 = 0.05;

/// A true object: class and id.
type Object = (u16, u32);

/// Points that each pair of a true and a found object shares.
struct Overlaps {
    shared: BTreeMap<(Object, Object), u64>,
    true_size: BTreeMap<Object, u64>,
    found_size: BTreeMap<Object, u64>,
}

impl Overlaps {
    fn new(frame: &Frame, found: &Found) -> Self {
        let taxonomy = Taxonomy::semantic_kitti();
        let mut overlaps = Overlaps {
            shared: BTreeMap::new(),
            true_size: BTreeMap::new(),
            found_size: BTreeMap::new(),
        };
        for point in 0..frame.true_class.len() {
            let truth = (frame.true_class[point], frame.true_id[point]);
            let own = (found.class[point], found.instance[point]);
            if taxonomy.classes()[usize::from(truth.0)].is_ignored {
                continue;
            }
            *overlaps.found_size.entry(own).or_default() += 1;
            if taxonomy.classes()[usize::from(truth.0)].is_thing {
                *overlaps.true_size.entry(truth).or_default() += 1;
                *overlaps.shared.entry((truth, own)).or_default() += 1;
            }
        }
        overlaps
    }

    fn iou(&self, truth: Object, own: Object) -> f64 {
        let shared = self.shared.get(&(truth, own)).copied().unwrap_or(0);
        shared as f64 / (self.true_size[&truth] + self.found_size[&own] - shared) as f64
    }

    /// What was found in a true object, the most points first.
    fn parts(&self, truth: Object) -> Vec<(Object, u64)> {
        let all = self.shared.range((truth, (0, 0))..=(truth, (u16::MAX, u32::MAX)));
        let mut parts: Vec<(Object, u64)> = all.map(|(&(_, own), &n)| (own, n)).collect();
        parts.sort_by_key(|&(_, points)| std::cmp::Reverse(points));
        parts
    }

    /// Greatest intersection over union with anything found of the same class.
    fn best_iou(&self, truth: Object) -> f64 {
        let parts = self.parts(truth).into_iter().filter(|(own, _)| own.0 == truth.0);
        parts.map(|(own, _)| self.iou(truth, own)).fold(0.0, f64::max)
    }
}

fn rows(frame: &Frame, methods: &[Method]) {
    let taxonomy = Taxonomy::semantic_kitti();
    let found: Vec<Overlaps> =
        methods.iter().map(|method| Overlaps::new(frame, &method.run(frame))).collect();
    let best = &found[0];
    for (&truth, &points) in &best.true_size {
        let iou: Vec<f64> = found.iter().map(|overlaps| overlaps.best_iou(truth)).collect();
        let others = iou[1..].iter().copied().fold(0.0, f64::max);
        let is_behind = others > 0.5 && others > iou[0] + CLEARLY;
        if !is_behind && (iou[0] > 0.5 || points < MIN_POINTS) {
            continue;
        }
        let parts = best.parts(truth);
        let overlaps: Vec<String> = parts
            .iter()
            .take(3)
            .map(|&(own, n)| format!("{n} of {}", best.found_size[&own]))
            .collect();
        let others = best.true_size.iter().filter(|&(&other, _)| {
            other != truth && best.shared.contains_key(&(other, parts[0].0))
        });
        let beside: Vec<String> = others
            .map(|(&other, n)| {
                format!("{n} points at {}", place(frame, other).replace(" | ", ", "))
            })
            .collect();
        let iou: Vec<String> = iou.iter().map(|iou| format!("{iou:.2}")).collect();
        println!(
            "| {} {} | {} | {points} | {} | {} | {} | {} |",
            frame.group,
            frame.name,
            taxonomy.classes()[usize::from(truth.0)].name,
            place(frame, truth),
            overlaps.join("; "),
            beside.join("; "),
            iou.join(" | ")
        );
    }
}

/// Centre and size on the bird's-eye plane.
fn place(frame: &Frame, object: Object) -> String {
    let is_own = |p: &usize| (frame.true_class[*p], frame.true_id[*p]) == object;
    let points = (0..frame.true_class.len()).filter(is_own);
    let plane: Vec<[f64; 2]> =
        points.map(|p| frame.cloud.position(p).map(f64::from)).map(|[x, y, _]| [x, y]).collect();
    minimum_area_rectangle(&convex_hull(&plane)).map_or(String::new(), |r| {
        let ([x, y], [length, width]) = (r.centre, r.size);
        format!("{x:.1}, {y:.1} | {length:.1} x {width:.1}")
    })
}
