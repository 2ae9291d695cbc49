//! Our methods, behind one trait, and the steps they have in common.
//!
//! | what | file | paper | ALGORITHM |
//! | --- | --- | --- | --- |
//! | the trait, its input and its result | [`method`], [`post_merge`] | | |
//! | parameters, presets | [`params`] | | 7 |
//! | object pixels, neighbours | [`objects`] | Neighborhood of Alg. 1 | 2, 4 |
//! | condition | [`condition`] | Fig. 2 | 3 |
//! | divide and merge (`paper`, `authors`) | [`divide_and_merge`] | Alg. 1 and 2, III.E | 4 to 6 |
//! | what is special to `authors` | `authors` | | 7 |
//! | merge by size (`best`) | [`fragments`] | ours | |
//! | cut of the tree of merges (`best` without classes) | [`tree`] | ours | |
//! | back to points | [`back_projection`] | | 6 |

mod authors;
pub mod back_projection;
pub mod condition;
pub mod divide_and_merge;
pub mod fragments;
pub mod method;
pub mod objects;
pub mod params;
pub mod post_merge;
pub mod tree;

pub use divide_and_merge::DivideAndMerge;
pub use divide_and_merge::assigner::{Merge, MergeStep};
pub use divide_and_merge::divide::{Components, divide};
pub use divide_and_merge::merge::merge;
pub use divide_and_merge::regions::{InstanceRegion, regions};
pub use divide_and_merge::seeds::seeds;
pub use divide_and_merge::votes::{Vote, Votes};
pub use fragments::{Fragment, Group, MergeBySize, SizeTest, assemble};
pub use method::{Method, MethodInput, Segmentation};
pub use objects::{NeighbourCondition, ObjectPixels};
pub use params::ClusterParams;
pub use post_merge::{Evidence, Join, PostMerge};
pub use tree::{CutTree, MergeTree, NodeFacts};
