//! Table `simulated`: parking lots and crowds, three sensors, ten seeds, a case each.

use divmerge::simulate::{Scene, Sensor};

use crate::frames::{Frame, simulated};
use crate::methods::{self, Method};
use crate::scores::{head, quality};

const SCENES: [Scene; 2] = [Scene::Parking, Scene::Crowd];
const SEEDS: std::ops::RangeInclusive<u64> = 1..=10;

/// Prints the table: mean and lowest over the seeds, and where `best` is not ahead.
pub fn tables() {
    let methods = [methods::best(), methods::paper(), methods::dbscan(), methods::alpine()];
    let columns = methods.iter().map(|method| format!("{}: mean, lowest", method.name));
    head("Ten seeds", &columns.collect::<Vec<_>>());
    let mut cases = Vec::new();
    for scene in SCENES {
        for sensor in Sensor::ALL {
            let frames: Vec<Frame> = SEEDS.map(|seed| simulated(scene, sensor, seed)).collect();
            let found: Vec<Case> = frames.iter().map(|frame| case(frame, &methods)).collect();
            row(&frames[0].group, &found);
            cases.extend(found);
        }
    }
    row("all", &cases);
    println!();
    for (number, method) in methods.iter().enumerate().skip(1) {
        let behind = cases.iter().filter(|case| case.quality[number] >= case.quality[0]);
        let behind: Vec<String> = behind.map(|case| describe(case, number)).collect();
        println!("- not ahead of {} in {} of {} cases", method.name, behind.len(), cases.len());
        behind.iter().for_each(|case| println!("  - {case}"));
    }
    let below = cases.iter().filter(|case| case.quality[0] < 95.0);
    println!("- below 95 in {} cases", below.clone().count());
    below.for_each(|case| println!("  - {}: {:.2}", case.name, case.quality[0]));
    println!();
}

/// A frame's mean PQ by each method.
struct Case {
    name: String,
    quality: Vec<f64>,
}

fn case(frame: &Frame, methods: &[Method]) -> Case {
    let quality = methods.iter().map(|method| quality(method, [frame]));
    Case { name: format!("{} {}", frame.group, frame.name), quality: quality.collect() }
}

fn describe(case: &Case, other: usize) -> String {
    format!("{}: {:.2}, theirs {:.2}", case.name, case.quality[0], case.quality[other])
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
