//! The step that lost an object, with its numbers.

use serde::Serialize;

use crate::diagnose::explain::{Link, PostMergeStage};
use divmerge_core::cluster::Join;

/// The step that lost an object, with its numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "step", rename_all = "snake_case")]
pub enum Cause {
    /// The semantics or the ground removal lost it, or gave it a wrong class.
    Mask {
        /// Points of the object.
        points: u64,
        /// How many of them are taken for no object.
        not_objects: u64,
        /// How many of them are object points of another class.
        other_class: u64,
        /// Name of the class that most of the wrong points were given; none without classes, or
        /// without a wrong point.
        given: Option<String>,
    },
    /// Points that do not own their pixel got wrong labels or none.
    Projection {
        /// Points of the object.
        points: u64,
        /// How many of them are shadowed.
        shadowed: u64,
        /// How many of the shadowed ones have no instance.
        unlabelled: u64,
    },
    /// No merge of the components could make it right.
    Divide(DivideCause),
    /// The votes joined it with something else, or left it apart.
    Merge(MergeCause),
    /// A stage after the votes joined it with something else, left it apart or dropped it.
    Post(Box<PostMergeCause>),
    /// Another method segmented the objects, and keeps no steps to look at.
    Method {
        /// Its name.
        name: &'static str,
    },
    /// No oracle makes it right, and no single decision spoiled it.
    Unexplained,
}

/// How the divide step lost an object.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "how", rename_all = "snake_case")]
pub enum DivideCause {
    /// A component lies in two objects, or in an object and beside it.
    Straddles {
        /// Its label.
        component: u32,
        /// Its pixels in the object.
        own: u64,
        /// All its pixels.
        pixels: u64,
    },
    /// No seed reached many of its pixels.
    Unreached {
        /// Pixels of the object that no seed reached.
        unreached: u64,
        /// Pixels of the object.
        pixels: u64,
    },
}

/// How the merge step lost an object.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "how", rename_all = "snake_case")]
pub enum MergeCause {
    /// One merge joined most of it with something else.
    Joined {
        /// The component that was joined.
        target: u32,
        /// The component that joined.
        query: u32,
        /// V+, inherited votes included.
        positive: u64,
        /// V-, inherited votes included.
        negative: u64,
    },
    /// The votes kept two parts apart: the weakest link of the best path between them.
    Apart(Box<Link>),
    /// No pair of neighbouring pixels links two parts, and the run has no later merge that could
    /// join them.
    Unlinked {
        /// Pairs of pixels on their border, all of which fail the condition; 0 without a border.
        border: usize,
        /// Distance between them, metres.
        distance: f64,
    },
}

/// How a stage after the merge step lost an object.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "how", rename_all = "snake_case")]
pub enum PostMergeCause {
    /// One join by size put most of it together with something else.
    Joined(Join),
    /// The bird's-eye merge, or the cut of the tree of merges, left it together with something
    /// else.
    Overlapped(PostMergeStage),
    /// The merge by size, or the cut of the tree of merges, left two parts apart.
    Apart(PostMergeStage),
    /// Its instance had too few pixels.
    TooSmall {
        /// Pixels of the object that were dropped.
        dropped: u64,
        /// Pixels of the object.
        pixels: u64,
        /// The minimum.
        minimum: usize,
    },
}

impl Cause {
    /// Names of all steps.
    pub const STEPS: [&'static str; 7] =
        ["mask", "projection", "divide", "merge", "post", "method", "unexplained"];

    /// Name of the step.
    pub fn step(&self) -> &'static str {
        match self {
            Cause::Mask { .. } => "mask",
            Cause::Projection { .. } => "projection",
            Cause::Divide(_) => "divide",
            Cause::Merge(_) => "merge",
            Cause::Post(_) => "post",
            Cause::Method { .. } => "method",
            Cause::Unexplained => "unexplained",
        }
    }
}
