//! What the cut of the tree of merges did with one or two points, there being no classes (preset
//! `best`).

use serde::Serialize;

use super::facts::PointFacts;
use super::subject::ClusteredCloud;
use divmerge_core::cluster::params::TreeMerge;
use divmerge_core::cluster::tree::cut::cut;
use divmerge_core::cluster::{MergeTree, NodeFacts};

/// The nodes of the tree that hold the points, and what was chosen of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CutEvidence {
    /// Whether the points are of one instance; of one point, whether it is of an object.
    pub joined: bool,
    /// For each point the nodes that hold it and not the other, the smallest first.
    pub apart: Vec<Vec<NodeFacts>>,
    /// The nodes that hold all of the points, the smallest first.
    pub common: Vec<NodeFacts>,
    /// What is no object is put together across gaps up to this, metres.
    pub background: f64,
    /// The smallest change of one score that gives the other answer, if one does.
    pub flip: Option<ScoreFlip>,
}

/// A node whose score would have to change.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ScoreFlip {
    /// The node.
    pub node: u32,
    /// Its score.
    pub score: f64,
    /// The score from which on, or below which, the answer is the other one.
    pub needed: f64,
}

impl CutEvidence {
    /// The node of each point that is an object.
    pub fn chosen(&self, point: usize) -> Option<&NodeFacts> {
        self.apart[point].iter().chain(&self.common).find(|node| node.is_chosen)
    }
}

/// The evidence; `None` where the run cut no tree or a point has no pixel in it.
pub(super) fn evidence(frame: &ClusteredCloud, points: &[PointFacts]) -> Option<CutEvidence> {
    let tree = frame.stages.post_merge.tree.as_ref()?;
    let params = frame.config.cluster.tree?;
    let paths = points.iter().map(|point| {
        let node = tree.node_of_pixel[point.object?]?;
        Some(tree.tree.path(node).collect())
    });
    let mut paths: Vec<Vec<u32>> = paths.collect::<Option<_>>()?;
    let common = take_common(&mut paths);
    let facts = |nodes: &[u32]| nodes.iter().map(|&node| tree.facts(node)).collect::<Vec<_>>();
    let joined = match points {
        [a, b] => a.instance == b.instance && a.instance != 0,
        _ => common.iter().any(|&node| tree.facts(node).is_chosen),
    };
    let flip = match (joined, points) {
        (true, [_, _]) => split(tree, &paths, &common, &params),
        (false, [_, _]) => union(tree, &common, &params),
        _ => None,
    };
    Some(CutEvidence {
        joined,
        apart: paths.iter().map(|path| facts(path)).collect(),
        common: facts(&common),
        background: params.background,
        flip,
    })
}

/// Takes off what the paths end with alike.
fn take_common(paths: &mut [Vec<u32>]) -> Vec<u32> {
    let mut common = Vec::new();
    while let Some(&last) = paths[0].last()
        && paths.iter().all(|path| path.last() == Some(&last))
    {
        paths.iter_mut().for_each(|path| path.truncate(path.len() - 1));
        common.push(last);
    }
    common.reverse();
    common
}

/// Two points of one object: the score below which its parts are chosen instead, if they are in two
/// of them.
fn split(
    tree: &MergeTree,
    apart: &[Vec<u32>],
    common: &[u32],
    params: &TreeMerge,
) -> Option<ScoreFlip> {
    let whole = *common.iter().find(|&&node| tree.facts(node).is_chosen)?;
    let mut gain = tree.gain.clone();
    gain[whole as usize] = 0.0;
    let other = cut(&tree.tree.nodes, &gain).chosen;
    let is_chosen = |node: &u32| other.binary_search(node).is_ok();
    let is_one = common.iter().any(is_chosen);
    let is_split = apart.iter().any(|path| path.iter().any(is_chosen)) && !is_one;
    let facts = tree.facts(whole);
    let score = facts.score?.total;
    let needed = facts.of_parts.powf(1.0 / params.power).max(params.least_score);
    is_split.then_some(ScoreFlip { node: whole, score, needed })
}

/// Two points of two instances: of the nodes that hold both the one whose score is nearest to that
/// from which on it is chosen.
fn union(tree: &MergeTree, common: &[u32], params: &TreeMerge) -> Option<ScoreFlip> {
    let flip = |&node: &u32| {
        let facts = tree.facts(node);
        let score = facts.score?.total;
        let needed = worth_needed(tree, node).powf(1.0 / params.power).max(params.least_score);
        (needed <= 1.0).then_some(ScoreFlip { node, score, needed })
    };
    let by = |flip: &ScoreFlip| flip.needed - flip.score;
    common.iter().filter_map(flip).min_by(|a, b| by(a).total_cmp(&by(b)))
}

/// What a node would have to be worth to be chosen: as much as its parts, and so much that no node
/// that it is part of is chosen in its place.
fn worth_needed(tree: &MergeTree, node: u32) -> f64 {
    let best = &tree.cut.best;
    let mut needed = tree.facts(node).of_parts;
    let mut beside = 0.0;
    for pair in tree.tree.path(node).collect::<Vec<_>>().windows(2) {
        let [below, above] = [pair[0], pair[1]].map(|node| node as usize);
        let siblings = tree.tree.nodes[above].children.iter().flatten();
        let others = siblings.filter(|&&child| child as usize != below);
        beside += others.map(|&child| best[child as usize]).sum::<f64>();
        needed = needed.max(tree.gain[above] - beside);
    }
    needed
}
