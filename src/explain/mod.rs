//! Why two points are one instance or are not, from the stages of a run: facts, no printing.
//!
//! | what | file |
//! | --- | --- |
//! | points, their pixels, components and groups | [`facts`] |
//! | pixel pairs on the border of components, and their angle beta | [`border`] |
//! | the chain of merges, or where the votes failed | [`votes`] |
//! | what comes after the votes: bird's-eye merge, minimum size, back-projection | [`later`] |
//! | which change of one parameter gives the other answer | [`what_if`](mod@what_if) |
//!
//! A *group* is an instance of the merge step (Alg. 2), before any later stage; groups are numbered in the
//! order in which they were opened. Instances are numbered as in [`PointLabels`].
//!
//! ```
//! use divmerge::explain::{Answer, Frame, Subject, explain};
//! use divmerge::pipeline::{self, Config};
//! use divmerge::semantics::MaskSource;
//! use divmerge::simulate::{Drive, Scene, Sensor};
//!
//! let cloud = Drive::new(Sensor::Vlp16, Scene::Parking, 1).frame(0).cloud;
//! let (mask, config) = (MaskSource::All, Config::paper());
//! let stages = pipeline::run(&cloud, mask, &config);
//! let frame = Frame { cloud: &cloud, mask, config: &config, stages: &stages };
//! let explanation = explain(&frame, Subject::Pair(0, 1));
//! let [a, b] = [0, 1].map(|point| stages.labels.instance[point]);
//! assert_eq!(explanation.answer == Answer::OneInstance, a == b && a != 0);
//! ```
//!
//! [`PointLabels`]: crate::instances::PointLabels

pub mod border;
pub mod facts;
pub mod later;
pub mod votes;
pub mod what_if;

#[cfg(test)]
mod tests;

use serde::Serialize;

use crate::cloud::PointCloud;
use crate::error::{Error, Result};
use crate::instances::Reason;
use crate::pipeline::{Config, Stages};
use crate::semantics::MaskSource;

pub use border::{BorderPair, Rule};
pub use facts::{ComponentFacts, GroupFacts, Place, PointFacts};
pub use later::{GapTest, LaterStage, SizeTest};
pub use votes::{Donor, Link, VoteEvidence};
pub use what_if::{Choice, Flip, Number, WhatIf, what_if};

/// One run of the pipeline with what went into it.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    /// The cloud that was clustered.
    pub cloud: &'a PointCloud,
    /// Where its object mask came from.
    pub mask: MaskSource<'a>,
    /// Every parameter of the run.
    pub config: &'a Config,
    /// Every intermediate of the run.
    pub stages: &'a Stages,
}

/// What is asked about; points by their index in the cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// What is this point's instance, or why has it none?
    Point(usize),
    /// Are these two points one instance?
    Pair(usize, usize),
}

impl Subject {
    /// The points asked about, one or two.
    pub fn points(self) -> Vec<usize> {
        match self {
            Subject::Point(point) => vec![point],
            Subject::Pair(a, b) => vec![a, b],
        }
    }
}

/// The answer to a [`Subject`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// Two points, one instance.
    OneInstance,
    /// Two points that are not one instance.
    Apart,
    /// One point, which has an instance.
    HasInstance,
    /// One point, which has none.
    NoInstance,
}

/// What brought the answer about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DecidedBy {
    /// Both points lie in one component: one seed reached both.
    OneComponent,
    /// The votes on the borders joined their components.
    VotesInFavour,
    /// Only a stage after the vote merge joined them.
    LaterStage,
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
    pub later: Vec<LaterStage>,
    /// theta of the condition, degrees; pairs that went by nearness say so.
    pub angle_degrees: f64,
    /// Two components merge where V+ / (V+ + V-) exceeds this.
    pub merge_ratio: f64,
    /// Whether pixels may have changed hands during the growth (preset `authors`): border pairs are then
    /// those of the final labels, and need not add up to the votes that were cast.
    pub pixels_change_hands: bool,
}

impl Explanation {
    /// The pairs of border pixels on which the votes were cast, each once, in the order of the image.
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
pub fn explain(frame: &Frame, subject: Subject) -> Explanation {
    let points: Vec<PointFacts> =
        subject.points().into_iter().map(|point| PointFacts::of(frame, point)).collect();
    let votes = match &points[..] {
        [a, b] => votes::evidence(frame, a, b),
        _ => None,
    };
    let later = later::evidence(frame, &points);
    let params = &frame.config.cluster;
    Explanation {
        answer: answer(frame.stages, subject),
        decided_by: decided_by(&points, votes.as_ref()),
        votes,
        later,
        points,
        angle_degrees: params.condition.angle.to_degrees(),
        merge_ratio: params.merge_ratio,
        pixels_change_hands: params.seeding == crate::cluster::params::Seeding::AtPop,
    }
}

/// The answer alone.
///
/// # Panics
/// If a point is not in the cloud.
pub fn answer(stages: &Stages, subject: Subject) -> Answer {
    let instance = &stages.labels.instance;
    match subject {
        Subject::Point(point) if instance[point] != 0 => Answer::HasInstance,
        Subject::Point(_) => Answer::NoInstance,
        Subject::Pair(a, b) if instance[a] != 0 && instance[a] == instance[b] => {
            Answer::OneInstance
        }
        Subject::Pair(..) => Answer::Apart,
    }
}

fn decided_by(points: &[PointFacts], votes: Option<&VoteEvidence>) -> DecidedBy {
    let [a, b] = points else {
        return DecidedBy::ItsOwnLabel;
    };
    if points.iter().any(|point| point.reason != Reason::None) {
        return DecidedBy::NoInstance;
    }
    let is_one = a.instance == b.instance;
    match votes {
        Some(VoteEvidence::OneComponent { .. }) if is_one => DecidedBy::OneComponent,
        Some(VoteEvidence::Chain { .. }) if is_one => DecidedBy::VotesInFavour,
        Some(VoteEvidence::DifferentClasses { .. }) if !is_one => DecidedBy::DifferentClasses,
        Some(VoteEvidence::NoTrueCondition { .. }) if !is_one => DecidedBy::NoTrueCondition,
        Some(VoteEvidence::Failed { .. }) if !is_one => DecidedBy::VotesAgainst,
        _ => DecidedBy::LaterStage,
    }
}

/// The return nearest to a position in metres, if it is not farther than `within` metres from it.
///
/// # Errors
/// [`Error::NothingThere`], which says where the nearest return is.
pub fn return_at(cloud: &PointCloud, at: [f64; 3], within: f64) -> Result<usize> {
    let distance = |point: usize| distance(cloud.position(point).map(f64::from), at);
    let returns = (0..cloud.len()).filter(|&point| cloud.is_return(point));
    let nearest = returns.min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
    match nearest {
        Some(point) if distance(point) <= within => Ok(point),
        _ => Err(Error::NothingThere {
            at,
            within,
            nearest: nearest.map(|point| (cloud.position(point), distance(point))),
        }),
    }
}

/// A point of each of two instances: the two that are nearest to each other, so that an explanation of
/// them is one of the instances' border.
///
/// # Errors
/// [`Error::NoInstance`] if one of them does not exist.
pub fn nearest_points(frame: &Frame, a: u32, b: u32) -> Result<(usize, usize)> {
    let count = frame.stages.instances.len() as u32;
    if let Some(&id) = [a, b].iter().find(|&&id| id == 0 || id > count) {
        return Err(Error::NoInstance { id, count });
    }
    let labels = &frame.stages.labels.instance;
    let image = &frame.stages.image;
    let seen = |id: u32| -> Vec<usize> {
        let of_instance = (0..labels.len()).filter(|&point| labels[point] == id);
        of_instance.filter(|&point| !image.is_shadowed(point)).collect()
    };
    let position = |&point: &usize| frame.cloud.position(point).map(f64::from);
    let nearest = facts::nearest_pair(&seen(a), &seen(b), position);
    nearest.map(|(a, b, _)| (a, b)).ok_or(Error::NoInstance { id: a, count })
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}
