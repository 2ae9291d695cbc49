//! Objects without classes: the best cut of the tree of merges. Ours; preset `best` uses it in
//! place of the votes (paper, Alg. 2) and of the bird's-eye merge (III.E), which need an angle that
//! suits all things or classes.
//!
//! It stays divide and merge, but the merge remembers every gap:
//!
//! 1. *Divide*: pixels near each other are linked ([`links`](mod@links)), and links join them from the shortest
//!    to the longest. A group of [`TreeMerge::least_points`] pixels is a leaf: a component.
//! 2. *Merge*: where two such groups meet, both become parts of a new node ([`nodes`]). No gap suits
//!    all things: people are told apart at 0.15 m, cars hang together at 0.5 m. So nothing is
//!    decided yet.
//! 3. *Score*: each node is judged by how much it looks like one whole body ([`mod@score`],
//!    [`bodies`]): its size, how isolated it is, whether it stands on the ground, how much of its
//!    face is seen.
//! 4. *Cut*: the disjoint nodes whose scores add up to most are the objects ([`mod@cut`]).
//! 5. *Background*: what no object holds is put together across gaps of
//!    [`TreeMerge::background`]. Groups of fewer than [`TreeMerge::least_points`] pixels are no
//!    instances ([`Reason::Scattered`](crate::cloud::Reason::Scattered)).
//!
//! Parameters were chosen on labelled drives and simulated ones by `examples/06_objects.rs`.
//!
//! Time O(M log M) in the object pixels.

pub mod bodies;
pub mod cut;
pub mod links;
pub mod measures;
pub mod nodes;
pub mod score;

use std::time::Instant;

use serde::Serialize;

use super::divide_and_merge::assigner::Merge;
use super::divide_and_merge::divide::Components;
use super::divide_and_merge::votes::Votes;
use super::method::{Method, MethodInput, Segmentation};
use super::params::{ClusterParams, TreeMerge};
use super::post_merge::PostMerge;
use crate::cloud::Reason;
use crate::geometry::disjoint_sets::DisjointSets;
use crate::geometry::statistics::median;
use crate::semantics::ground::GroundHeights;
use cut::{Cut, cut};
use links::{Link, links};
use measures::{NodeMeasures, measures};
use nodes::Tree;
use score::{Score, score};

/// The method of preset `best` for objects without classes.
#[derive(Debug)]
pub struct CutTree<'a> {
    /// Parameters that go into the metadata.
    pub params: &'a ClusterParams,
    /// Parameters of the tree and its cut.
    pub tree: &'a TreeMerge,
}

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
    fn new(input: &MethodInput, params: &TreeMerge, row_steps: &[f64], links: &[Link]) -> Self {
        let tree = Tree::new(input.objects.len(), links, params);
        let ground = GroundHeights::new(input.cloud, &input.mask.reason);
        let measures = measures(&tree, input, row_steps, &ground);
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

    /// M: the component of each object pixel from 1, and their number. A leaf is one, and so is each
    /// pixel that a larger node absorbed; pixels of no node have none.
    fn components(&self) -> (Vec<u32>, u32) {
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
    fn instances(
        &self,
        (label, count): (&[u32], u32),
        links: &[Link],
        params: &TreeMerge,
    ) -> Vec<u32> {
        let mut instance = vec![0; count as usize];
        for (id, &node) in (1..).zip(&self.cut.chosen) {
            for &object in self.tree.pixels_of(&self.tree.nodes[node as usize]) {
                instance[label[object as usize] as usize - 1] = id;
            }
        }
        let mut sets = DisjointSets::new(count as usize);
        let near = links.partition_point(|link| f64::from(link.distance) <= params.background);
        let left = |object: u32| {
            let label = label[object as usize];
            (label != 0 && instance[label as usize - 1] == 0).then(|| label as usize - 1)
        };
        for link in &links[..near] {
            if let (Some(a), Some(b)) = (left(link.a), left(link.b)) {
                sets.join(a, b);
            }
        }
        let mut pixels = vec![0; count as usize];
        for object in (0..label.len() as u32).filter_map(left) {
            pixels[sets.root(object)] += 1;
        }
        let mut number = vec![0; count as usize];
        let mut last = self.cut.chosen.len() as u32;
        for component in 0..count as usize {
            let root = sets.root(component);
            if instance[component] == 0 && pixels[root] >= params.least_points {
                if number[root] == 0 {
                    last += 1;
                    number[root] = last;
                }
                instance[component] = number[root];
            }
        }
        instance
    }
}

impl Method for CutTree<'_> {
    fn name(&self) -> &'static str {
        "cut-tree"
    }

    fn parameters(&self) -> serde_json::Value {
        serde_json::json!(self.params)
    }

    fn segment(&self, input: &MethodInput) -> Segmentation {
        let row_steps = input.image.row_steps(input.cloud);
        let row_step = median(&mut row_steps.clone()).unwrap_or(0.0);
        let links = links(input.objects, input.image, row_step, self.tree);
        let divided_at = Some(Instant::now());
        let tree = MergeTree::new(input, self.tree, &row_steps, &links);
        let (mut label, count) = tree.components();
        let instance = tree.instances((&label, count), &links, self.tree);
        let components = keep(&mut label, &instance);
        let count = components.len() as u32;
        Segmentation {
            components: Components { label, count, grown: Vec::new() },
            votes: Votes { components: count, pairs: Vec::new() },
            merge: Merge { instance_of_component: (1..=count).collect(), count, steps: Vec::new() },
            post_merge: PostMerge {
                instance: components,
                tree: Some(tree),
                ..PostMerge::default()
            },
            unlabelled: Reason::Scattered,
            divided_at,
            ..Segmentation::default()
        }
    }
}

/// Leaves out the components without an instance: their pixels have none. Returns the instance of
/// each of the others, component k at k - 1.
fn keep(label: &mut [u32], instance: &[u32]) -> Vec<u32> {
    let mut number = vec![0; instance.len() + 1];
    let mut kept = Vec::new();
    for (component, &instance) in (1..).zip(instance) {
        if instance != 0 {
            kept.push(instance);
            number[component] = kept.len() as u32;
        }
    }
    for label in label {
        *label = number[*label as usize];
    }
    kept
}
