//! Why two points are one instance or are not, from the stages of a run: facts, no printing.
//!
//! | what | file |
//! | --- | --- |
//! | points, their pixels, components and groups | [`facts`] |
//! | pixel pairs on the border of components, and their angle beta | [`border`] |
//! | the chain of merges, or where the votes failed | [`votes`] |
//! | what comes after the votes: bird's-eye merge, minimum size, back-projection | [`post_merge`] |
//! | the nodes of the tree of merges, where there are no classes | [`cut`] |
//! | all of it in words | [`text`] |
//! | which change of one parameter gives the other answer | [`what_if`](mod@what_if) |
//!
//! A *group* is an instance of the merge step (Alg. 2), before any later stage; groups are numbered
//! in the order in which they were opened. Instances are numbered as in [`PointLabels`].
//!
//! ```
//! use divmerge::diagnose::explain::{Answer, ClusteredCloud, Subject, explain};
//! use divmerge::pipeline::{self, Config};
//! use divmerge::semantics::MaskSource;
//! use divmerge::simulate::{Drive, Scene, Sensor};
//!
//! let cloud = Drive::new(Sensor::Vlp16, Scene::Parking, 1).frame(0).cloud;
//! let (mask, config) = (MaskSource::All, Config::paper());
//! let stages = pipeline::run(&cloud, mask, &config);
//! let frame = ClusteredCloud { cloud: &cloud, mask, config: &config, stages: &stages };
//! let explanation = explain(&frame, Subject::Pair(0, 1));
//! let [a, b] = [0, 1].map(|point| stages.labels.instance[point]);
//! assert_eq!(explanation.answer == Answer::OneInstance, a == b && a != 0);
//! ```
//!
//! [`PointLabels`]: divmerge_core::cloud::PointLabels

pub mod border;
pub mod cut;
mod dials;
pub mod facts;
pub(crate) mod in_force;
mod places;
pub mod post_merge;
mod subject;
pub mod text;
pub mod votes;
pub mod what_if;

#[cfg(test)]
mod tests;

use serde::Serialize;

use divmerge_core::cloud::Reason;

pub use border::{BorderPair, Rule};
pub use cut::{CutEvidence, ScoreFlip};
pub use divmerge_core::cluster::SizeTest;
pub use facts::{ComponentFacts, GroupFacts, PointFacts, distances};
pub use places::{Place, nearest_points, return_at};
pub use post_merge::PostMergeStage;
pub use subject::{Answer, ClusteredCloud, Subject, answer};
pub use text::{ExplanationReport, ExplanationText};
pub use votes::{Donor, Link, VoteEvidence};
pub use what_if::{Choice, Flip, Number, WhatIf, what_if, what_if_while};

/// What brought the answer about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DecidedBy {
    /// Both points lie in one component: one seed reached both.
    OneComponent,
    /// The votes on the borders joined their components.
    VotesInFavour,
    /// Only a stage after the vote merge joined them.
    #[serde(rename = "later_stage")]
    PostMergeStage,
    /// The cut of the tree of merges, there being no classes.
    Cut,
    /// At least one of the points has no instance at all; its reason says why.
    NoInstance,
    /// Only pixels of one class are neighbours, and theirs differ.
    DifferentClasses,
    /// No chain of true conditions leads from one to the other: there is nothing to vote in favour.
    NoTrueCondition,
    /// Chains of true conditions lead from one to the other, but the votes against outweigh them.
    VotesAgainst,
    /// The one point's own way through the stages; the facts say it.
    ItsOwnLabel,
}

/// Why. Positions in metres in the cloud's own frame, angles in degrees.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// The answer.
    pub answer: Answer,
    /// What brought it about.
    pub decided_by: DecidedBy,
    /// The points asked about.
    pub points: Vec<PointFacts>,
    /// What the merge step has to say on two points that have components.
    pub votes: Option<VoteEvidence>,
    /// What the stages after the merge step did with these points, where they did anything.
    #[serde(rename = "later")]
    pub post_merge: Vec<PostMergeStage>,
    /// theta of the condition, degrees; pairs that went by nearness say so.
    pub angle_degrees: f64,
    /// Two components merge where V+ / (V+ + V-) exceeds this.
    pub merge_ratio: f64,
    /// Whether pixels may have changed hands during the growth (preset `authors`): border pairs are
    /// then those of the final labels, and need not add up to the votes that were cast.
    pub pixels_change_hands: bool,
}

impl Explanation {
    /// What the cut of the tree of merges did, where there are no classes.
    pub fn cut(&self) -> Option<&CutEvidence> {
        self.post_merge.iter().find_map(|stage| match stage {
            PostMergeStage::Cut(cut) => Some(cut),
            _ => None,
        })
    }

    /// Whether the points were looked for in a tree of merges.
    fn is_cut(&self) -> bool {
        self.cut().is_some()
    }

    /// The pairs of border pixels on which the votes were cast, each once, in the order of the
    /// image.
    pub fn pairs(&self) -> Vec<BorderPair> {
        let (border, links): (&[BorderPair], &[Link]) = match &self.votes {
            Some(VoteEvidence::Chain { links } | VoteEvidence::Failed { links, .. }) => {
                (&[], links)
            }
            Some(VoteEvidence::NoTrueCondition { border, links, .. }) => (border, links),
            _ => (&[], &[]),
        };
        let of_links = links.iter().flat_map(|link| &link.pairs);
        let mut pairs: Vec<BorderPair> = border.iter().chain(of_links).copied().collect();
        let key = |pair: &BorderPair| [pair.a, pair.b].map(|place| (place.row, place.column));
        pairs.sort_by_key(key);
        pairs.dedup_by_key(|pair| key(pair));
        pairs
    }
}

/// Explains the answer to a question about one or two points of a frame.
///
/// # Panics
/// If a point is not in the cloud.
pub fn explain(frame: &ClusteredCloud, subject: Subject) -> Explanation {
    let points: Vec<PointFacts> =
        subject.points().into_iter().map(|point| PointFacts::of(frame, point)).collect();
    let is_cut = frame.stages.post_merge.tree.is_some();
    let votes = match &points[..] {
        [a, b] if !is_cut => votes::evidence(frame, a, b),
        _ => None,
    };
    let post_merge = post_merge::evidence(frame, &points);
    let params = &frame.config.cluster;
    Explanation {
        answer: answer(frame.stages, subject),
        decided_by: decided_by(&points, votes.as_ref(), is_cut),
        votes,
        post_merge,
        points,
        angle_degrees: params.condition.angle.to_degrees(),
        merge_ratio: params.merge_ratio,
        pixels_change_hands: params.seeding == divmerge_core::cluster::params::Seeding::AtPop,
    }
}

fn decided_by(points: &[PointFacts], votes: Option<&VoteEvidence>, is_cut: bool) -> DecidedBy {
    let [a, b] = points else {
        return DecidedBy::ItsOwnLabel;
    };
    if points.iter().any(|point| point.reason != Reason::None) {
        return DecidedBy::NoInstance;
    }
    if is_cut {
        return DecidedBy::Cut;
    }
    let is_one = a.instance == b.instance;
    match votes {
        Some(VoteEvidence::OneComponent { .. }) if is_one => DecidedBy::OneComponent,
        Some(VoteEvidence::Chain { .. }) if is_one => DecidedBy::VotesInFavour,
        Some(VoteEvidence::DifferentClasses { .. }) if !is_one => DecidedBy::DifferentClasses,
        Some(VoteEvidence::NoTrueCondition { .. }) if !is_one => DecidedBy::NoTrueCondition,
        Some(VoteEvidence::Failed { .. }) if !is_one => DecidedBy::VotesAgainst,
        _ => DecidedBy::PostMergeStage,
    }
}
