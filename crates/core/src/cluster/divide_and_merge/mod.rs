//! Divide and merge (Zhao, Zhang and Huang, arXiv 2109.08224): the method of presets `paper` and
//! `authors`, a file a step.
//!
//! | step | file | paper | ALGORITHM |
//! | --- | --- | --- | --- |
//! | seeds | [`seeds`](mod@seeds) | III.B | 4 |
//! | growth | [`divide`](mod@divide) | Alg. 1 | 4 |
//! | votes | [`votes`] | V+ and V- | 4, 5 |
//! | merge | [`merge`](mod@merge), [`assigner`] | Alg. 2 | 5 |
//! | bird's-eye merge | [`birds_eye`](mod@birds_eye), [`regions`] | III.E | 6 |

pub mod assigner;
pub mod birds_eye;
pub mod divide;
pub mod merge;
pub mod regions;
pub mod seeds;
pub mod votes;

use std::time::Instant;

use super::method::{Method, MethodInput, Segmentation};
use super::objects::ObjectPixels;
use super::params::ClusterParams;
use super::post_merge::PostMerge;

/// The paper's method: components grow from seeds, pixels on their borders vote, and the votes
/// decide which components are one instance.
#[derive(Debug)]
pub struct DivideAndMerge<'a> {
    /// Its parameters.
    pub params: &'a ClusterParams,
}

impl Method for DivideAndMerge<'_> {
    fn name(&self) -> &'static str {
        "divide-and-merge"
    }

    fn parameters(&self) -> serde_json::Value {
        serde_json::json!(self.params)
    }

    fn segment(&self, input: &MethodInput) -> Segmentation {
        let objects = input.objects;
        let mut segmentation = merge_by_votes(objects, self.params);
        let Segmentation { components, merge, .. } = &segmentation;
        let post_merge = birds_eye::birds_eye(objects, components, merge, self.params.birds_eye);
        segmentation.post_merge = post_merge; // III.E
        segmentation
    }
}

/// The steps that our methods have in common: seeds, growth, votes and the merge on the votes.
/// Nothing follows the merge yet.
pub(super) fn merge_by_votes(objects: &ObjectPixels, params: &ClusterParams) -> Segmentation {
    let seeds = seeds::seeds(objects, params); // III.B
    let (components, votes) = divide::divide(objects, &seeds, params); // Alg. 1
    let divided_at = Some(Instant::now());
    let merge = merge::merge(&votes, params); // Alg. 2
    let post_merge = PostMerge::unchanged(merge.count);
    Segmentation {
        seeds,
        components,
        votes,
        merge,
        post_merge,
        divided_at,
        ..Segmentation::default()
    }
}
