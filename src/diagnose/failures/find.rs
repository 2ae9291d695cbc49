//! The failures of a frame, each with its cause.

use serde::Serialize;

use super::case::{LabelledRun, ObjectOrigin, Target};
use super::cause::Cause;
use super::oracles::Oracles;
use super::search;
use crate::evaluate::verdict::{JudgedObject, Labelling, Segment, Verdict, Verdicts};
use divmerge_core::pipeline::Stages;

/// An object that was not found, or an instance that should not be.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    /// Whose object it is.
    pub side: ObjectOrigin,
    /// The object and its verdict.
    #[serde(flatten)]
    pub judged: JudgedObject,
    /// What lost it.
    pub cause: Cause,
    /// Whether the run is right with true classes in place of the given ones, or without classes
    /// with the true ground; false where the mask is true.
    pub is_right_with_true_mask: bool,
    /// Points to look at, by index: one of the object; or one of each of two parts of it that are
    /// apart; or one of the object and one of what it is in one instance with.
    pub show: Vec<usize>,
    /// The pixels it lies in; none if it has none.
    pub pixels: Option<PixelBounds>,
}

/// A part of the range image.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PixelBounds {
    /// Rows from 0, the last excluded.
    pub rows: std::ops::Range<usize>,
    /// Columns from 0, the last excluded. An object on both sides of the first column spans all.
    pub columns: std::ops::Range<usize>,
}

/// A frame's verdicts and failures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failures {
    /// All verdicts.
    pub verdicts: Verdicts,
    /// The failures, the one of most points first.
    pub failures: Vec<Failure>,
}

/// Finds the failures of a frame and the cause of each.
///
/// # Panics
/// If the truth has not one class and one id per point.
pub fn failures(run: &LabelledRun) -> Failures {
    let stages = run.frame.stages;
    let true_class = run.true_class_numbers();
    let found_class = run.taxonomy.class_numbers(&stages.labels.semantic);
    let found = Labelling { class: &found_class, id: &stages.labels.instance };
    let verdicts = run.verdicts(&true_class, found, stages.mask.has_classes());
    let targets = targets(run, &true_class, &verdicts);
    let mut failures = Vec::with_capacity(targets.len());
    if !targets.is_empty() {
        let oracles = Oracles::new(run, true_class);
        for target in targets {
            let (cause, show) = search::cause(run, &oracles, &target);
            let is_right_with_true_mask = oracles.is_right_with_true_mask(&target);
            let Target { side, judged, points } = target;
            let pixels = pixel_bounds(stages, &points);
            failures.push(Failure { side, judged, cause, is_right_with_true_mask, show, pixels });
        }
    }
    failures.sort_by_key(|one| (std::cmp::Reverse(one.judged.points), one.side, one.judged.object));
    Failures { verdicts, failures }
}

/// True failures, and found ones that no true failure accounts for.
fn targets(run: &LabelledRun, true_class: &[u16], verdicts: &Verdicts) -> Vec<Target> {
    let of_truth = verdicts.truth.iter().filter(|judged| judged.is_failure());
    let is_accounted = |found: &JudgedObject| {
        let of_true = found.parts.first().and_then(|part| verdicts.of_true(part.object));
        found.verdict != Verdict::Spurious && of_true.is_some_and(JudgedObject::is_failure)
    };
    let of_found = verdicts.found.iter().filter(|one| one.is_failure() && !is_accounted(one));
    let instance = &run.frame.stages.labels.instance;
    let classes = run.taxonomy.classes();
    let target = |side: ObjectOrigin, judged: &JudgedObject| {
        let Segment { class, id } = judged.object;
        let is_own = |&point: &usize| match side {
            ObjectOrigin::True => true_class[point] == class && run.true_id[point] == id,
            ObjectOrigin::Found => instance[point] == id,
        };
        let is_counted = |&point: &usize| !classes[usize::from(true_class[point])].is_ignored;
        let points = (0..true_class.len()).filter(is_counted).filter(is_own).collect();
        Target { side, judged: judged.clone(), points }
    };
    let of_truth = of_truth.map(|judged| target(ObjectOrigin::True, judged));
    of_truth.chain(of_found.map(|judged| target(ObjectOrigin::Found, judged))).collect()
}

fn pixel_bounds(stages: &Stages, points: &[usize]) -> Option<PixelBounds> {
    let columns = stages.image.columns();
    let pixels = points.iter().filter_map(|&point| stages.image.pixel_of(point));
    let (rows, columns): (Vec<usize>, Vec<usize>) =
        pixels.map(|pixel| (pixel / columns, pixel % columns)).unzip();
    let span = |places: &[usize]| Some(*places.iter().min()?..*places.iter().max()? + 1);
    Some(PixelBounds { rows: span(&rows)?, columns: span(&columns)? })
}
