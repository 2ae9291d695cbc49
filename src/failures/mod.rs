//! Which step of the method lost an object: the failures of a frame with truth, each with its cause.
//!
//! What a failure is, [`verdict`](crate::evaluate::verdict) says. Its cause is the first step of which one of
//! these holds; a *right* object has a match, and "seen" are points that own their pixel:
//!
//! | cause | holds if |
//! | --- | --- |
//! | mask | with true classes (without classes: true ground) in place of the given ones the run is right; or so many of its points are lost or misnamed that no clustering could be; or a spurious instance |
//! | projection | it is right among the seen points alone: the shadowed ones spoil it, or all of it is shadowed |
//! | divide | it is not right even if every component went to the true object that most of its pixels have: a component straddles two objects, or pixels are unreached |
//! | merge | votes joined a part of it with something else, or kept two parts of it apart; or nothing links two parts and no merge by size or gaps follows, whose job that is |
//! | post | bird's-eye, size or gap merge joined it with something else; size or gap merge left parts of it apart that nothing links; or the minimum size dropped it |
//! | method | another method than ours cut the objects: its steps are not known |
//! | unexplained | none of these does, or no single decision made the difference |
//!
//! Merges and joins form a tree over the parts of an instance. The one that is named is the one without which
//! the better of the two sides is most like the object; where none would make it better, none is named. What
//! is said of two parts that stayed apart comes from [`explain`](crate::explain::explain()).
//!
//! Listed are true objects without a match, and found instances that count as false where no listed true object
//! accounts for them: spurious ones, and pieces beside the match of a true object.

mod cause;
mod oracles;
mod tree;
mod words;

#[cfg(test)]
mod tests;

use serde::Serialize;

use crate::cloud::PointCloud;
use crate::evaluate::verdict::{Judged, Labelling, Rules, Segment, Verdict, Verdicts, verdicts};
use crate::explain::Frame;
use crate::instances::Detection;
use crate::pipeline::Stages;
use crate::taxonomy::Taxonomy;

pub use cause::{Cause, Divided, Merged, Posted};

/// A clustered frame with its truth.
#[derive(Debug, Clone, Copy)]
pub struct Case<'a> {
    /// The run that is judged.
    pub frame: Frame<'a>,
    /// What a detector found in the frame, for methods that want to know.
    pub detections: &'a [Detection],
    /// N: true class in the recording's ids.
    pub true_class: &'a [u16],
    /// N: id of the true segment, which points of one class and one instance share.
    pub true_id: &'a [u32],
    /// What the ids of classes mean.
    pub taxonomy: &'a Taxonomy,
    /// Unmatched objects of fewer points are no failures.
    pub min_points: u64,
}

/// Whose object it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// A true object.
    True,
    /// A found instance.
    Found,
}

/// An object that was not found, or an instance that should not be.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    /// Whose object it is.
    pub side: Side,
    /// The object and its verdict.
    #[serde(flatten)]
    pub judged: Judged,
    /// What lost it.
    pub cause: Cause,
    /// Points to look at, by index: one of the object; or one of each of two parts of it that are apart; or
    /// one of the object and one of what it is in one instance with.
    pub show: Vec<usize>,
    /// The pixels it lies in; none if it has none.
    pub pixels: Option<PixelBounds>,
}

/// A part of the range image.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PixelBounds {
    /// Rows from 0, the last left out.
    pub rows: std::ops::Range<usize>,
    /// Columns from 0, the last left out. What lies on both sides of the first column spans all of them.
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

/// Judges a frame and finds the cause of each failure.
///
/// # Panics
/// If the truth has not one class and one id per point.
pub fn failures(case: &Case) -> Failures {
    let verdicts = judge(case, case.frame.stages);
    let targets = targets(case, &verdicts);
    let mut failures = Vec::with_capacity(targets.len());
    if !targets.is_empty() {
        let oracles = oracles::Oracles::new(case);
        for target in targets {
            let (cause, show) = cause::cause(case, &oracles, &target);
            let Target { side, judged, points } = target;
            let pixels = pixel_bounds(case.frame.stages, &points);
            failures.push(Failure { side, judged, cause, show, pixels });
        }
    }
    failures.sort_by_key(|one| (std::cmp::Reverse(one.judged.points), one.side, one.judged.object));
    Failures { verdicts, failures }
}

/// A failure whose cause is looked for.
struct Target {
    side: Side,
    judged: Judged,
    /// Its points.
    points: Vec<usize>,
}

/// The verdicts on a run.
fn judge(case: &Case, stages: &Stages) -> Verdicts {
    let true_class = class_numbers(case.taxonomy, case.true_class);
    let found_class = class_numbers(case.taxonomy, &stages.labels.semantic);
    verdicts(
        case.frame.cloud,
        Labelling { class: &true_class, id: case.true_id },
        Labelling { class: &found_class, id: &stages.labels.instance },
        case.taxonomy,
        Rules { min_points: case.min_points, by_class: case.frame.stages.mask.has_classes() },
    )
}

/// Class numbers of raw ids; 0 for those that the taxonomy does not know.
fn class_numbers(taxonomy: &Taxonomy, raw: &[u16]) -> Vec<u16> {
    let class_of = taxonomy.lookup();
    raw.iter().map(|&id| class_of[usize::from(id)]).collect()
}

/// True failures, and found ones that no true failure accounts for.
fn targets(case: &Case, verdicts: &Verdicts) -> Vec<Target> {
    let of_truth = verdicts.truth.iter().filter(|judged| judged.is_failure());
    let is_accounted = |found: &Judged| {
        let of_true = found.parts.first().and_then(|part| verdicts.of_true(part.object));
        found.verdict != Verdict::Spurious && of_true.is_some_and(Judged::is_failure)
    };
    let of_found = verdicts.found.iter().filter(|one| one.is_failure() && !is_accounted(one));
    let true_class = class_numbers(case.taxonomy, case.true_class);
    let labels = &case.frame.stages.labels;
    let is_counted =
        |point: &usize| !case.taxonomy.classes()[usize::from(true_class[*point])].is_ignored;
    let all = || (0..true_class.len()).filter(is_counted);
    let of_truth = of_truth.map(|judged| {
        let Segment { class, id } = judged.object;
        let is_own = |&point: &usize| true_class[point] == class && case.true_id[point] == id;
        let points = all().filter(is_own).collect();
        Target { side: Side::True, judged: judged.clone(), points }
    });
    let of_found = of_found.map(|judged| {
        let is_own = |&point: &usize| labels.instance[point] == judged.object.id;
        let points = all().filter(is_own).collect();
        Target { side: Side::Found, judged: judged.clone(), points }
    });
    of_truth.chain(of_found).collect()
}

fn pixel_bounds(stages: &Stages, points: &[usize]) -> Option<PixelBounds> {
    let columns = stages.image.columns();
    let pixels = points.iter().filter_map(|&point| stages.image.pixel_of(point));
    let (rows, columns): (Vec<usize>, Vec<usize>) =
        pixels.map(|pixel| (pixel / columns, pixel % columns)).unzip();
    let span = |places: &[usize]| Some(*places.iter().min()?..*places.iter().max()? + 1);
    Some(PixelBounds { rows: span(&rows)?, columns: span(&columns)? })
}

/// The two points nearest to each other, one of each list; none if a list is empty.
fn nearest_pair(cloud: &PointCloud, a: &[usize], b: &[usize]) -> Option<[usize; 2]> {
    let position = |&point: &usize| cloud.position(point).map(f64::from);
    let tree = crate::kd_tree::KdTree::new(&b.iter().map(position).collect::<Vec<_>>());
    let mut best: Option<(f64, [usize; 2])> = None;
    for point in a {
        let reach = best.map_or(f64::INFINITY, |(squared, _)| squared.sqrt());
        if let Some(near) = tree.nearest(position(point), 1, reach).first()
            && best.is_none_or(|(least, _)| near.squared < least)
        {
            best = Some((near.squared, [*point, b[near.point as usize]]));
        }
    }
    best.map(|(_, pair)| pair)
}
