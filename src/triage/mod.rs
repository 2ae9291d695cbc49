//! How suspect the decisions of a frame are, without any truth.
//!
//! A frame's run is looked through for what tends to go with failures: joins that only just came about or were
//! only just refused, votes that only just decided, instances that do not look like one object of their class,
//! points and beams that are missing. Each is a [`Suspect`] with the figure that was measured, the bound it is
//! held against, a sentence, and points that `explain` has an answer for.
//!
//! | kinds | file |
//! | --- | --- |
//! | thin joins | `joins` |
//! | could be one, almost touching | `pairs` |
//! | too large, two masses, leftovers | `sizes`, with `parts` and `between` |
//! | thin majorities, chains of them, refused votes | `votes` |
//! | points without an instance, mixed classes, missing returns | `points` |
//! | all clouds of a recording, and a topic with what was found | [`recording`] |
//!
//! # Scores
//!
//! A score is comparable across kinds: it is meant as how likely evaluation would count a failure there. It ranks
//! better than it estimates: where it says 1/4, half as many are found, fewer where it says less
//! (`examples/08_triage.rs` prints what is found where). It is the product of three shares:
//!
//! - the *evidence*, 0 where a kind begins to fire and 1 where it could not say more, by a rule that each kind
//!   states;
//! - the kind's *weight* ([`Kind::weight`]): about how often it is right at full evidence, chosen on simulated
//!   drives other than those that the example reports on;
//! - the *stake*: the points of the instance most in doubt as a share of [`Params::min_points`], below which
//!   evaluation counts no failure.
//!
//! An instance that several suspects name has 1 - prod(1 - s), as if they were independent; where a suspect
//! names a second instance, that has the part of the score that the first could spoil of it. A frame's score is
//! the same over its suspects: how likely anything at all is wrong with it.
//!
//! ```
//! use divmerge::Taxonomy;
//! use divmerge::explain::Frame;
//! use divmerge::pipeline::{self, Config};
//! use divmerge::semantics::MaskSource;
//! use divmerge::simulate::{Drive, Scene, Sensor};
//! use divmerge::triage::{Params, triage};
//!
//! let cloud = Drive::new(Sensor::Vlp16, Scene::Parking, 1).frame(0).cloud;
//! let taxonomy = Taxonomy::semantic_kitti();
//! let (mask, config) = (MaskSource::Classes(&taxonomy), Config::paper());
//! let stages = pipeline::run(&cloud, mask, &config);
//! let frame = Frame { cloud: &cloud, mask, config: &config, stages: &stages };
//! let found = triage(&frame, &Params::default());
//! assert!(found.suspects.is_sorted_by(|a, b| a.score >= b.score));
//! println!("{}", found.suspects[0].sentence);
//! ```

mod between;
mod facts;
mod joins;
mod pairs;
mod parts;
mod points;
pub mod recording;
mod sizes;
#[cfg(test)]
mod tests;
mod votes;

use std::collections::BTreeMap;

use serde::Serialize;

use crate::explain::Frame;
use facts::{Facts, Member};

/// What is suspect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Two substantial parts put together across a gap.
    ThinJoin,
    /// Two instances of one class that would fit one object, or nearly so.
    CouldBeOne,
    /// Two instances of one class that all but touch.
    AlmostTouching,
    /// Longer or wider than objects of its class come.
    TooLarge,
    /// Two masses with a gap between them.
    TwoMasses,
    /// Hardly a pixel.
    Leftover,
    /// A substantial part that joined on a thin majority of votes.
    ThinMajority,
    /// Bare majorities one after the other.
    BareChain,
    /// A border that voted against joining, but not by much.
    RefusedVotes,
    /// Object points without an instance.
    Unlabelled,
    /// Pixels of several classes, or of corrected ones.
    MixedClasses,
    /// Beams that came back with nothing.
    MissingReturns,
}

impl Kind {
    /// All kinds in the order of their numbers.
    pub const ALL: [Kind; 12] = [
        Kind::ThinJoin,
        Kind::CouldBeOne,
        Kind::AlmostTouching,
        Kind::TooLarge,
        Kind::TwoMasses,
        Kind::Leftover,
        Kind::ThinMajority,
        Kind::BareChain,
        Kind::RefusedVotes,
        Kind::Unlabelled,
        Kind::MixedClasses,
        Kind::MissingReturns,
    ];

    /// A few words for people, without commas.
    pub fn name(self) -> &'static str {
        match self {
            Kind::ThinJoin => "thin join",
            Kind::CouldBeOne => "could be one",
            Kind::AlmostTouching => "almost touching",
            Kind::TooLarge => "too large",
            Kind::TwoMasses => "two masses",
            Kind::Leftover => "leftover",
            Kind::ThinMajority => "thin majority",
            Kind::BareChain => "bare chain",
            Kind::RefusedVotes => "refused votes",
            Kind::Unlabelled => "without instance",
            Kind::MixedClasses => "mixed classes",
            Kind::MissingReturns => "missing returns",
        }
    }

    /// Its name in a table of figures.
    pub fn key(self) -> &'static str {
        match self {
            Kind::ThinJoin => "thin_join",
            Kind::CouldBeOne => "could_be_one",
            Kind::AlmostTouching => "almost_touching",
            Kind::TooLarge => "too_large",
            Kind::TwoMasses => "two_masses",
            Kind::Leftover => "leftover",
            Kind::ThinMajority => "thin_majority",
            Kind::BareChain => "bare_chain",
            Kind::RefusedVotes => "refused_votes",
            Kind::Unlabelled => "unlabelled",
            Kind::MixedClasses => "mixed_classes",
            Kind::MissingReturns => "missing_returns",
        }
    }

    /// How often the kind is right where its evidence is full, 0 to 1.
    ///
    /// Chosen by simulated drives of all scenes and sensors, seeds 1 to 6, presets `best` and `paper`, in coarse steps; what
    /// tends to come with a stronger kind (neighbours that touch, with those that could be one) has little of its own.
    pub fn weight(self) -> f64 {
        match self {
            Kind::CouldBeOne => 0.9,
            Kind::TwoMasses | Kind::ThinJoin | Kind::TooLarge => 0.5,
            Kind::RefusedVotes => 0.2,
            Kind::ThinMajority | Kind::BareChain | Kind::MissingReturns => 0.1,
            Kind::MixedClasses | Kind::Unlabelled => 0.1,
            Kind::AlmostTouching | Kind::Leftover => 0.05,
        }
    }
}

/// How suspects are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Params {
    /// Instances of fewer points weigh less, in proportion. Default 50, from which on semantic-kitti-api counts
    /// a segment without a match.
    pub min_points: u64,
}

impl Default for Params {
    fn default() -> Self {
        Params { min_points: crate::evaluate::panoptic::MIN_POINTS }
    }
}

/// An instance that a suspect names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Concern {
    /// Its id.
    pub instance: u32,
    /// The part of the suspect's score that falls on it, 0 to 1.
    pub share: f64,
}

/// Something that may be wrong with a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Suspect {
    /// What is suspect.
    pub kind: Kind,
    /// How likely it is that something is wrong, 0 to 1.
    pub score: f64,
    /// How much the figure says of what its kind could say, 0 to 1.
    pub evidence: f64,
    /// The instances concerned, the one most in doubt first; none of points that no instance is near.
    pub concerns: Vec<Concern>,
    /// One or two points of the cloud for [`explain`](crate::explain::explain()).
    pub points: Vec<usize>,
    /// Where, metres, sensor frame.
    pub position: [f64; 3],
    /// The figure.
    pub measured: f64,
    /// What it is held against.
    pub bound: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// The same in words.
    pub sentence: String,
}

/// What is suspect in a frame.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Triage {
    /// How likely anything is wrong, 0 to 1.
    pub score: f64,
    /// The suspects, the likeliest first; of each kind one for each instance most in doubt.
    pub suspects: Vec<Suspect>,
    /// How suspect each instance is, instance k at k - 1: 0 to 1.
    pub instances: Vec<f64>,
}

/// A thing to look at: an instance with all that is held against it, or points without one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Case {
    /// The instance.
    pub instance: Option<u32>,
    /// How likely it is in a failure, 0 to 1.
    pub score: f64,
    /// What is held against it as places in [`Triage::suspects`], what weighs most first.
    pub suspects: Vec<usize>,
}

impl Triage {
    /// What to look at, the likeliest first. Of two instances whose strongest suspect is the same, the pair of
    /// both, only the one more in doubt is a case.
    pub fn cases(&self) -> Vec<Case> {
        let mut held: BTreeMap<u32, Vec<(f64, usize)>> = BTreeMap::new();
        let mut cases = Vec::new();
        for (number, suspect) in self.suspects.iter().enumerate().filter(|(_, s)| s.score > 0.0) {
            for concern in &suspect.concerns {
                let weight = suspect.score * concern.share;
                held.entry(concern.instance).or_default().push((weight, number));
            }
            if suspect.concerns.is_empty() {
                let score = suspect.score;
                cases.push(Case { instance: None, score, suspects: vec![number] });
            }
        }
        for (instance, mut held) in held {
            held.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            let suspects = held.into_iter().map(|(_, number)| number).collect();
            let score = self.instances[instance as usize - 1];
            cases.push(Case { instance: Some(instance), score, suspects });
        }
        cases.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.suspects.cmp(&b.suspects)));
        let mut is_said = vec![false; self.suspects.len()];
        cases.retain(|case| !std::mem::replace(&mut is_said[case.suspects[0]], true));
        cases
    }
}

/// Looks for what is suspect in a frame. Time grows with the object pixels and with the pairs of instances near
/// each other.
pub fn triage(frame: &Frame, params: &Params) -> Triage {
    let facts = Facts::of(frame);
    let found = [
        joins::thin_joins(&facts),
        pairs::pairs(&facts),
        sizes::too_large(&facts),
        sizes::two_masses(&facts),
        sizes::leftovers(&facts),
        votes::merges(&facts),
        votes::refused(&facts),
        points::unlabelled(&facts),
        points::mixed_classes(&facts),
        points::missing_returns(&facts),
    ];
    let suspects = found.into_iter().flatten().map(|hint| hint.suspect(params)).collect();
    let suspects = ranked(strongest(suspects));
    let mut clear = vec![1.0; facts.members.len()];
    for suspect in &suspects {
        for concern in &suspect.concerns {
            clear[concern.instance as usize - 1] *= 1.0 - suspect.score * concern.share;
        }
    }
    Triage {
        score: 1.0 - suspects.iter().map(|suspect| 1.0 - suspect.score).product::<f64>(),
        instances: clear.into_iter().map(|clear| 1.0 - clear).collect(),
        suspects,
    }
}

/// The likeliest first; ties by kind and place, so that the same frame gives the same list.
fn ranked(mut suspects: Vec<Suspect>) -> Vec<Suspect> {
    suspects.sort_by(|a, b| {
        let by_score = b.score.total_cmp(&a.score).then(a.kind.cmp(&b.kind));
        by_score.then_with(|| a.points.cmp(&b.points))
    });
    suspects
}

/// Of each kind the strongest suspect for each instance most in doubt: a car in thirty pieces is thirty
/// suspects, not nine hundred.
fn strongest(suspects: Vec<Suspect>) -> Vec<Suspect> {
    let mut kept: BTreeMap<(Kind, u32), Suspect> = BTreeMap::new();
    let mut others = Vec::new();
    for suspect in suspects {
        let Some(first) = suspect.concerns.first().filter(|_| suspect.kind != Kind::Unlabelled)
        else {
            others.push(suspect);
            continue;
        };
        let key = (suspect.kind, first.instance);
        if kept.get(&key).is_none_or(|other| other.score < suspect.score) {
            kept.insert(key, suspect);
        }
    }
    others.extend(kept.into_values());
    others
}

/// What a kind has found, before it is weighed.
struct Hint {
    kind: Kind,
    evidence: f64,
    concerns: Vec<Concern>,
    /// Points of what is most in doubt.
    stake: u64,
    points: Vec<usize>,
    position: [f64; 3],
    measured: f64,
    bound: f64,
    unit: &'static str,
    sentence: String,
}

impl Hint {
    /// A hint at one instance; figures and words are still to be filled in.
    fn at(kind: Kind, evidence: f64, member: &Member) -> Self {
        Hint {
            kind,
            evidence,
            concerns: vec![Concern { instance: member.instance.id, share: 1.0 }],
            stake: u64::from(member.instance.points),
            points: Vec::new(),
            position: member.instance.bounds.centre,
            measured: 0.0,
            bound: 0.0,
            unit: "",
            sentence: String::new(),
        }
    }

    /// A hint at two instances, the smaller first. The larger is spoiled by no more than what the smaller is
    /// of it.
    fn at_pair(kind: Kind, evidence: f64, [smaller, larger]: [&Member; 2]) -> Self {
        let mut hint = Hint::at(kind, evidence, smaller);
        let share = smaller.objects.len() as f64 / larger.objects.len().max(1) as f64;
        hint.concerns.push(Concern { instance: larger.instance.id, share: share.min(1.0) });
        hint
    }

    fn suspect(self, params: &Params) -> Suspect {
        let stake = ramp(self.stake as f64, 0.0, params.min_points.max(1) as f64);
        Suspect {
            kind: self.kind,
            score: self.evidence * self.kind.weight() * stake,
            evidence: self.evidence,
            concerns: self.concerns,
            points: self.points,
            position: self.position,
            measured: self.measured,
            bound: self.bound,
            unit: self.unit,
            sentence: self.sentence,
        }
    }
}

/// 0 at one value, 1 at the other, straight between them.
fn ramp(value: f64, zero: f64, one: f64) -> f64 {
    ((value - zero) / (one - zero)).clamp(0.0, 1.0)
}

/// `1 pixel`, `2 pixels`.
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}
