//! What is special to preset `authors`: the C++ that the paper's authors released, less its memory
//! errors (ALGORITHM section 7). The steps that are not listed are the paper's.
//!
//! | step | file | difference from the paper |
//! | --- | --- | --- |
//! | condition | [`condition`] | the angle between nominal rays, and distance gates |
//! | growth | [`growth`] | seeds labelled when popped; pixels change hands |
//! | merge | [`merge`] | V+ / (V+ + V-) > 0.4; votes added to the opener's row |
//! | bird's-eye merge | [`birds_eye`] | boxes, 0.1 m, any class, the last writer wins |
//! | parameters | here | |

pub(super) mod birds_eye;
pub(super) mod condition;
pub(super) mod growth;
pub(super) mod merge;

use super::params::{
    Accumulation, BirdsEye, ClusterParams, Condition, Gate, Rays, Region, Rounding, Seeding,
};

impl ClusterParams {
    /// What the released C++ does, less its memory errors (ALGORITHM section 7).
    pub fn authors() -> Self {
        ClusterParams {
            voxel: 0.2,
            rounding: Rounding::Nearest,
            condition: Condition {
                angle: 0.15,
                rays: Rays::Nominal { row_step: 28_f64.to_radians() / 64.0 },
                gate: Some(Gate {
                    farthest: 1.5,
                    touching: 0.5,
                    touching_range: 5.0,
                    reach_by_range: vec![(1.5, 11), (3.0, 9), (5.0, 7), (8.0, 5), (15.0, 3)],
                }),
                nearness: None,
            },
            gap_columns: usize::MAX,
            gap_rows: 10,
            seeding: Seeding::AtPop,
            merge_ratio: 0.4,
            accumulation: Accumulation::IntoOpener,
            birds_eye: Some(BirdsEye {
                region: Region::Box,
                margin: 0.1,
                same_class: false,
                transitive: false,
                grown_pixels_only: true,
            }),
            min_pixels: 31,
            ..Self::paper()
        }
    }
}
