//! Table `simulated`: parking lots and crowds, three sensors, ten seeds, a case each.

use divmerge::Taxonomy;
use divmerge::evaluate::panoptic::{ClassQuality, MIN_POINTS, Panoptic};
use divmerge::simulate::{Scene, Sensor};

use crate::frames::{Frame, simulated};
use crate::methods::{self, Method};
use crate::scores::{add, head, scores, things};

const SCENES: [Scene; 2] = [Scene::Parking, Scene::Crowd];
const SEEDS: std::ops::RangeInclusive<u64> = 1..=10;

/// Prints the table: mean and lowest over the seeds, and where `best` is not ahead.
pub fn tables() {
    let methods = [methods::best(), methods::paper(), methods::dbscan(), methods::alpine()];
    let columns = methods.iter().map(|method| format!("{}: mean, lowest", method.name));
    head("Ten seeds", &columns.collect::<Vec<_>>());
    let mut cases = Vec::new();
    for scene in SCENES {
        for sensor in Sensor::USUAL {
            let frames: Vec<Frame> = SEEDS.map(|seed| simulated(scene, sensor, seed)).collect();
            let found: Vec<Case> = frames.iter().map(|frame| case(frame, &methods)).collect();
            row(&frames[0].group, &found);
            cases.extend(found);
        }
    }
    row("all", &cases);
    println!();
    head("`best` is", &["cases".to_owned(), "which".to_owned()]);
    for (number, method) in methods.iter().enumerate().skip(1) {
        let behind = cases.iter().filter(|case| case.quality[number] >= case.quality[0]);
        let behind: Vec<String> = behind.map(|case| describe(case, number)).collect();
        println!(
            "| not ahead of {} | {} of {} | {} |",
            method.name,
            behind.len(),
            cases.len(),
            behind.join("<br>")
        );
    }
    let below = cases.iter().filter(|case| case.quality[0] < 95.0);
    let below: Vec<String> =
        below.map(|case| format!("{}: {:.2}", case.name, case.quality[0])).collect();
    println!("| below 95 | {} of {} | {} |\n", below.len(), cases.len(), below.join("<br>"));
}

/// A frame's mean PQ and figures by each method.
struct Case {
    name: String,
    quality: Vec<f64>,
    sums: Vec<Panoptic>,
}

fn case(frame: &Frame, methods: &[Method]) -> Case {
    let sums = methods.iter().map(|method| {
        let mut sums = scores();
        add(frame, &method.run(frame), &mut sums);
        sums
    });
    let sums: Vec<Panoptic> = sums.collect();
    let quality = sums.iter().map(|sums| things(sums, &[]).unwrap_or(0.0)).collect();
    Case { name: format!("{} {}", frame.group, frame.name), quality, sums }
}

/// The classes in which a case is behind another method: PQ, SQ, matches, spurious, missed of both.
fn describe(case: &Case, other: usize) -> String {
    let taxonomy = Taxonomy::semantic_kitti();
    let classes = taxonomy.classes().iter().enumerate().filter(|(_, class)| class.is_thing);
    let behind = classes.filter_map(|(number, class)| {
        let [ours, theirs] = [0, other].map(|method| case.sums[method].class(number));
        let counted = case.sums[0].true_points(number) >= MIN_POINTS && ours.pq < theirs.pq;
        counted.then(|| format!("{} {} against {}", class.name, figures(ours), figures(theirs)))
    });
    let behind: Vec<String> = behind.collect();
    let [ours, theirs] = [0, other].map(|method| case.quality[method]);
    format!("{}: {ours:.2}, theirs {theirs:.2}; {}", case.name, behind.join("; "))
}

fn figures(of: ClassQuality) -> String {
    format!(
        "PQ {:.2} SQ {:.2} ({} found, {} spurious, {} missed)",
        of.pq * 100.0,
        of.sq * 100.0,
        of.true_positives,
        of.false_positives,
        of.false_negatives
    )
}

fn row(name: &str, cases: &[Case]) {
    let cell = |method: usize| {
        let all = cases.iter().map(|case| case.quality[method]);
        let lowest = all.clone().fold(f64::INFINITY, f64::min);
        format!("{:.2}, {lowest:.2}", all.sum::<f64>() / cases.len() as f64)
    };
    let cells: Vec<String> = (0..cases[0].quality.len()).map(cell).collect();
    println!("| {name} | {} |", cells.join(" | "));
}
