//! Causes in words.

use super::cause::{Cause, DivideCause, MergeCause, PostMergeCause};
use crate::diagnose::explain::PostMergeStage;
use divmerge_core::cluster::{Evidence, Join};

impl Cause {
    /// A sentence that describes the cause, with its numbers.
    pub fn describe(&self) -> String {
        match self {
            Cause::Mask { points, not_objects, other_class, given } => {
                mask(*points, *not_objects, *other_class, given.as_deref())
            }
            Cause::Projection { points, shadowed, unlabelled } => format!(
                "right among the points that own their pixel; {shadowed} of {points} are shadowed, \
                 {unlabelled} of them without an instance"
            ),
            Cause::Divide(divided) => divided.describe(),
            Cause::Merge(merged) => merged.describe(),
            Cause::Post(posted) => posted.describe(),
            Cause::Method { name } => format!("{name} segmented it so, and keeps no steps"),
            Cause::Unexplained => "no single step or decision explains it".into(),
        }
    }
}

fn mask(points: u64, not_objects: u64, other_class: u64, given: Option<&str>) -> String {
    let most = given.map_or(String::new(), |class| format!(", mostly {class}"));
    match (not_objects, other_class) {
        (0, 0) => "right with true classes around it; its own points have their true class".into(),
        (lost, 0) => format!("{lost} of {points} points are taken for no object{most}"),
        (0, misnamed) => format!("{misnamed} of {points} points are of another class{most}"),
        (lost, misnamed) => format!(
            "{lost} of {points} points are taken for no object, {misnamed} for another class{most}"
        ),
    }
}

impl DivideCause {
    fn describe(&self) -> String {
        match self {
            DivideCause::Straddles { component, own, pixels } => {
                format!(
                    "component {component} straddles: {own} of its {pixels} pixels are the object's"
                )
            }
            DivideCause::Unreached { unreached, pixels } => {
                format!("no seed reached {unreached} of its {pixels} pixels")
            }
        }
    }
}

impl MergeCause {
    fn describe(&self) -> String {
        match self {
            MergeCause::Joined { target, query, positive, negative } => format!(
                "component {query} joined component {target} with V+ {positive} to V- {negative}"
            ),
            MergeCause::Apart(link) => format!(
                "components {} and {} stayed apart with V+ {} to V- {}",
                link.target, link.query, link.positive, link.negative
            ),
            MergeCause::Unlinked { border: 0, distance } => {
                format!("nothing links two parts {distance:.2} m apart: they have no common border")
            }
            MergeCause::Unlinked { border, distance } => format!(
                "nothing links two parts {distance:.2} m apart: none of the {border} pairs of \
                 pixels on their border passes the condition"
            ),
        }
    }
}

impl PostMergeCause {
    fn describe(&self) -> String {
        match self {
            PostMergeCause::Joined(join) => joined(join),
            PostMergeCause::Overlapped(PostMergeStage::Cut(_)) => {
                "the cut of the tree of merges left it joined with something else".into()
            }
            PostMergeCause::Overlapped(_) => {
                "the bird's-eye merge joined overlapping regions".into()
            }
            PostMergeCause::Apart(stage) => apart(stage),
            PostMergeCause::TooSmall { dropped, pixels, minimum } => format!(
                "{dropped} of its {pixels} pixels were in instances under the minimum of {minimum}"
            ),
        }
    }
}

fn joined(Join { target, query, gap, evidence }: &Join) -> String {
    let why = match evidence {
        Evidence::Touching => "touching".into(),
        Evidence::Fits { union, limit } => {
            format!("together {}, within {}", sides(*union), sides(*limit))
        }
    };
    format!("group {query} joined group {target} across {gap:.2} m, {why}")
}

fn apart(stage: &PostMergeStage) -> String {
    match stage {
        PostMergeStage::Fragments { classes_differ: true, .. } => {
            "the merge by size left two parts apart: their classes differ".into()
        }
        PostMergeStage::Fragments { test: Some(test), .. } => {
            let gap = test.gap;
            let union = sides(test.union);
            let why = if gap >= test.too_far {
                format!("a gap of {gap:.2} m, bridged up to {:.2} m", test.too_far)
            } else if gap <= test.touching {
                format!("they touch, but together are {union}, wider than {:.2} m", test.widest)
            } else {
                format!("together {union}, larger than {} across {gap:.2} m", sides(test.limit))
            };
            format!("the merge by size left two parts apart: {why}")
        }
        PostMergeStage::Cut(_) => "the cut of the tree of merges left two parts apart".into(),
        _ => "the merge after the votes left two parts apart".into(),
    }
}

fn sides([length, width]: [f64; 2]) -> String {
    format!("{length:.1} x {width:.1} m")
}
