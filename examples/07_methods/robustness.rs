//! Table `robustness`: each kind of corruption by itself and all together, from 0 to 20 %, and what
//! each part of preset `best` is worth; the same as line charts.

use std::path::Path;

use anyhow::Result;
use divmerge::Taxonomy;
use divmerge::comparison::{Corruption, Surroundings};
use divmerge::view::{Line, LineChart, line_chart, line_charts, svg};

use crate::corrupted::{simulations, spoil};
use crate::frames::Frame;
use crate::methods::{self, Found, Method};
use crate::scores::{add, head, scores, things};

/// Shares that are spoiled.
const SHARES: [f64; 6] = [0.0, 0.01, 0.02, 0.05, 0.1, 0.2];

/// The share at which the parts are compared kind by kind.
const COMPARED: f64 = 0.1;

/// Side of patches, metres.
const PATCH: f64 = 0.5;

/// A corruption of real drives is drawn so often, with seeds of its own, and the figures are means:
/// their objects are few.
const DRAWS: u64 = 2;

/// A frame as it is seen, what each method finds in it, and points of things that are spoiled and
/// all.
type Run = (Frame, Vec<Found>, [usize; 2]);

/// A kind of corruption by name, and what a share of it is.
type Kind = (&'static str, fn(f64) -> Corruption);

/// The kinds; all together last.
const KINDS: [Kind; 9] = [
    ("border flips", |border_flips| Corruption { border_flips, ..none() }),
    ("border flips in patches", |border_flips| Corruption { border_flips, patch: PATCH, ..none() }),
    ("inner flicker", |inner_flicker| Corruption { inner_flicker, ..none() }),
    ("inner flicker in patches", |inner_flicker| Corruption {
        inner_flicker,
        patch: PATCH,
        ..none()
    }),
    ("lost people", |lost_people| Corruption { lost_people, ..none() }),
    ("ghosts", |ghosts| Corruption { ghosts, ..none() }),
    ("dropped returns", |dropped| Corruption { dropped, ..none() }),
    ("objects flicker", |flicker| Corruption { flicker, ..none() }),
    ("all together", all_together),
];

fn none() -> Corruption {
    Corruption { confidence: true, ..Corruption::default() }
}

fn all_together(share: f64) -> Corruption {
    Corruption {
        border_flips: share,
        inner_flicker: share,
        lost_people: share,
        ghosts: share,
        dropped: share,
        flicker: share,
        ..none()
    }
}

/// Prints the tables for real and simulated drives, that of the parts by kind for real ones alone;
/// writes `robustness-real.svg`, `robustness-simulated.svg` and `robustness-parts.svg` into a
/// folder.
pub fn tables(real: &[Frame], figures: Option<&Path>, seed: u64) -> Result<()> {
    let sets = [
        ("real", "Real drives", Drives::new(real.to_vec(), DRAWS, seed)),
        ("simulated", "Simulated", Drives::new(simulations(), 1, seed)),
    ];
    let mut of_parts = Vec::new();
    for (name, title, drives) in sets.iter().filter(|(.., drives)| !drives.frames.is_empty()) {
        let kinds = drives.kinds(title);
        if *name == "real" {
            drives.compared(title);
        }
        of_parts.push(drives.parts(title));
        if let Some(folder) = figures {
            let path = folder.join(format!("robustness-{name}.svg"));
            std::fs::write(path, svg(&line_chart(&kinds)))?;
        }
    }
    if let Some(folder) = figures {
        let title = "What the parts of preset best are worth, all kinds of corruption together";
        let page = svg(&line_charts(title, &of_parts));
        std::fs::write(folder.join("robustness-parts.svg"), page)?;
    }
    Ok(())
}

/// Frames with what lies around their points.
struct Drives {
    frames: Vec<Frame>,
    around: Vec<Surroundings>,
    draws: u64,
    seed: u64,
}

impl Drives {
    fn new(frames: Vec<Frame>, draws: u64, seed: u64) -> Self {
        let taxonomy = Taxonomy::semantic_kitti();
        let around = |frame: &Frame| Surroundings::new(&frame.cloud, &taxonomy);
        Drives { around: frames.iter().map(around).collect(), frames, draws, seed }
    }

    /// Mean PQ of some methods in percent, and the share of the points of things that the
    /// corruption takes away or names as something else.
    fn quality(&self, methods: &[Method], corruption: &Corruption) -> (Vec<f64>, f64) {
        let mut sums = vec![0.0; methods.len()];
        let (mut spoiled, mut all) = (0, 0);
        for draw in 0..self.draws {
            let mut scores: Vec<_> = methods.iter().map(|_| scores()).collect();
            for (seen, found, [hit, things]) in self.runs(methods, corruption, draw) {
                (spoiled, all) = (spoiled + hit, all + things);
                for (found, scores) in found.iter().zip(&mut scores) {
                    add(&seen, found, scores);
                }
            }
            for (sum, scores) in sums.iter_mut().zip(&scores) {
                *sum += things(scores, &[]).unwrap_or(0.0) / self.draws as f64;
            }
        }
        (sums, spoiled as f64 / all as f64)
    }

    /// Every frame as it is seen, what each method finds in it, and [`spoiled_things`]; on two
    /// threads.
    fn runs(&self, methods: &[Method], corruption: &Corruption, draw: u64) -> Vec<Run> {
        let count = self.frames.len();
        let run = |number: usize| {
            let seed = self.seed + draw * count as u64 + number as u64;
            let frame = &self.frames[number];
            let seen = spoil(frame, &self.around[number], corruption, seed);
            let found = methods.iter().map(|method| method.run(&seen)).collect();
            let spoiled = spoiled_things(frame, &seen);
            (seen, found, spoiled)
        };
        let half = |start: usize| (start..count).step_by(2).map(run).collect::<Vec<Run>>();
        std::thread::scope(|scope| {
            let odd = scope.spawn(|| half(1));
            let mut runs = half(0);
            runs.extend(odd.join().unwrap_or_else(|cause| std::panic::resume_unwind(cause)));
            runs
        })
    }

    /// Table: PQ of `best` by kind and share.
    fn kinds(&self, title: &str) -> LineChart {
        let shares = SHARES.map(|share| format!("{:.0} %", share * 100.0));
        let spoiled = "points of things spoiled at 20 %".to_owned();
        head(title, &shares.into_iter().chain([spoiled]).collect::<Vec<_>>());
        let best = [methods::best()];
        let (unspoiled, _) = self.quality(&best, &none());
        let mut lines = Vec::new();
        for (name, corruption) in KINDS {
            let mut points = vec![[0.0, unspoiled[0]]];
            let mut spoiled = 0.0;
            for share in &SHARES[1..] {
                let (found, of_things) = self.quality(&best, &corruption(*share));
                points.push([share * 100.0, found[0]]);
                spoiled = of_things * 100.0;
            }
            let found: Vec<f64> = points.iter().map(|point| point[1]).collect();
            println!("| {name} | {} | {spoiled:.1} % |", cells(&found));
            lines.push(Line { name: name.into(), points });
        }
        println!();
        lines.push(as_much_as_is_spoiled(unspoiled[0]));
        chart(format!("{title}: preset best with classes that are wrong"), lines)
    }

    /// Table: what each part of `best` is worth, kind by kind.
    fn compared(&self, title: &str) {
        let parts = methods::parts();
        let names: Vec<String> = parts.iter().map(|method| method.name.to_owned()).collect();
        head(&format!("{title}, {:.0} % spoiled", COMPARED * 100.0), &names);
        for (name, corruption) in KINDS {
            let (found, _) = self.quality(&parts, &corruption(COMPARED));
            println!("| {name} | {} |", cells(&found));
        }
        println!();
    }

    /// Table: what each part of `best` is worth with all kinds together, by share.
    fn parts(&self, title: &str) -> LineChart {
        let parts = methods::parts();
        let names: Vec<String> = parts.iter().map(|method| method.name.to_owned()).collect();
        head(&format!("{title}, all together"), &names);
        let line = |method: &Method| Line { name: method.name.replace('`', ""), points: vec![] };
        let mut lines: Vec<Line> = parts.iter().map(line).collect();
        let (_, corruption) = KINDS[KINDS.len() - 1];
        for share in SHARES {
            let (found, _) = self.quality(&parts, &corruption(share));
            println!("| {:.0} % | {} |", share * 100.0, cells(&found));
            for (line, quality) in lines.iter_mut().zip(found) {
                line.points.push([share * 100.0, quality]);
            }
        }
        println!();
        lines.push(as_much_as_is_spoiled(lines[0].points[0][1]));
        chart(title.to_owned(), lines)
    }
}

/// Points of things whose class is wrong or that are gone, and all points of things.
fn spoiled_things(truth: &Frame, seen: &Frame) -> [usize; 2] {
    let taxonomy = Taxonomy::semantic_kitti();
    let given = crate::frames::classes(seen.cloud.class.as_deref().unwrap_or_default());
    let is_thing =
        |&point: &usize| taxonomy.classes()[usize::from(truth.true_class[point])].is_thing;
    let is_spoiled =
        |&point: &usize| !seen.cloud.is_return(point) || given[point] != truth.true_class[point];
    let points = (0..given.len()).filter(is_thing);
    [points.clone().filter(is_spoiled).count(), points.count()]
}

fn cells(found: &[f64]) -> String {
    found.iter().map(|quality| format!("{quality:.2}")).collect::<Vec<_>>().join(" | ")
}

/// A straight line that loses the share that is spoiled.
fn as_much_as_is_spoiled(whole: f64) -> Line {
    let points = SHARES.map(|share| [share * 100.0, whole * (1.0 - share)]);
    Line { name: "as much as is spoiled".into(), points: points.to_vec() }
}

fn chart(title: String, lines: Vec<Line>) -> LineChart {
    LineChart {
        title,
        x_name: "% spoiled".into(),
        y_name: "Mean PQ of things, %".into(),
        is_log: false,
        x_ticks: SHARES.map(|share| share * 100.0).into_iter().filter(|t| *t != 1.0).collect(),
        lines,
    }
}
