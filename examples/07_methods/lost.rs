//! Table `lost`: every true object that preset `best` does not find or outlines clearly worse than
//! another method, where it is, and what became of it. Objects of fewer points than count are
//! listed only where another method finds them.

use divmerge::Taxonomy;
use divmerge::evaluate::panoptic::MIN_POINTS;
use divmerge::evaluate::verdict::{
    JudgedObject, Labelling, MatchRules, Overlap, Segment, Verdicts, verdicts,
};
use divmerge::geometry::footprint::{convex_hull, minimum_area_rectangle};
use divmerge::simulate::{Scene, Sensor};

use crate::frames::{Frame, simulated};
use crate::methods::{self, Method};
use crate::scores::head;

/// Prints the objects of the real drives, then those of the simulated cases.
pub fn tables(real: &[Frame]) {
    let methods = [methods::best(), methods::alpine(), methods::dbscan()];
    let columns = ["class", "points", "at x, y", "size", "verdict", "lies in", "also in the first"];
    let iou = methods.iter().map(|method| format!("IoU {}", method.name));
    head("Frame", &columns.map(str::to_owned).into_iter().chain(iou).collect::<Vec<_>>());
    real.iter().for_each(|frame| rows(frame, &methods));
    for scene in [Scene::Parking, Scene::Crowd] {
        for sensor in Sensor::USUAL {
            (1..=10).for_each(|seed| rows(&simulated(scene, sensor, seed), &methods));
        }
    }
    println!();
}

/// So much IoU more is clearly better.
const CLEARLY: f64 = 0.05;

fn judged(frame: &Frame, method: &Method) -> Verdicts {
    let found = method.run(frame);
    let truth = Labelling { class: &frame.true_class, id: &frame.true_id };
    let found = Labelling { class: &found.class, id: &found.instance };
    let rules = MatchRules { min_points: MIN_POINTS, by_class: true };
    verdicts(&frame.cloud, truth, found, &Taxonomy::semantic_kitti(), rules)
}

fn rows(frame: &Frame, methods: &[Method]) {
    let found: Vec<Verdicts> = methods.iter().map(|method| judged(frame, method)).collect();
    for (number, judged) in found[0].truth.iter().enumerate() {
        let iou: Vec<f64> = found.iter().map(|verdicts| verdicts.truth[number].iou).collect();
        let others = iou[1..].iter().copied().fold(0.0, f64::max);
        let is_behind = others > 0.5 && others > iou[0] + CLEARLY;
        if is_behind || judged.is_failure() {
            row(frame, judged, &iou);
        }
    }
}

fn row(frame: &Frame, judged: &JudgedObject, iou: &[f64]) {
    let part = |part: &Overlap| format!("{} of {}", part.shared, part.points);
    let parts: Vec<String> = judged.parts.iter().take(3).map(part).collect();
    let beside = judged.beside.iter().map(|share| {
        let place = place(frame, share.object).replace(" | ", ", ");
        format!("{} points at {place}", share.points)
    });
    let iou: Vec<String> = iou.iter().map(|iou| format!("{iou:.2}")).collect();
    println!(
        "| {} {} | {} | {} | {} | {} | {} | {} | {} |",
        frame.group,
        frame.name,
        judged.class_name,
        judged.points,
        place(frame, judged.object),
        judged.verdict.name(),
        parts.join("; "),
        beside.collect::<Vec<_>>().join("; "),
        iou.join(" | ")
    );
}

/// Centre and size on the bird's-eye plane.
fn place(frame: &Frame, object: Segment) -> String {
    let is_own = |p: &usize| (frame.true_class[*p], frame.true_id[*p]) == (object.class, object.id);
    let points = (0..frame.true_class.len()).filter(is_own);
    let plane: Vec<[f64; 2]> =
        points.map(|p| frame.cloud.position(p).map(f64::from)).map(|[x, y, _]| [x, y]).collect();
    minimum_area_rectangle(&convex_hull(&plane)).map_or(String::new(), |r| {
        let ([x, y], [length, width]) = (r.centre, r.size);
        format!("{x:.1}, {y:.1} | {length:.1} x {width:.1}")
    })
}
