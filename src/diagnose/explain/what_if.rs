//! The counterfactual: the smallest change of each parameter alone that gives the other answer,
//! found by running it.
//!
//! The answer is not monotone in most parameters, so a coarse scan from the present value outwards
//! finds the first value with the other answer, and a bisection between it and the value before
//! narrows it down. A narrower island between two values of the scan may be missed.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::Serialize;
use serde_json::Value;

use super::dials::{self, Dial};
use super::in_force::{OVER_TIME, is_of_mask, is_part_of, why_idle};
use super::subject::{Answer, ClusteredCloud, Subject, answer};
use divmerge_core::cluster::params::{BirdsEye, ClusterParams, Region};
use divmerge_core::parameters::{Parameter, ParameterKind, ParameterSet};
use divmerge_core::pipeline;
use divmerge_core::semantics::{GroundParams, MaskSource};

/// One parameter, and what it takes to get the other answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum WhatIf {
    /// A parameter that is a number.
    Number(Number),
    /// A parameter that is one of a few.
    Choice(Choice),
}

/// A numeric parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Number {
    /// Its name, as in `angle`; its path where it has none.
    pub parameter: &'static str,
    /// Its path among all parameters ([`ParameterSet`](divmerge_core::parameters::ParameterSet)).
    #[serde(skip)]
    pub path: &'static str,
    /// Its unit; empty for a bare number.
    pub unit: &'static str,
    /// Its value in this run, in that unit; a gap that may be of any size is the image's size.
    pub now: f64,
    /// The values that were searched, from and to.
    pub searched: [f64; 2],
    /// The greatest value below the present one that gives the other answer.
    pub lower: Option<Flip>,
    /// The least value above the present one that gives the other answer.
    pub higher: Option<Flip>,
}

impl Number {
    /// The smaller of the two changes.
    pub fn smallest(&self) -> Option<Flip> {
        let flips = [self.lower, self.higher].into_iter().flatten();
        let change = |flip: &Flip| (flip.value - self.now).abs();
        flips.min_by(|a, b| change(a).total_cmp(&change(b)))
    }
}

/// A value that gives the other answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Flip {
    /// The value.
    pub value: f64,
    /// The next value towards the present one, which was run too and does not.
    pub unchanged_at: f64,
}

/// A parameter that is one of a few.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Choice {
    /// Its name, as in `bird's-eye merge`; its path where it has none.
    pub parameter: &'static str,
    /// Its path among all parameters; none of what is several of them.
    #[serde(skip)]
    pub path: Option<&'static str>,
    /// Its value in this run.
    pub now: &'static str,
    /// The other values, all of which were run.
    pub tried: Vec<&'static str>,
    /// Those that give the other answer.
    pub flips: Vec<&'static str>,
}

/// For each parameter in force the smallest change, all others as they are, that gives the other
/// answer: those with names first, then the others by path. Where a point is no object only what
/// decides on objects is searched.
///
/// Runs the pipeline on the frame some hundred times, on as many threads as there are cores.
///
/// # Panics
/// If a point is not in the cloud.
pub fn what_if(frame: &ClusteredCloud, subject: Subject) -> Vec<WhatIf> {
    what_if_while(frame, subject, &|| true)
}

/// The same for as long as `goes_on` says so, which is asked before each run; what is returned of a
/// search that was called off means nothing.
///
/// # Panics
/// If a point is not in the cloud.
pub fn what_if_while(
    frame: &ClusteredCloud,
    subject: Subject,
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Vec<WhatIf> {
    let search = Search::new(frame, subject, goes_on);
    let changes = search.changes();
    let found: Mutex<Vec<(usize, WhatIf)>> = Mutex::default();
    let next = AtomicUsize::new(0);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..cores.min(changes.len()) {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some(change) = changes.get(number) else { break };
                    if let Some(result) = search.searched(change) {
                        found.lock().expect("no worker panicked").push((number, result));
                    }
                }
            });
        }
    });
    let mut found = found.into_inner().expect("no worker panicked");
    found.sort_by_key(|&(number, _)| number);
    found.into_iter().map(|(_, result)| result).collect()
}

/// What can be changed.
enum Change {
    Dial(Dial),
    OnThePlane,
    SameClass,
    /// A parameter that is one of a few.
    Named(&'static Parameter),
}

struct Search<'a> {
    frame: &'a ClusteredCloud<'a>,
    subject: Subject,
    goes_on: &'a (dyn Fn() -> bool + Sync),
    now: Answer,
    /// Every parameter of the run.
    set: ParameterSet,
}

impl<'a> Search<'a> {
    fn new(
        frame: &'a ClusteredCloud<'a>,
        subject: Subject,
        goes_on: &'a (dyn Fn() -> bool + Sync),
    ) -> Self {
        let usual = GroundParams::default();
        let ground = removed_ground(frame.mask).unwrap_or(&usual);
        let set = ParameterSet::of(frame.config, ground);
        Search { frame, subject, goes_on, now: answer(frame.stages, subject), set }
    }

    /// Whether the run cut a tree of merges.
    fn is_cut(&self) -> bool {
        self.frame.stages.post_merge.tree.is_some()
    }

    /// What is in force and may matter.
    fn changes(&self) -> Vec<Change> {
        let is_object = |point: usize| self.frame.stages.mask.is_object[point];
        let are_objects = self.subject.points().into_iter().all(is_object);
        let has_ground = removed_ground(self.frame.mask).is_some();
        let is_wanted = |path: &str| {
            (are_objects || is_of_mask(path))
                && (has_ground || !is_part_of(path, &["ground"]))
                && !is_part_of(path, &OVER_TIME)
                && why_idle(self.frame, path).is_none()
        };
        let mut changes: Vec<Change> = Vec::new();
        if are_objects {
            changes.extend(dials::known(self.is_cut()).into_iter().map(Change::Dial));
            // Neither is in force where a tree is cut.
            if !self.is_cut() {
                changes.extend([Change::OnThePlane, Change::SameClass]);
            }
        }
        let is_in_one_of_those = |path: &str| !self.is_cut() && OF_CHOICES.contains(&path);
        for parameter in dials::others(|path| is_wanted(path) && !is_in_one_of_those(path)) {
            match Dial::of(parameter, &self.set) {
                Some(dial) => changes.push(Change::Dial(dial)),
                None => changes.push(Change::Named(parameter)),
            }
        }
        changes
    }

    fn searched(&self, change: &Change) -> Option<WhatIf> {
        match change {
            Change::Dial(dial) => self.number(dial).map(WhatIf::Number),
            Change::OnThePlane => Some(WhatIf::Choice(self.on_the_plane())),
            Change::SameClass => Some(WhatIf::Choice(self.same_class())),
            Change::Named(parameter) => self.named(parameter).map(WhatIf::Choice),
        }
    }

    /// Whether a change of the parameters changes the answer. `change` says whether it may be.
    fn flips(&self, change: impl FnOnce(&mut ParameterSet) -> bool) -> bool {
        let mut set = self.set.clone();
        if !(self.goes_on)() || !change(&mut set) {
            return false;
        }
        let mask = match self.frame.mask {
            MaskSource::NotGround(_) => MaskSource::NotGround(&set.ground),
            MaskSource::NetworkClasses(taxonomy, _) => {
                MaskSource::NetworkClasses(taxonomy, &set.ground)
            }
            other => other,
        };
        let stages = pipeline::run(self.frame.cloud, mask, &set.config());
        answer(&stages, self.subject) != self.now
    }

    fn number(&self, dial: &Dial) -> Option<Number> {
        let image = &self.frame.stages.image;
        // A gap that may be of any size is one of the image's size.
        let most = image.rows().max(image.columns()).max(1 << 20) as f64;
        let now = dial.read(&self.set)?.min(most);
        let below: Vec<f64> =
            dial.scan.iter().copied().filter(|&value| value < now).rev().collect();
        let above: Vec<f64> = dial.scan.iter().copied().filter(|&value| value > now).collect();
        Some(Number {
            parameter: dial.name,
            path: dial.path,
            unit: dial.unit,
            now,
            searched: [dial.scan[0], dial.scan[dial.scan.len() - 1]],
            lower: self.first_flip(dial, now, &below),
            higher: self.first_flip(dial, now, &above),
        })
    }

    /// The first value of a scan away from `now` that flips the answer, narrowed down.
    fn first_flip(&self, dial: &Dial, now: f64, scan: &[f64]) -> Option<Flip> {
        let flips = |value: f64| self.flips(|set| dial.set(set, value));
        let place = scan.iter().position(|&value| flips(value))?;
        let before = if place == 0 { now } else { scan[place - 1] };
        let steps = |value: f64| value * dial.per_unit;
        // In whole steps, so that the values found are those that people write: 12.35, not
        // 12.349999.
        let mut flipped = steps(scan[place]).round() as i64;
        let up = scan[place] > now;
        let nearest = if up { steps(before) + 1e-6 } else { steps(before) - 1e-6 };
        let mut unchanged = if up { nearest.floor() } else { nearest.ceil() } as i64;
        while (flipped - unchanged).abs() > 1 {
            let middle = unchanged + (flipped - unchanged) / 2;
            let is_flipped = flips(middle as f64 / dial.per_unit);
            *(if is_flipped { &mut flipped } else { &mut unchanged }) = middle;
        }
        let value = |steps: i64| steps as f64 / dial.per_unit;
        let unchanged_at = if up { value(unchanged).max(now) } else { value(unchanged).min(now) };
        Some(Flip { value: value(flipped), unchanged_at })
    }

    fn on_the_plane(&self) -> Choice {
        let now = &self.frame.config.cluster;
        let is_now = |plane: Plane| match plane {
            Plane::BySize => now.fragments.is_some(),
            Plane::Off => now.fragments.is_none() && now.birds_eye.is_none(),
            Plane::Overlap(region) => {
                now.fragments.is_none() && now.birds_eye.is_some_and(|now| now.region == region)
            }
        };
        let only_boxes = now.birds_eye.is_some_and(|now| !now.transitive || now.grown_pixels_only);
        let is_possible = |plane: Plane| {
            !only_boxes || !matches!(plane, Plane::Overlap(Region::Rectangle | Region::Hull))
        };
        let tried: Vec<Plane> =
            PLANES.into_iter().filter(|&plane| !is_now(plane) && is_possible(plane)).collect();
        let set = |plane: &Plane, set: &mut ParameterSet| {
            plane.set(&mut set.cluster);
            true
        };
        let flips = tried.iter().filter(|plane| self.flips(|changed| set(plane, changed)));
        Choice {
            parameter: "bird's-eye merge",
            path: None,
            now: PLANES.into_iter().find(|&plane| is_now(plane)).map_or("other", Plane::name),
            flips: flips.map(|plane| plane.name()).collect(),
            tried: tried.iter().map(|plane| plane.name()).collect(),
        }
    }

    fn same_class(&self) -> Choice {
        let now = self.frame.config.cluster.same_class_neighbours;
        let name = |only: bool| if only { "only" } else { "any" };
        let flips = self.flips(|set| {
            set.cluster.same_class_neighbours = !now;
            true
        });
        Choice {
            parameter: "neighbours of one class",
            path: Some("cluster.same_class_neighbours"),
            now: name(now),
            tried: vec![name(!now)],
            flips: if flips { vec![name(!now)] } else { Vec::new() },
        }
    }

    /// A parameter that is one of a few, or on or off; `None` of one that is off with its part.
    fn named(&self, parameter: &'static Parameter) -> Option<Choice> {
        let path = parameter.path.as_str();
        let (now, others) = match (&parameter.kind, self.set.get(path).ok()??) {
            (ParameterKind::Switch | ParameterKind::Flag, Value::Bool(is_on)) => {
                let word = |is_on: bool| if is_on { "on" } else { "off" };
                (word(is_on), vec![word(!is_on)])
            }
            (ParameterKind::Choice { choices }, Value::String(now)) => {
                let mut names: Vec<&str> = choices.iter().map(|one| one.name.as_str()).collect();
                let place = names.iter().position(|&name| name == now)?;
                (names.remove(place), names)
            }
            _ => return None,
        };
        let flips = |name: &&str| self.flips(|set| set.set(path, &Value::from(*name)).is_ok());
        let flips = others.iter().copied().filter(flips).collect();
        Some(Choice { parameter: path, path: Some(path), now, tried: others, flips })
    }
}

/// The ground removal of a mask that has one.
fn removed_ground(mask: MaskSource<'_>) -> Option<&GroundParams> {
    match mask {
        MaskSource::NotGround(ground) | MaskSource::NetworkClasses(_, ground) => Some(ground),
        _ => None,
    }
}

/// What [`Search::on_the_plane`] and [`Search::same_class`] change.
const OF_CHOICES: [&str; 5] = [
    "cluster.birds_eye",
    "cluster.birds_eye.region",
    "cluster.fragments",
    "cluster.tree",
    "cluster.same_class_neighbours",
];

/// What may be done on the bird's-eye plane after the votes.
#[derive(Debug, Clone, Copy)]
enum Plane {
    Off,
    Overlap(Region),
    BySize,
}

const PLANES: [Plane; 5] = [
    Plane::Off,
    Plane::Overlap(Region::Box),
    Plane::Overlap(Region::Rectangle),
    Plane::Overlap(Region::Hull),
    Plane::BySize,
];

impl Plane {
    fn name(self) -> &'static str {
        match self {
            Plane::Off => "off",
            Plane::Overlap(Region::Box) => "box",
            Plane::Overlap(Region::Rectangle) => "rectangle",
            Plane::Overlap(Region::Hull) => "hull",
            Plane::BySize => "size",
        }
    }

    fn set(self, params: &mut ClusterParams) {
        let overlap = |region: Region| {
            let own = params.birds_eye.or(ClusterParams::paper().birds_eye);
            own.map(|own| BirdsEye { region, ..own })
        };
        let best = ClusterParams::best();
        (params.birds_eye, params.fragments, params.tree) = match self {
            Plane::Off => (None, None, None),
            Plane::Overlap(region) => (overlap(region), None, None),
            Plane::BySize => (None, best.fragments, best.tree),
        };
    }
}
