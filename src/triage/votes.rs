//! Votes that only just decided, one way or the other, and chains of them.

use std::collections::BTreeMap;

use super::facts::Facts;
use super::{Kind, Suspect, ramp};
use crate::cluster::merge::MergeStep;

/// A merge is bare where its share in favour exceeds what is asked by less than this part of what is left.
const BARE: f64 = 0.2;

/// Share of votes in favour.
fn share(positive: u64, negative: u64) -> f64 {
    positive as f64 / (positive + negative).max(1) as f64
}

/// Merges on a thin majority between two substantial parts, and chains of bare ones: per instance the
/// thinnest of the one and the longest of the other.
pub(super) fn merges(facts: &Facts) -> Vec<Suspect> {
    let tree = Tree::of(facts);
    let steps = &facts.frame.stages.merge.steps;
    let mut thinnest: BTreeMap<u32, (f64, &MergeStep)> = BTreeMap::new();
    let mut longest: BTreeMap<u32, (u32, &MergeStep)> = BTreeMap::new();
    for (number, step) in steps.iter().enumerate() {
        let id = tree.instance[step.query as usize - 1];
        if id == 0 {
            continue;
        }
        let evidence = tree.margin_evidence(facts, step);
        let thin = thinnest.entry(id).or_insert((evidence, step));
        if evidence > thin.0 {
            *thin = (evidence, step);
        }
        let length = tree.chain[number];
        let long = longest.entry(id).or_insert((length, step));
        if length > long.0 {
            *long = (length, step);
        }
    }
    let thin = thinnest.into_iter().filter(|(_, found)| found.0 > 0.0);
    let long = longest.into_iter().filter(|(_, found)| found.0 > 1);
    let thin = thin.map(|(id, (evidence, step))| thin_majority(facts, &tree, id, evidence, step));
    thin.chain(long.map(|(id, (length, step))| bare_chain(facts, &tree, id, length, step))).collect()
}

/// The merges as a tree: who joined whom.
struct Tree {
    /// Pixels of each component and of all that joined it or its queries; component k at k - 1.
    below: Vec<u32>,
    /// Final instance of each component, or 0.
    instance: Vec<u32>,
    /// For each step how many bare ones end in it, one after the other.
    chain: Vec<u32>,
}

impl Tree {
    fn of(facts: &Facts) -> Self {
        let stages = facts.frame.stages;
        let count = stages.components.count as usize;
        let (mut below, mut instance) = (vec![0_u32; count], vec![0; count]);
        for (&label, &id) in stages.components.label.iter().zip(&facts.instance_of) {
            if label != 0 {
                below[label as usize - 1] += 1;
                instance[label as usize - 1] = id;
            }
        }
        let ratio = facts.frame.config.cluster.merge_ratio;
        let mut bare = vec![0_u32; count];
        let mut chain = Vec::with_capacity(stages.merge.steps.len());
        for step in &stages.merge.steps {
            let before = bare[step.target as usize - 1];
            let length = if margin(step, ratio) < BARE { before + 1 } else { 0 };
            bare[step.query as usize - 1] = length;
            chain.push(length);
        }
        for step in stages.merge.steps.iter().rev() {
            below[step.target as usize - 1] += below[step.query as usize - 1];
        }
        Tree { below, instance, chain }
    }

    /// How thin a merge is, times how much hangs on it.
    fn margin_evidence(&self, facts: &Facts, step: &MergeStep) -> f64 {
        let id = self.instance[step.query as usize - 1];
        let Some(member) = facts.member(id) else {
            return 0.0;
        };
        let total = member.objects.len() as f64;
        let below = f64::from(self.below[step.query as usize - 1]);
        let side = below.min(total - below).max(0.0) / total;
        let ratio = facts.frame.config.cluster.merge_ratio;
        ramp(margin(step, ratio), 1.0, 0.0) * ramp(side, 0.0, 1.0 / 3.0)
    }
}

/// By how much a merge's share in favour exceeds what is asked, as a part of what is left: 0 for a bare
/// majority, 1 where there was no vote against.
fn margin(step: &MergeStep, ratio: f64) -> f64 {
    (share(step.positive, step.negative) - ratio) / (1.0 - ratio)
}

/// An object pixel of a component.
fn pixel_of(facts: &Facts, label: u32) -> Option<u32> {
    let labels = &facts.frame.stages.components.label;
    labels.iter().position(|&other| other == label).map(|object| object as u32)
}

fn points_of(facts: &Facts, step: &MergeStep) -> Vec<usize> {
    let pixels = [step.target, step.query].into_iter().filter_map(|label| pixel_of(facts, label));
    pixels.map(|object| facts.point(object)).collect()
}

fn thin_majority(facts: &Facts, tree: &Tree, id: u32, evidence: f64, step: &MergeStep) -> Suspect {
    let member = facts.member(id).expect("a component's instance");
    Suspect {
        kind: Kind::ThinMajority,
        evidence,
        score: 0.0,
        extra: vec![],
        instances: vec![id],
        points: points_of(facts, step),
        position: member.instance.bounds.centre,
        measured: share(step.positive, step.negative),
        bound: facts.frame.config.cluster.merge_ratio,
        unit: "of the votes",
        sentence: format!(
            "{} hangs on one merge: component {} with {} pixels joined {} by V+ {} to V- {}",
            member.instance.title(),
            step.query,
            tree.below[step.query as usize - 1],
            step.target,
            step.positive,
            step.negative
        ),
    }
}

fn bare_chain(facts: &Facts, _: &Tree, id: u32, length: u32, step: &MergeStep) -> Suspect {
    let member = facts.member(id).expect("a component's instance");
    Suspect {
        kind: Kind::BareChain,
        evidence: 1.0 - 0.5_f64.powi(length as i32 - 1),
        score: 0.0,
        extra: vec![],
        instances: vec![id],
        points: points_of(facts, step),
        position: member.instance.bounds.centre,
        measured: f64::from(length),
        bound: 1.0,
        unit: "bare majorities",
        sentence: format!(
            "{} was put together by {length} bare majorities, one after the other",
            member.instance.title()
        ),
    }
}

/// Pairs of instances whose common border voted against, but not by much.
///
/// All votes between the two are added up, as if they were two components.
pub(super) fn refused(facts: &Facts) -> Vec<Suspect> {
    let stages = facts.frame.stages;
    let tree = Tree::of(facts);
    let mut between: BTreeMap<(u32, u32), (u64, u64)> = BTreeMap::new();
    for vote in &stages.votes.pairs {
        let [a, b] = [vote.a, vote.b].map(|label| tree.instance[label as usize - 1]);
        if a != 0 && b != 0 && a != b {
            let votes = between.entry((a.min(b), a.max(b))).or_default();
            votes.0 += u64::from(vote.positive);
            votes.1 += u64::from(vote.negative);
        }
    }
    let ratio = facts.frame.config.cluster.merge_ratio;
    let found = between.into_iter().filter(|(_, votes)| votes.0 > 0);
    found.filter_map(|((a, b), votes)| refused_pair(facts, a, b, votes, ratio)).collect()
}

fn refused_pair(
    facts: &Facts,
    a: u32,
    b: u32,
    (positive, negative): (u64, u64),
    ratio: f64,
) -> Option<Suspect> {
    let (a, b) = (facts.member(a)?, facts.member(b)?);
    if a.family != b.family {
        return None;
    }
    let [smaller, larger] = if a.objects.len() > b.objects.len() { [b, a] } else { [a, b] };
    let measured = share(positive, negative);
    Some(Suspect {
        kind: Kind::RefusedVotes,
        evidence: ramp(measured, 0.0, ratio),
        score: 0.0,
        extra: vec![],
        instances: vec![smaller.instance.id, larger.instance.id],
        points: facts.facing(&smaller.objects, &larger.objects),
        position: smaller.instance.bounds.centre,
        measured,
        bound: ratio,
        unit: "of the votes",
        sentence: format!(
            "{} and {} stayed apart by V+ {positive} to V- {negative} on their border",
            smaller.instance.title(),
            larger.instance.title()
        ),
    })
}
