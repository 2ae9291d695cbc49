//! The chain of merges where there are no classes: the nodes of the tree of merges from one or two
//! points up to where they join, each with its box and its pixels, so that a page can draw them.

use serde::Serialize;

use super::run::Run;
use crate::diagnose::explain::{CutEvidence, Explanation};
use divmerge_core::cloud::UprightBox;
use divmerge_core::cluster::{MergeTree, NodeFacts};

/// Most nodes of each of the paths.
const MOST_OF_PATH: usize = 10;

/// A node on the way from the points to where they join.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct JoinedNode {
    /// Its number in the tree.
    pub node: u32,
    /// Its place among the listed nodes in the order in which they came to be, from 1.
    pub order: usize,
    /// The points that it holds, from 0.
    pub holds: Vec<usize>,
    /// Gap across which it became one group, and across which it joined another, metres.
    pub gaps: [f32; 2],
    /// Number of its pixels.
    pub pixels: u32,
    /// What it looks like.
    pub body: Option<&'static str>,
    /// How much it looks like an object, 0 to 1.
    pub score: Option<f64>,
    /// Whether it is an object.
    pub is_chosen: bool,
    /// Whether it is on the way to where the points join; else it lies above that.
    pub is_on_the_way: bool,
    /// The box around it.
    pub bounds: Option<UprightBox>,
    /// Places in the list of the nodes that are part of it.
    pub parts: Vec<usize>,
    /// Its pixels that are in none of these, as runs: the first pixel of the image and how many.
    pub runs: Vec<u32>,
}

/// The nodes of an explanation, from the points upwards; none where no tree was cut.
pub(super) fn joined_nodes(run: &Run, explanation: &Explanation) -> Vec<JoinedNode> {
    let (Some(cut), Some(tree)) = (explanation.cut(), &run.stages.post_merge.tree) else {
        return Vec::new();
    };
    let mut nodes: Vec<JoinedNode> = Vec::new();
    let mut ends = Vec::new();
    for (point, path) in cut.apart.iter().enumerate() {
        let before = nodes.len();
        for facts in listed(path) {
            let part = (nodes.len() > before).then(|| nodes.len() - 1);
            nodes.push(joined_node(run, tree, facts, (vec![point], part.into_iter().collect())));
        }
        ends.extend((nodes.len() > before).then(|| nodes.len() - 1));
    }
    let both: Vec<usize> = (0..cut.apart.len()).collect();
    let (way, above) = cut.common.split_at(up_to_the_join(cut));
    let best = above.iter().max_by(|a, b| total(a).total_cmp(&total(b)));
    for facts in listed(way).into_iter().chain(best) {
        let mut node = joined_node(run, tree, facts, (both.clone(), ends));
        node.is_on_the_way = way.iter().any(|own| own.node == facts.node);
        nodes.push(node);
        ends = vec![nodes.len() - 1];
    }
    let parts: Vec<Vec<u32>> = nodes.iter().map(|node| node.runs.clone()).collect();
    for node in &mut nodes {
        let within = node.parts.iter().flat_map(|&part| parts[part].iter().copied());
        node.runs = runs(without(&node.runs, within.collect()));
    }
    number(&mut nodes);
    nodes
}

/// How many of the nodes that hold all points lead to where they join; further to the one that was
/// chosen, or whose score would have to change. Of one point, to the one with the best score.
fn up_to_the_join(cut: &CutEvidence) -> usize {
    let is_last =
        |node: &NodeFacts| node.is_chosen || cut.flip.is_some_and(|flip| flip.node == node.node);
    let best = || {
        let places = 0..cut.common.len();
        places.max_by(|&a, &b| total(&cut.common[a]).total_cmp(&total(&cut.common[b])))
    };
    let last = cut.common.iter().rposition(is_last);
    let last = if cut.apart.len() == 1 { last.or_else(best) } else { last };
    cut.common.len().min(last.unwrap_or(0) + 1)
}

/// The score of a node, 0 of one that has none.
fn total(node: &NodeFacts) -> f64 {
    node.score.map_or(0.0, |score| score.total)
}

/// Of a long path its ends, what was chosen, and the nodes of the highest scores.
fn listed(path: &[NodeFacts]) -> Vec<&NodeFacts> {
    let weight = |place: usize| {
        let node = &path[place];
        match node.is_chosen || place == 0 || place + 1 == path.len() {
            true => f64::INFINITY,
            false => total(node),
        }
    };
    let mut places: Vec<usize> = (0..path.len()).collect();
    places.sort_by(|&a, &b| weight(b).total_cmp(&weight(a)).then(a.cmp(&b)));
    places.truncate(MOST_OF_PATH);
    places.sort_unstable();
    places.into_iter().map(|place| &path[place]).collect()
}

/// A node with all of its pixels.
fn joined_node(
    run: &Run,
    tree: &MergeTree,
    facts: &NodeFacts,
    (holds, parts): (Vec<usize>, Vec<usize>),
) -> JoinedNode {
    let (image, objects) = (&run.stages.image, &run.stages.objects);
    let of_node = tree.tree.pixels_of(&tree.tree.nodes[facts.node as usize]);
    let mut pixels: Vec<u32> =
        of_node.iter().map(|&object| objects.pixel[object as usize]).collect();
    pixels.sort_unstable();
    let points: Vec<u32> = pixels
        .iter()
        .filter_map(|&pixel| image.point_at(pixel as usize).map(|point| point as u32))
        .collect();
    JoinedNode {
        node: facts.node,
        order: 0,
        holds,
        gaps: [facts.place.birth, facts.place.death],
        pixels: facts.place.len,
        body: facts.score.map(|score| score.body.name()),
        score: facts.score.map(|score| score.total),
        is_chosen: facts.is_chosen,
        is_on_the_way: true,
        bounds: UprightBox::around(&run.cloud.cloud, &points),
        parts,
        runs: pixels,
    }
}

/// Ascending pixels without those of another list.
fn without(pixels: &[u32], mut others: Vec<u32>) -> Vec<u32> {
    others.sort_unstable();
    let is_other = |pixel: &u32| others.binary_search(pixel).is_ok();
    pixels.iter().copied().filter(|pixel| !is_other(pixel)).collect()
}

/// Ascending pixels as runs, each its first pixel and how many.
fn runs(pixels: Vec<u32>) -> Vec<u32> {
    let mut runs: Vec<u32> = Vec::new();
    for pixel in pixels {
        match runs.as_mut_slice() {
            [.., first, count] if *first + *count == pixel => *count += 1,
            _ => runs.extend([pixel, 1]),
        }
    }
    runs
}

/// Numbers nodes in the order in which they came to be.
fn number(nodes: &mut [JoinedNode]) {
    let mut places: Vec<usize> = (0..nodes.len()).collect();
    let key = |place: usize| (nodes[place].gaps[0], nodes[place].node);
    places.sort_by(|&a, &b| {
        let [(gap, node), (other, next)] = [key(a), key(b)];
        gap.total_cmp(&other).then(node.cmp(&next))
    });
    for (order, place) in (1..).zip(places) {
        nodes[place].order = order;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_become_runs() {
        assert_eq!(runs(vec![3, 4, 5, 9, 11, 12]), [3, 3, 9, 1, 11, 2]);
        assert!(runs(Vec::new()).is_empty());
        assert_eq!(without(&[1, 2, 3, 8], vec![8, 2]), [1, 3]);
    }
}
