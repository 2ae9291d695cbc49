//! How much a node looks like one whole object: a product of terms between 0 and 1, for the body
//! that it looks like most.

use serde::Serialize;

use super::bodies::{BODIES, Body, Prior, trapezoid};
use super::measures::NodeMeasures;
use super::nodes::Node;
use crate::cluster::params::TreeMerge;

/// The score of a node and its terms, each 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Score {
    /// The body that it looks like most.
    pub body: Body,
    /// The product of all terms and of how common the body is.
    pub total: f64,
    /// Whether a body may be of its size.
    pub size: f64,
    /// How far all else is, against the angle between things and against the gaps within.
    pub isolation: f64,
    /// How much larger what it joins is.
    pub wholeness: f64,
    /// Whether it stands on the ground.
    pub standing: f64,
    /// How much of its face towards the sensor is seen.
    pub filled: f64,
}

/// The score of a node, given the measures of what it is part of; `None` of one that is too small
/// or too large to be an object.
pub fn score(
    node: &Node,
    measures: &NodeMeasures,
    parent: Option<&NodeMeasures>,
    params: &TreeMerge,
) -> Option<Score> {
    let is_scored = node.len >= params.least_scored as u32 && measures.size[0] <= params.longest;
    if !is_scored {
        return None;
    }
    let isolation = Isolation::new(node, measures.range, params);
    let wholeness = 1.0 - params.wholeness * parent.map_or(0.0, |parent| measures.share_of(parent));
    let standing = measures.standing();
    let filled = 1.0 - params.filled * (1.0 - measures.filled);
    let of = |prior: &Prior| {
        let size = prior.size(measures);
        let isolation = isolation.of(prior);
        let total = prior.frequency * size * isolation * wholeness * standing * filled;
        Score { body: prior.body, total, size, isolation, wholeness, standing, filled }
    };
    BODIES.iter().map(of).reduce(|best, next| if next.total > best.total { next } else { best })
}

impl Score {
    /// What a node of this score adds to the sum that the cut makes largest.
    pub fn gain(&self, params: &TreeMerge) -> f64 {
        if self.total < params.least_score { 0.0 } else { self.total.powf(params.power) }
    }
}

/// How far all else is.
struct Isolation {
    /// Against the angle between things.
    by_angle: f64,
    /// Against the gaps within.
    by_gaps: f64,
}

impl Isolation {
    fn new(node: &Node, range: f64, params: &TreeMerge) -> Self {
        // Full where what is next to it is four times as far as things may be apart.
        let against = |gap: f64| ((f64::from(node.death) / gap).ln() / 4_f64.ln()).clamp(0.0, 1.0);
        let within = f64::from(node.birth).max(params.least_gap * range);
        Isolation {
            by_angle: against((params.gap * range).max(params.nearest_gap)),
            by_gaps: against(within),
        }
    }

    fn of(&self, prior: &Prior) -> f64 {
        self.by_angle.max(prior.by_gaps * self.by_gaps).powf(prior.isolation)
    }
}

impl NodeMeasures {
    /// How much of the box around what it joins its own box fills, 0 to 1.
    fn share_of(&self, parent: &NodeMeasures) -> f64 {
        /// Flat things have no volume, metres.
        const MARGIN: f64 = 0.2;
        let volume = |size: [f64; 3]| size.iter().map(|side| side + MARGIN).product::<f64>();
        (volume(self.size) / volume(parent.size)).min(1.0)
    }

    /// Whether it reaches down to the ground; a body whose legs or wheels are hidden still may.
    fn standing(&self) -> f64 {
        const FLOATING: f64 = 0.1;
        let [bottom, _] = self.above_ground.unwrap_or_default();
        trapezoid([f64::NEG_INFINITY, f64::NEG_INFINITY, 0.4, 1.0], bottom).max(FLOATING)
    }
}
