//! A clustered frame with its truth, and an object whose loss is to be explained.

use serde::Serialize;

use crate::diagnose::explain::ClusteredCloud;
use crate::evaluate::verdict::{JudgedObject, Labelling, MatchRules, Verdicts, verdicts};
use divmerge_core::cloud::Detection;
use divmerge_core::cloud::taxonomy::Taxonomy;

/// A clustered frame with its truth.
#[derive(Debug, Clone, Copy)]
pub struct LabelledRun<'a> {
    /// The run whose failures are looked for.
    pub frame: ClusteredCloud<'a>,
    /// What a detector found in the frame, for methods that use detections.
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

impl LabelledRun<'_> {
    /// N: true class number; 0 of ids that the taxonomy does not know.
    pub(super) fn true_class_numbers(&self) -> Vec<u16> {
        self.taxonomy.class_numbers(self.true_class)
    }

    /// The verdicts on a labelling of the points, which may leave some out by true class 0.
    pub(super) fn verdicts(
        &self,
        true_class: &[u16],
        found: Labelling,
        by_class: bool,
    ) -> Verdicts {
        let truth = Labelling { class: true_class, id: self.true_id };
        let rules = MatchRules { min_points: self.min_points, by_class };
        verdicts(self.frame.cloud, truth, found, self.taxonomy, rules)
    }
}

/// Whose object it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ObjectOrigin {
    /// A true object.
    True,
    /// A found instance.
    Found,
}

/// A failure whose cause is looked for.
pub(super) struct Target {
    pub side: ObjectOrigin,
    pub judged: JudgedObject,
    /// Its points.
    pub points: Vec<usize>,
}
