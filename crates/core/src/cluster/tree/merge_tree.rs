//! The tree of merges of a frame, the cut of it, and what both make of the pixels.

use serde::Serialize;

use super::cut::{self, Cut, cut};
use super::links::Link;
use super::measures::NodeMeasures;
use super::nodes::{self, Tree};
use super::score::{Score, score};
use crate::cluster::params::TreeMerge;
use crate::geometry::disjoint_sets::DisjointSets;

/// The tree of merges of a frame and the cut that was made.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MergeTree {
    /// The tree.
    pub tree: Tree,
    /// What was measured on each node.
    pub measures: Vec<NodeMeasures>,
    /// The score of each node; `None` of those that are too small or too large to be objects.
    pub scores: Vec<Option<Score>>,
    /// What each node is worth.
    pub gain: Vec<f64>,
    /// The cut.
    pub cut: Cut,
    /// M: the smallest node that holds each object pixel.
    pub node_of_pixel: Vec<Option<u32>>,
}

/// What is known of one node.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NodeFacts {
    /// Its number.
    pub node: u32,
    /// Its place in the tree.
    #[serde(flatten)]
    pub place: nodes::Node,
    /// What was measured.
    pub measures: NodeMeasures,
    /// Its score.
    pub score: Option<Score>,
    /// What it is worth.
    pub gain: f64,
    /// The most that its parts are worth.
    pub of_parts: f64,
    /// Whether it is an object.
    pub is_chosen: bool,
}

impl MergeTree {
    /// The best cut of a tree, given what was measured on its nodes.
    pub(super) fn new(tree: Tree, measures: Vec<NodeMeasures>, params: &TreeMerge) -> Self {
        let scores = tree.nodes.iter().zip(&measures).map(|(node, own)| {
            let parent = node.parent.map(|parent| &measures[parent as usize]);
            score(node, own, parent, params)
        });
        let scores: Vec<Option<Score>> = scores.collect();
        let gain: Vec<f64> =
            scores.iter().map(|score| score.map_or(0.0, |score| score.gain(params))).collect();
        let cut = cut(&tree.nodes, &gain);
        let node_of_pixel = tree.node_of_pixel();
        MergeTree { tree, measures, scores, gain, cut, node_of_pixel }
    }

    /// What is known of a node.
    pub fn facts(&self, node: u32) -> NodeFacts {
        let number = node as usize;
        let place = self.tree.nodes[number];
        NodeFacts {
            node,
            place,
            measures: self.measures[number],
            score: self.scores[number],
            gain: self.gain[number],
            of_parts: cut::of_parts(&place, &self.cut.best),
            is_chosen: self.cut.chosen.binary_search(&node).is_ok(),
        }
    }

    /// The score of the object that an instance of the cut is, numbered from 1 before small ones
    /// are dropped; `None` of background.
    pub fn object(&self, instance: u32) -> Option<&Score> {
        let node = *self.cut.chosen.get(instance as usize - 1)?;
        self.scores[node as usize].as_ref()
    }

    /// M: the component of each object pixel from 1, and their number. A leaf is one, and so is
    /// each pixel that a larger node absorbed; pixels of no node have none.
    pub(super) fn components(&self) -> (Vec<u32>, u32) {
        let mut label = vec![0; self.node_of_pixel.len()];
        let mut of_leaf = vec![0; self.tree.nodes.len()];
        let mut count = 0;
        for (label, node) in label.iter_mut().zip(&self.node_of_pixel) {
            let Some(node) = *node else { continue };
            let is_leaf = self.tree.nodes[node as usize].children.is_none();
            let known = &mut of_leaf[node as usize];
            if !is_leaf || *known == 0 {
                count += 1;
                *known = count;
            }
            *label = *known;
        }
        (label, count)
    }

    /// The instance of each component from 1 (component k at k - 1): objects first, then what is
    /// left, put together across the gaps of the background; 0 of groups that are too small.
    pub(super) fn instances(
        &self,
        (label, count): (&[u32], u32),
        (fine, links): (&[u32], &[Link]),
        params: &TreeMerge,
    ) -> Vec<u32> {
        let mut instance = vec![0; count as usize];
        for (id, &node) in (1..).zip(&self.cut.chosen) {
            for &object in self.tree.pixels_of(&self.tree.nodes[node as usize]) {
                instance[label[object as usize] as usize - 1] = id;
            }
        }
        let mut sets = DisjointSets::new(count as usize);
        let left = |object: u32| {
            let label = label[object as usize];
            (label != 0 && instance[label as usize - 1] == 0).then(|| label as usize - 1)
        };
        let near = links.iter().filter(|link| f64::from(link.distance) <= params.background);
        let links = near.map(|link| (link.a, link.b));
        for (a, b) in (0..).zip(fine.iter().copied()).chain(links) {
            if let (Some(a), Some(b)) = (left(a), left(b)) {
                sets.join(a, b);
            }
        }
        let mut pixels = vec![0; count as usize];
        for object in (0..label.len() as u32).filter_map(left) {
            pixels[sets.root(object)] += 1;
        }
        let mut number = vec![0; count as usize];
        let mut last = self.cut.chosen.len() as u32;
        for (component, instance) in instance.iter_mut().enumerate() {
            let root = sets.root(component);
            if *instance == 0 && pixels[root] >= params.least_points {
                if number[root] == 0 {
                    last += 1;
                    number[root] = last;
                }
                *instance = number[root];
            }
        }
        instance
    }
}
