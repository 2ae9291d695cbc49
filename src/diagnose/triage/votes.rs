//! Votes that only just decided, one way or the other, and chains of them.

use std::collections::BTreeMap;

use super::facts::{FrameFacts, InstanceFacts};
use super::suspect::{Suspect, SuspectKind, ramp};
use divmerge_core::cluster::MergeStep;

/// A majority is bare if its margin is less than this: below 60 % of the votes where more than 50 %
/// are required.
const BARE: f64 = 0.2;

/// Share of votes in favour.
fn share(positive: u64, negative: u64) -> f64 {
    positive as f64 / (positive + negative).max(1) as f64
}

/// The share of votes in favour beyond the required ratio, scaled: 0 for the barest majority, 1
/// without a vote against.
fn margin(step: &MergeStep, ratio: f64) -> f64 {
    (share(step.positive, step.negative) - ratio) / (1.0 - ratio)
}

/// The merges as a tree of components.
struct Tree {
    /// Pixels of each component and of all components below it in the tree; component k at k - 1.
    below: Vec<u32>,
    /// Final instance of each component, or 0.
    instance: Vec<u32>,
}

impl Tree {
    fn of(facts: &FrameFacts) -> Self {
        let stages = facts.frame.stages;
        let count = stages.components.count as usize;
        let (mut below, mut instance) = (vec![0_u32; count], vec![0; count]);
        for (&label, &id) in stages.components.label.iter().zip(&facts.instance_of) {
            if label != 0 {
                below[label as usize - 1] += 1;
                instance[label as usize - 1] = id;
            }
        }
        for step in stages.merge.steps.iter().rev() {
            below[step.target as usize - 1] += below[step.query as usize - 1];
        }
        Tree { below, instance }
    }

    fn member<'a>(
        &self,
        facts: &'a FrameFacts<'a>,
        step: &MergeStep,
    ) -> Option<&'a InstanceFacts<'a>> {
        facts.member(self.instance[step.query as usize - 1])
    }
}

/// Merges on a thin majority, and chains of bare ones.
pub(super) fn merges(facts: &FrameFacts) -> Vec<Suspect> {
    let tree = Tree::of(facts);
    let steps = &facts.frame.stages.merge.steps;
    let lengths = chains(steps, facts.frame.config.cluster.merge_ratio, tree.below.len());
    let each = steps.iter().zip(lengths);
    let suspects = each.flat_map(|(step, length)| {
        [thin_majority(facts, &tree, step), bare_chain(facts, &tree, step, length)]
    });
    suspects.flatten().collect()
}

/// For each step the number of bare majorities in a row that end in it.
fn chains(steps: &[MergeStep], ratio: f64, components: usize) -> Vec<u32> {
    let mut bare = vec![0_u32; components];
    let length = |step: &MergeStep| {
        let before = bare[step.target as usize - 1];
        let length = if margin(step, ratio) < BARE { before + 1 } else { 0 };
        bare[step.query as usize - 1] = length;
        length
    };
    steps.iter().map(length).collect()
}

/// Full for the barest majority on which half of an instance's pixels depend; 0 without votes
/// against, or without pixels that depend on it.
fn thin_majority(facts: &FrameFacts, tree: &Tree, step: &MergeStep) -> Option<Suspect> {
    let member = tree.member(facts, step)?;
    let ratio = facts.frame.config.cluster.merge_ratio;
    let (below, all) = (tree.below[step.query as usize - 1] as usize, member.objects.len());
    let hanging = below.min(all.saturating_sub(below)) as f64 / all as f64;
    let evidence = ramp(margin(step, ratio), 1.0, 0.0) * ramp(hanging, 0.0, 0.5);
    (evidence > 0.0).then(|| Suspect {
        points: points_of(facts, member, step),
        measured: share(step.positive, step.negative),
        bound: ratio,
        unit: "of the votes",
        sentence: format!(
            "{below} of the {all} pixels of {} depend on one merge: component {} joined {} by \
             V+ {} to V- {}",
            member.instance.title(),
            step.query,
            step.target,
            step.positive,
            step.negative
        ),
        ..facts.suspect(SuspectKind::ThinMajority, evidence, member)
    })
}

/// Fires from two bare majorities in a row on; each more halves the remaining confidence.
fn bare_chain(facts: &FrameFacts, tree: &Tree, step: &MergeStep, length: u32) -> Option<Suspect> {
    let member = tree.member(facts, step).filter(|_| length > 1)?;
    let evidence = 1.0 - 0.5_f64.powi(length as i32 - 1);
    Some(Suspect {
        points: points_of(facts, member, step),
        measured: f64::from(length),
        bound: 1.0,
        unit: "bare majorities",
        sentence: format!(
            "{} holds together by {length} bare majorities, one after the other",
            member.instance.title()
        ),
        ..facts.suspect(SuspectKind::BareChain, evidence, member)
    })
}

/// A point of either component of a merge.
fn points_of(facts: &FrameFacts, member: &InstanceFacts, step: &MergeStep) -> Vec<usize> {
    let labels = &facts.frame.stages.components.label;
    let first =
        |label: u32| member.objects.iter().find(|&&object| labels[object as usize] == label);
    let pixels = [step.target, step.query].into_iter().filter_map(first);
    pixels.map(|&object| facts.point(object)).collect()
}

/// Pairs of instances of one family whose common border voted against joining, but not by much:
/// full if one more vote would have joined them, 0 without a vote in favour.
///
/// All votes between the two are added up, as if each were one component.
pub(super) fn refused(facts: &FrameFacts) -> Vec<Suspect> {
    let tree = Tree::of(facts);
    let mut between: BTreeMap<(u32, u32), (u64, u64)> = BTreeMap::new();
    for vote in &facts.frame.stages.votes.pairs {
        let [a, b] = [vote.a, vote.b].map(|label| tree.instance[label as usize - 1]);
        if a != 0 && b != 0 && a != b {
            let votes = between.entry((a.min(b), a.max(b))).or_default();
            votes.0 += u64::from(vote.positive);
            votes.1 += u64::from(vote.negative);
        }
    }
    let found = between.into_iter().filter(|(_, votes)| votes.0 > 0);
    found.filter_map(|((a, b), votes)| refused_pair(facts, a, b, votes)).collect()
}

fn refused_pair(
    facts: &FrameFacts,
    a: u32,
    b: u32,
    (positive, negative): (u64, u64),
) -> Option<Suspect> {
    let (a, b) = (facts.member(a)?, facts.member(b)?);
    let pair = if a.objects.len() > b.objects.len() { [b, a] } else { [a, b] };
    let (ratio, measured) = (facts.frame.config.cluster.merge_ratio, share(positive, negative));
    (a.family == b.family).then(|| Suspect {
        points: facts.facing(&pair[0].objects, &pair[1].objects),
        measured,
        bound: ratio,
        unit: "of the votes",
        sentence: format!(
            "{} and {} stayed apart by V+ {positive} to V- {negative} on their border",
            pair[0].instance.title(),
            pair[1].instance.title()
        ),
        ..facts.suspect_pair(SuspectKind::RefusedVotes, ramp(measured, 0.0, ratio), pair)
    })
}
