//! Objects without classes: the best cut of the tree of merges. Ours; preset `best` uses it in
//! place of the votes (paper, Alg. 2) and of the bird's-eye merge (III.E), which need an angle that
//! suits all things or classes.
//!
//! It stays divide and merge, but the merge remembers every gap:
//!
//! 1. *Divide*: pixels near each other are linked ([`mod@links`]), and links join them from the
//!    shortest to the longest. A group of [`TreeMerge::least_points`] pixels is a leaf: a
//!    component.
//! 2. *Merge*: where two such groups meet, both become parts of a new node ([`nodes`]). No gap
//!    suits all things: people are told apart at 0.15 m, cars hang together at 0.5 m. So nothing is
//!    decided yet.
//! 3. *Score*: each node is judged by how much it looks like one whole body ([`mod@score`],
//!    [`bodies`]): its size, how isolated it is, whether it stands on the ground, how much of its
//!    face is seen.
//! 4. *Cut*: the disjoint nodes whose scores add up to most are the objects ([`mod@cut`]).
//! 5. *Background*: what no object holds is put together across gaps of
//!    [`TreeMerge::background`]. Groups of fewer than [`TreeMerge::least_points`] pixels are no
//!    instances ([`Reason::Scattered`]).
//!
//! Parameters were chosen on labelled drives and simulated ones by `examples/06_objects.rs`.
//!
//! Time O(M log M) in the object pixels.

pub mod bodies;
pub mod calibration;
pub mod cut;
mod in_space;
pub mod links;
pub mod measures;
pub mod merge_tree;
pub mod nodes;
pub mod score;

use std::time::Instant;

use super::divide_and_merge::assigner::Merge;
use super::divide_and_merge::divide::Components;
use super::divide_and_merge::votes::Votes;
use super::method::{Method, MethodInput, Segmentation};
use super::params::{ClusterParams, TreeMerge};
use super::post_merge::PostMerge;
use crate::cloud::Reason;
use crate::geometry::statistics::median;
use crate::semantics::ground::GroundHeights;
use in_space::SpaceLinker;
use links::WindowLinker;
use measures::measures;
use nodes::{Grown, Tree};

pub use merge_tree::{MergeTree, NodeFacts};

/// The method of preset `best` for objects without classes.
#[derive(Debug)]
pub struct CutTree<'a> {
    /// Parameters that go into the metadata.
    pub params: &'a ClusterParams,
    /// Parameters of the tree and its cut.
    pub tree: &'a TreeMerge,
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
        let is_in_space = input.image.is_from_assumed_place();
        let count = input.objects.len();
        let Grown { tree, fine, links } = match is_in_space {
            true => Tree::grow(count, &mut SpaceLinker::new(input.objects, self.tree), self.tree),
            false => {
                let (objects, image) = (input.objects, input.image);
                let mut linker = WindowLinker::new(objects, image, row_step, self.tree);
                Tree::grow(count, &mut linker, self.tree)
            }
        };
        let divided_at = Some(Instant::now());
        let sensor = input.image.sensor_place();
        let ground = GroundHeights::new(input.cloud, &input.mask.reason, sensor);
        let up = if input.mask.ground_is_overhead { -1.0 } else { 1.0 };
        let of = (input.objects, input.image);
        let measures = measures(&tree, of, &row_steps, (&ground, up));
        let tree = MergeTree::new(tree, measures, self.tree);
        let (mut label, count) = tree.components();
        let instance = tree.instances((&label, count), (&fine, &links), self.tree);
        let components = keep(&mut label, &instance);
        let count = components.len() as u32;
        let of_point =
            is_in_space.then(|| in_space::labels_of_points(input, &label, self.tree.background));
        Segmentation {
            of_point,
            components: Components { label, count, grown: Vec::new() },
            votes: Votes { components: count, pairs: Vec::new() },
            merge: Merge { instance_of_component: (1..=count).collect(), count, steps: Vec::new() },
            post_merge: PostMerge {
                instance: components,
                tree: Some(tree),
                ..PostMerge::default()
            },
            unlabelled: Reason::Scattered,
            ground: Some(ground),
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
