//! Divide and merge: the paper, a file a step.
//!
//! | step | file | paper | ALGORITHM |
//! | --- | --- | --- | --- |
//! | parameters, presets | [`params`] | | 7 |
//! | object pixels, neighbours | [`objects`] | Neighborhood of Alg. 1 | 2, 4 |
//! | condition | [`condition`] | Fig. 2 | 3 |
//! | seeds | [`seeds`](mod@seeds) | III.B | 4 |
//! | growth | [`divide`](mod@divide) | Alg. 1 | 4 |
//! | votes | [`votes`] | V+ and V- | 4, 5 |
//! | merge | [`merge`](mod@merge) | Alg. 2 | 5 |
//! | bird's-eye merge | [`birds_eye`](mod@birds_eye) | III.E | 6 |
//! | fragments by size | [`fragments`](mod@fragments) | ours | |
//! | pieces by gaps, where there are no classes | [`gaps`] | ours | |
//! | back to points | [`back_projection`] | | 6 |

pub mod back_projection;
pub mod birds_eye;
mod cells;
pub mod condition;
pub mod divide;
pub mod fragments;
pub mod gaps;
pub mod merge;
pub mod objects;
pub mod params;
pub mod seeds;
pub mod touching;
pub mod votes;

pub use birds_eye::{birds_eye, fragments};
pub use divide::{Components, divide};
pub use fragments::{Evidence, Fragment, Join, assemble};
pub use gaps::join_by_gaps;
pub use merge::{Merge, MergeStep, merge};
pub use objects::ObjectPixels;
pub use params::ClusterParams;
pub use seeds::seeds;
pub use votes::{Vote, Votes};
