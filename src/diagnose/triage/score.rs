//! A frame's suspects, ranked, and the score of the frame and of each instance.

use std::collections::BTreeMap;

use serde::Serialize;

use super::facts::FrameFacts;
use super::suspect::{Suspect, SuspectKind, TriageParams};
use super::{cuts, joins, pairs, points, sizes, votes};
use crate::diagnose::explain::ClusteredCloud;

/// What is suspect in a frame.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Triage {
    /// Probability that anything is wrong, 0 to 1.
    pub score: f64,
    /// The suspects, the likeliest first; of each kind at most one for each instance most in doubt.
    pub suspects: Vec<Suspect>,
    /// Score of each instance, instance k at k - 1: 0 to 1.
    pub instances: Vec<f64>,
}

/// A case to look at: an instance with all suspects that name it, or points without an instance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Case {
    /// The instance.
    pub instance: Option<u32>,
    /// Probability that it is part of a failure, 0 to 1.
    pub score: f64,
    /// The suspects that name it, as places in [`Triage::suspects`], the strongest first.
    pub suspects: Vec<usize>,
}

impl Triage {
    /// The cases, the likeliest first. If the strongest suspect of two instances is the pair of
    /// both, only the one more in doubt is a case.
    pub fn cases(&self) -> Vec<Case> {
        let mut named: BTreeMap<u32, Vec<(f64, usize)>> = BTreeMap::new();
        let mut cases = Vec::new();
        for (number, suspect) in self.suspects.iter().enumerate().filter(|(_, s)| s.score > 0.0) {
            for concern in &suspect.concerns {
                let weight = suspect.score * concern.share;
                named.entry(concern.instance).or_default().push((weight, number));
            }
            if suspect.concerns.is_empty() {
                let score = suspect.score;
                cases.push(Case { instance: None, score, suspects: vec![number] });
            }
        }
        for (instance, mut weighed) in named {
            weighed.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            let suspects = weighed.into_iter().map(|(_, number)| number).collect();
            let score = self.instances[instance as usize - 1];
            cases.push(Case { instance: Some(instance), score, suspects });
        }
        cases.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.suspects.cmp(&b.suspects)));
        let mut is_listed = vec![false; self.suspects.len()];
        cases.retain(|case| !std::mem::replace(&mut is_listed[case.suspects[0]], true));
        cases
    }
}

/// Looks for suspects in a frame. Time grows with the object pixels and with the pairs of instances
/// near each other.
pub fn triage(frame: &ClusteredCloud, params: &TriageParams) -> Triage {
    let facts = FrameFacts::of(frame, params);
    let found = [
        joins::thin_joins(&facts),
        cuts::close_cuts(&facts),
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
    let suspects = ranked(strongest(found.into_iter().flatten()));
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

/// Of each kind the strongest suspect for each instance most in doubt: a car in thirty pieces is
/// thirty suspects, not nine hundred.
fn strongest(suspects: impl Iterator<Item = Suspect>) -> Vec<Suspect> {
    let mut kept: BTreeMap<(SuspectKind, u32), Suspect> = BTreeMap::new();
    let mut others = Vec::new();
    for suspect in suspects {
        let Some(first) =
            suspect.concerns.first().filter(|_| suspect.kind != SuspectKind::Unlabelled)
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
