//! What the checks find, before it is weighed.

use super::facts::InstanceFacts;
use super::suspect::{Concern, Params, Suspect, SuspectKind};

/// A suspect before it is weighed.
pub(super) struct Hint {
    pub kind: SuspectKind,
    pub evidence: f64,
    pub concerns: Vec<Concern>,
    /// Number of points of the instance, or of the loose points, most in doubt.
    pub stake: u64,
    pub points: Vec<usize>,
    pub position: [f64; 3],
    pub measured: f64,
    pub bound: f64,
    pub unit: &'static str,
    pub sentence: String,
}

impl Hint {
    /// A hint at one instance, its figures and words still empty.
    pub fn at(kind: SuspectKind, evidence: f64, member: &InstanceFacts) -> Self {
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

    /// A hint at two instances. The share of the larger is the size of the smaller in relation to
    /// it: the smaller can spoil no more of it.
    pub fn at_pair(
        kind: SuspectKind,
        evidence: f64,
        [smaller, larger]: [&InstanceFacts; 2],
    ) -> Self {
        let mut hint = Hint::at(kind, evidence, smaller);
        let share = smaller.objects.len() as f64 / larger.objects.len().max(1) as f64;
        hint.concerns.push(Concern { instance: larger.instance.id, share: share.min(1.0) });
        hint
    }

    /// The suspect, weighed by its kind and by the number of points at stake.
    pub fn suspect(self, params: &Params) -> Suspect {
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

/// 0 at one value, 1 at the other, linear between them.
pub(super) fn ramp(value: f64, zero: f64, one: f64) -> f64 {
    ((value - zero) / (one - zero)).clamp(0.0, 1.0)
}
