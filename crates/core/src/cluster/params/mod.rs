//! Every parameter of the clustering, and the three presets as values of it.

mod condition;
mod merges;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use condition::{Condition, Gate, Nearness, Rays};
pub use merges::{BirdsEye, FragmentMerge, Region, TreeMerge};

/// Parameters of the divide step, the merge step and what follows. The presets are values of this
/// one struct; none has code of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClusterParams {
    /// Side of a voxel in metres (the paper's l). Default 0.5.
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [0.05, 3.0]))]
    #[schemars(extend("source" = "paper, III.B and Algorithm 1: l"))]
    pub voxel: f64,
    /// How coordinates become voxels. `paper`: floor.
    #[schemars(extend("source" = "ALGORITHM 4; the released code: nearest"))]
    pub rounding: Rounding,
    /// When two neighbouring pixels belong together.
    pub condition: Condition,
    /// Most columns to a neighbour. `paper`: 1.
    #[schemars(range(min = 1), extend("unit" = "pixels", "slider" = [1, 16], "unlimited" = true))]
    #[schemars(extend("source" = "ALGORITHM 4; the released code: unlimited"))]
    pub gap_columns: usize,
    /// Most rows to a neighbour. `paper`: 1.
    #[schemars(range(min = 1), extend("unit" = "pixels", "slider" = [1, 16]))]
    #[schemars(extend("source" = "ALGORITHM 4; the released code: 10"))]
    pub gap_rows: usize,
    /// Whether only pixels of one class are neighbours. `paper`: no.
    pub same_class_neighbours: bool,
    /// When a seed's pixel gets its label. `paper`: at once.
    #[schemars(extend("source" = "paper, Algorithm 1; the released code: at_pop"))]
    pub seeding: Seeding,
    /// What becomes of object pixels that no seed reaches. `paper`: they stay without a label.
    #[schemars(extend("source" = "paper, III.B: no new label is created"))]
    pub leftovers: Leftovers,
    /// Two components merge if V+ / (V+ + V-) exceeds this. `paper`: 0.5, that is V+ > V-.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    #[schemars(extend("source" = "paper, Algorithm 2; the released code: 0.4"))]
    pub merge_ratio: f64,
    /// Whose row the votes of a merge are added to. `paper`: the query's.
    #[schemars(extend("source" = "paper, Algorithm 2; the released code: into_opener"))]
    pub accumulation: Accumulation,
    /// Merge of instances whose regions overlap on the bird's-eye plane.
    #[schemars(extend("source" = "paper, III.E"))]
    pub birds_eye: Option<BirdsEye>,
    /// Merge of fragments by the size of their class. `paper`: none.
    pub fragments: Option<FragmentMerge>,
    /// Objects without classes as a cut of the tree of merges, in place of the votes and of the two
    /// merges before. `paper`: none.
    pub tree: Option<TreeMerge>,
    /// Instances with fewer pixels become "too small". `paper`: 0, off.
    #[schemars(range(min = 0, max = 1000000), extend("unit" = "pixels", "slider" = [0, 100]))]
    #[schemars(extend("source" = "the released code: 31"))]
    pub min_pixels: usize,
    /// Where shadowed points look for a label.
    pub back_projection: BackProjection,
}

/// How a coordinate becomes a voxel number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Rounding {
    /// floor(x / l).
    Floor,
    /// The nearest integer to x / l, halves away from zero.
    Nearest,
}

/// When a seed's pixel gets its label.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Seeding {
    /// Before the growth begins.
    AtOnce,
    /// When it is popped; until then another component may take it, and every pop writes its own
    /// label again, so that a pixel can change hands.
    AtPop,
}

/// What becomes of object pixels that no seed reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Leftovers {
    /// They stay without a label.
    Unlabelled,
    /// Each connected leftover becomes a component, and an instance, of its own.
    Reseeded,
}

/// Whose row the votes of a merge are added to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Accumulation {
    /// The target's row is added to the row of the query that joins.
    IntoQuery,
    /// The row of a query that joins is added to the opening label's row while that is scanned;
    /// later targets use their own rows.
    IntoOpener,
}

/// Where a shadowed object point looks for the pixel whose label it takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct BackProjection {
    /// Rows to look up and down. `paper`: 2, a 5 x 5 window.
    #[schemars(range(min = 0, max = 1024), extend("unit" = "pixels", "slider" = [0, 16]))]
    #[schemars(extend("source" = "ALGORITHM 6: a 5 x 5 window"))]
    pub rows: usize,
    /// Columns to look left and right. `paper`: 2.
    #[schemars(range(min = 0, max = 16384), extend("unit" = "pixels", "slider" = [0, 128]))]
    #[schemars(extend("source" = "ALGORITHM 6: a 5 x 5 window"))]
    pub columns: usize,
    /// What "nearest" means.
    #[schemars(extend("source" = "ALGORITHM 6: range"))]
    pub nearest: Nearest,
}

/// What the nearest pixel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Nearest {
    /// Least difference in range.
    Range,
    /// Least distance in space.
    Space,
}

impl ClusterParams {
    /// The paper, as ALGORITHM pins it.
    pub fn paper() -> Self {
        ClusterParams {
            voxel: 0.5,
            rounding: Rounding::Floor,
            condition: Condition {
                angle: 10_f64.to_radians(),
                rays: Rays::Measured,
                gate: None,
                nearness: None,
            },
            gap_columns: 1,
            gap_rows: 1,
            same_class_neighbours: false,
            seeding: Seeding::AtOnce,
            leftovers: Leftovers::Unlabelled,
            merge_ratio: 0.5,
            accumulation: Accumulation::IntoQuery,
            birds_eye: Some(BirdsEye {
                region: Region::Box,
                margin: 0.0,
                same_class: true,
                transitive: true,
                grown_pixels_only: false,
            }),
            fragments: None,
            tree: None,
            min_pixels: 0,
            back_projection: BackProjection { rows: 2, columns: 2, nearest: Nearest::Range },
        }
    }

    /// Ours, free to differ from the paper wherever measurement says so.
    pub fn best() -> Self {
        let paper = Self::paper();
        ClusterParams {
            condition: Condition {
                nearness: Some(Nearness { share_of_width: 0.2, at_most: 0.5 }),
                ..paper.condition
            },
            gap_columns: 2,
            gap_rows: 2,
            same_class_neighbours: true,
            leftovers: Leftovers::Reseeded,
            birds_eye: None,
            fragments: Some(FragmentMerge {
                touching_share: 0.17,
                touching: 0.3,
                widest: 1.5,
                bridged: 1.5,
                slack: 1.2,
                perimeter_weight: 0.02,
                excess_weight: 0.1,
                delay: 0.3,
            }),
            tree: Some(TreeMerge::default()),
            back_projection: BackProjection { rows: 8, columns: 64, nearest: Nearest::Space },
            ..paper
        }
    }
}

impl Default for ClusterParams {
    fn default() -> Self {
        Self::best()
    }
}
