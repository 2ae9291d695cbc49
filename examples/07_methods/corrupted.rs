//! Table `corrupted`: how the methods bear classes that are wrong, and the same as line charts.

use std::path::Path;

use anyhow::Result;
use divmerge::Taxonomy;
use divmerge::comparison::{Corruption, Surroundings, corrupt};
use divmerge::simulate::{Scene, Sensor};
use divmerge::view::{Line, LineChart, line_chart, svg};

use crate::frames::{Frame, simulated};
use crate::methods::{self, Method};
use crate::scores::{head, quality};

/// Shares of the border band that are flipped.
const FLIPS: [f64; 7] = [0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3];

/// Side of patches, metres.
const PATCH: f64 = 0.5;

/// Prints a table each for real and simulated drives; writes `corrupted-real.svg` and
/// `corrupted-simulated.svg` into a folder. Each frame has a seed of its own, from `seed` upwards.
pub fn tables(real: &[Frame], figures: Option<&Path>, seed: u64) -> Result<()> {
    let sets = [("real", "Real drives", real.to_vec()), ("simulated", "Simulated", simulations())];
    for (name, title, frames) in sets.iter().filter(|(_, _, frames)| !frames.is_empty()) {
        let chart = table(title, frames, seed);
        if let Some(folder) = figures {
            std::fs::write(folder.join(format!("corrupted-{name}.svg")), svg(&line_chart(&chart)))?;
        }
    }
    Ok(())
}

/// Two frames of each scene and sensor.
pub fn simulations() -> Vec<Frame> {
    let each =
        |scene| Sensor::USUAL.map(|sensor| [1, 2].map(|seed| simulated(scene, sensor, seed)));
    Scene::USUAL.map(each).into_iter().flatten().flatten().collect()
}

/// Rows in the table: words and what they stand for. The flips come first.
fn rows() -> Vec<(String, Corruption)> {
    let none = Corruption::default();
    let flips = FLIPS.map(|border_flips| {
        (
            format!("{:.0} % of the border flipped", border_flips * 100.0),
            Corruption { border_flips, ..none },
        )
    });
    let spoiled = Corruption { border_flips: 0.3, lost_people: 0.2, ..none };
    let patches = |border_flips| Corruption { border_flips, patch: PATCH, ..none };
    let others = [
        ("5 % flipped in patches of 0.5 m", patches(0.05)),
        ("30 % flipped in patches of 0.5 m", patches(0.3)),
        ("30 % flipped, 20 % of people's points lost", spoiled),
        ("20 % of people's points lost", Corruption { lost_people: 0.2, ..none }),
        ("10 % of objects flicker", Corruption { flicker: 0.1, ..none }),
        ("30 % of objects flicker", Corruption { flicker: 0.3, ..none }),
        ("10 % of returns dropped", Corruption { dropped: 0.1, ..none }),
        ("30 % of returns dropped", Corruption { dropped: 0.3, ..none }),
    ];
    flips
        .into_iter()
        .chain(others.map(|(name, corruption)| (name.to_owned(), corruption)))
        .collect()
}

fn table(title: &str, frames: &[Frame], first_seed: u64) -> LineChart {
    let methods = [
        methods::best(),
        methods::true_instances(),
        methods::alpine(),
        methods::euclidean(),
        methods::euclidean_classless(),
        methods::dbscan(),
        methods::paper(),
        methods::paper_own_class(),
    ];
    head(title, &methods.iter().map(|method| method.name.to_owned()).collect::<Vec<_>>());
    let taxonomy = Taxonomy::semantic_kitti();
    let around: Vec<Surroundings> =
        frames.iter().map(|frame| Surroundings::new(&frame.cloud, &taxonomy)).collect();
    let mut lines = methods
        .each_ref()
        .map(|method: &Method| Line { name: method.name.replace('`', ""), points: Vec::new() });
    for (number, (name, corruption)) in rows().into_iter().enumerate() {
        let spoiled: Vec<Frame> = (first_seed..)
            .zip(frames.iter().zip(&around))
            .map(|(seed, (frame, around))| spoil(frame, around, &corruption, seed))
            .collect();
        let found = methods.each_ref().map(|method| quality(method, &spoiled));
        if number < FLIPS.len() {
            for (line, quality) in lines.iter_mut().zip(found) {
                line.points.push([corruption.border_flips * 100.0, quality]);
            }
        }
        println!("| {name} | {} |", found.map(|quality| format!("{quality:.2}")).join(" | "));
    }
    let band: usize = around.iter().map(Surroundings::band).sum();
    let points: usize = frames.iter().map(|frame| frame.cloud.len()).sum();
    println!(
        "\nThe border band holds {:.1} % of the points.\n",
        band as f64 / points as f64 * 100.0
    );
    LineChart {
        title: format!("{title}: classes flipped at the borders of objects"),
        x_name: "% of the points in the border band".into(),
        y_name: "Mean PQ of things, %".into(),
        is_log: false,
        x_ticks: FLIPS.map(|share| share * 100.0).into_iter().filter(|t| *t != 1.0).collect(),
        lines: lines.to_vec(),
    }
}

/// The frame as a network might see it. Dropped returns are no part of the truth any more.
pub fn spoil(frame: &Frame, around: &Surroundings, corruption: &Corruption, seed: u64) -> Frame {
    let taxonomy = Taxonomy::semantic_kitti();
    let cloud = corrupt(&frame.cloud, &frame.true_id, (&taxonomy, around), corruption, seed);
    let mut true_class = frame.true_class.clone();
    for point in (0..cloud.len()).filter(|&point| !cloud.is_return(point)) {
        true_class[point] = 0;
    }
    Frame { cloud, true_class, ..frame.clone() }
}
