//! Cuts of the tree of merges that were close (objects without classes).

use super::facts::FrameFacts;
use super::suspect::{Suspect, SuspectKind, ramp};
use divmerge_core::cluster::{MergeTree, NodeFacts};

/// Objects whose parts were worth nearly as much as the whole, and objects that were worth little
/// more than the whole that they are part of. The evidence grows from a difference of a third on to
/// none.
pub(super) fn close_cuts(facts: &FrameFacts) -> Vec<Suspect> {
    let Some(tree) = &facts.frame.stages.post_merge.tree else {
        return Vec::new();
    };
    let wholes = tree.cut.chosen.iter().filter_map(|&node| close_whole(facts, tree, node));
    let parts = (0..tree.tree.nodes.len() as u32).filter_map(|node| close_parts(facts, tree, node));
    wholes.chain(parts).collect()
}

/// The evidence of a choice between two, given what the chosen and the other are worth.
fn closeness(chosen: f64, other: f64) -> f64 {
    ramp(other / chosen, 2.0 / 3.0, 1.0)
}

/// An object that nearly was cut in parts.
fn close_whole(facts: &FrameFacts, tree: &MergeTree, node: u32) -> Option<Suspect> {
    let whole = tree.facts(node);
    let evidence = closeness(whole.gain, whole.of_parts);
    let member = facts.member(instance_of(facts, tree, &whole)?)?;
    (evidence > 0.0).then(|| Suspect {
        measured: whole.of_parts,
        bound: whole.gain,
        sentence: format!(
            "{} is worth {:.2} as one object and {:.2} in parts",
            member.instance.title(),
            whole.gain,
            whole.of_parts
        ),
        points: middle_points(facts, tree, &whole),
        ..facts.suspect(SuspectKind::CloseCut, evidence, member)
    })
}

/// Two groups of objects that nearly were one.
fn close_parts(facts: &FrameFacts, tree: &MergeTree, node: u32) -> Option<Suspect> {
    let whole = tree.facts(node);
    let is_refused = whole.gain > 0.0 && whole.gain < whole.of_parts;
    let evidence = if is_refused { closeness(whole.of_parts, whole.gain) } else { 0.0 };
    if evidence == 0.0 {
        return None;
    }
    let children = whole.place.children?.map(|child| tree.facts(child));
    let [one, other] = children.map(|child| instance_of(facts, tree, &child));
    let members = [facts.member(one?)?, facts.member(other?)?];
    if members[0].instance.id == members[1].instance.id {
        return None;
    }
    let is_larger = members[0].objects.len() > members[1].objects.len();
    let members = if is_larger { [members[1], members[0]] } else { members };
    let [smaller, larger] = members.map(|member| member.instance.title());
    Some(Suspect {
        measured: whole.gain,
        bound: whole.of_parts,
        sentence: format!(
            "{smaller} and {larger} are worth {:.2} apart, and {:.2} as one {}",
            whole.of_parts,
            whole.gain,
            whole.score.map_or("object", |score| score.body.name())
        ),
        points: facts.facing(&members[0].objects, &members[1].objects),
        ..facts.suspect_pair(SuspectKind::CloseCut, evidence, members)
    })
}

/// The instance of the first pixel of a node.
fn instance_of(facts: &FrameFacts, tree: &MergeTree, node: &NodeFacts) -> Option<u32> {
    let pixel = *tree.tree.pixels_of(&node.place).first()?;
    Some(facts.instance_of[pixel as usize]).filter(|&instance| instance != 0)
}

/// A point of each of the parts of a node, facing each other.
fn middle_points(facts: &FrameFacts, tree: &MergeTree, node: &NodeFacts) -> Vec<usize> {
    let Some(children) = node.place.children else {
        return Vec::new();
    };
    let [one, other] = children.map(|child| tree.tree.pixels_of(&tree.tree.nodes[child as usize]));
    facts.facing(one, other)
}
