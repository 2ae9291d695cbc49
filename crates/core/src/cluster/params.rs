//! Every parameter of the clustering, and the three presets as values of it.

use serde::Serialize;

use crate::cloud::taxonomy::ClassSize;

/// Parameters of the divide step, the merge step and what follows. The presets are values of this
/// one struct; none has code of its own.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClusterParams {
    /// Side of a voxel in metres (the paper's l). Default 0.5.
    pub voxel: f64,
    /// How coordinates become voxels. `paper`: floor.
    pub rounding: Rounding,
    /// When two neighbouring pixels belong together.
    pub condition: Condition,
    /// Most columns to a neighbour. `paper`: 1.
    pub gap_columns: usize,
    /// Most rows to a neighbour. `paper`: 1.
    pub gap_rows: usize,
    /// Whether only pixels of one class are neighbours. `paper`: no.
    pub same_class_neighbours: bool,
    /// When a seed's pixel gets its label. `paper`: at once.
    pub seeding: Seeding,
    /// What becomes of object pixels that no seed reaches. `paper`: they stay without a label.
    pub leftovers: Leftovers,
    /// Two components merge if V+ / (V+ + V-) exceeds this. `paper`: 0.5, that is V+ > V-.
    pub merge_ratio: f64,
    /// Whose row the votes of a merge are added to. `paper`: the query's.
    pub accumulation: Accumulation,
    /// Merge of instances whose regions overlap on the bird's-eye plane.
    pub birds_eye: Option<BirdsEye>,
    /// Merge of fragments by the size of their class. `paper`: none.
    pub fragments: Option<FragmentMerge>,
    /// Objects without classes as a cut of the tree of merges, in place of the votes and of the two
    /// merges before. `paper`: none.
    pub tree: Option<TreeMerge>,
    /// Instances with fewer pixels become "too small". `paper`: 0, off.
    pub min_pixels: usize,
    /// Where shadowed points look for a label.
    pub back_projection: BackProjection,
}

/// How a coordinate becomes a voxel number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rounding {
    /// floor(x / l).
    Floor,
    /// The nearest integer to x / l, halves away from zero.
    Nearest,
}

/// When two neighbouring pixels belong together: the angle condition of Bogoslavskyi and Stachniss
/// (2016), beta > theta, and optional distance gates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Condition {
    /// theta in radians. `paper`: 10 degrees.
    pub angle: f64,
    /// Where the angle between the two rays comes from.
    pub rays: Rays,
    /// Distance gates. `paper`: none.
    pub gate: Option<Gate>,
    /// In place of the angle, for classes of known size: nearness on the bird's-eye plane. `paper`:
    /// none.
    pub nearness: Option<Nearness>,
}

/// Two neighbouring pixels of one class belong together if they are near on the bird's-eye plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Nearness {
    /// Nearer than this share of the class's width ...
    pub share_of_width: f64,
    /// ... and than this, metres.
    pub at_most: f64,
}

/// Where the angle between two rays comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rays {
    /// From the two points themselves: |p x q| > tan(theta) (p.p - p.q), p the farther.
    Measured,
    /// From the distance in pixels: 2 pi / W per column, `row_step` radians per row.
    Nominal {
        /// Elevation between two rows in radians.
        row_step: f64,
    },
}

/// Distance gates on the condition (the released C++).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gate {
    /// The angle counts only for points nearer to each other than this, metres.
    pub farthest: f64,
    /// Points nearer to each other than this belong together whatever the angle, metres ...
    pub touching: f64,
    /// ... if both ranges are below this, metres.
    pub touching_range: f64,
    /// (range, pixels): where the nearer range exceeds `range` metres, the angle counts only up to
    /// so many pixels apart.
    pub reach_by_range: Vec<(f64, usize)>,
}

/// When a seed's pixel gets its label.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Seeding {
    /// Before the growth begins.
    AtOnce,
    /// When it is popped; until then another component may take it, and every pop writes its own
    /// label again, so that a pixel can change hands.
    AtPop,
}

/// What becomes of object pixels that no seed reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Leftovers {
    /// They stay without a label.
    Unlabelled,
    /// Each connected leftover becomes a component, and an instance, of its own.
    Reseeded,
}

/// Whose row the votes of a merge are added to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Accumulation {
    /// The target's row is added to the row of the query that joins.
    IntoQuery,
    /// The row of a query that joins is added to the opening label's row while that is scanned;
    /// later targets use their own rows.
    IntoOpener,
}

/// The bird's-eye merge (paper, section III.E).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BirdsEye {
    /// The region that stands for an instance.
    pub region: Region,
    /// Regions count as overlapping up to this far apart, metres (boxes: along each axis).
    pub margin: f64,
    /// Whether only instances of one class merge. An instance without a class merges with none
    /// then.
    pub same_class: bool,
    /// Whether a chain of overlaps is one instance. Else one pass over all pairs i < j, in which j
    /// takes i's label and the union of their boxes: the last writer wins; [`Region::Box`] only.
    pub transitive: bool,
    /// Whether the region holds only pixels that the growth added, not the seeds (the released
    /// C++); [`Region::Box`] only.
    pub grown_pixels_only: bool,
}

/// The region that stands for an instance on the bird's-eye plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Region {
    /// Axis-aligned box.
    Box,
    /// Rectangle of least area.
    Rectangle,
    /// Convex hull.
    Hull,
}

/// The merge of fragments by size ([`assemble`](super::assemble)). W is the class's width.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FragmentMerge {
    /// Fragments nearer than this share of W are one ...
    pub touching_share: f64,
    /// ... but never farther apart than this, metres.
    pub touching: f64,
    /// Fragments that touch are one only if the rectangle around them is no wider than this many W:
    /// what is wider are two objects side by side.
    pub widest: f64,
    /// Gaps are bridged up to this many W.
    pub bridged: f64,
    /// How much larger than usual the rectangle around two touching fragments may be; the allowance
    /// shrinks to nothing at a gap of W, and beyond the rectangle has to be smaller than usual.
    pub slack: f64,
    /// Metres of gap that a metre of the union's perimeter weighs in the order of merging.
    pub perimeter_weight: f64,
    /// Metres of gap that a metre beyond the usual size weighs in the order of merging.
    pub excess_weight: f64,
    /// Metres of gap that a fragment of one pixel waits in the order of merging; one of n pixels
    /// waits an n-th of that.
    #[serde(rename = "wait")]
    pub delay: f64,
}

impl FragmentMerge {
    /// Up to this far apart, metres, fragments of a class of that size are one.
    pub fn touching_gap(&self, size: ClassSize) -> f64 {
        (self.touching_share * size.width).min(self.touching)
    }

    /// How far apart, metres, fragments of a class of that size may be to be one.
    pub fn bridged_gap(&self, size: ClassSize) -> f64 {
        self.bridged * size.width
    }

    /// The widest rectangle, metres, around fragments that touch.
    pub fn widest(&self, size: ClassSize) -> f64 {
        self.widest * size.width
    }

    /// The longest sides, metres, of a rectangle that may be one object across a gap in metres.
    pub fn longest_sides(&self, size: ClassSize, gap: f64) -> [f64; 2] {
        let scale = self.slack - (self.slack - 1.0) * gap / size.width;
        [size.length * scale, size.width * scale]
    }
}

/// Objects without a class as a cut of the tree of merges ([`tree`](super::tree)).
///
/// Defaults were chosen on labelled drives and simulated ones by `examples/06_objects.rs`, by the
/// things found whole first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TreeMerge {
    /// What a metre of height counts in a distance. Default 0.7: objects stand beside one another,
    /// seldom on one another, while windows, shadows of a railing and dark paint cut objects level.
    pub height_weight: f64,
    /// Pixels up to this far apart are one from the start, metres. Default 0.08: nothing is told
    /// apart below.
    pub nearest: f64,
    /// Pixels farther apart are never linked, metres. Default 2.
    pub farthest: f64,
    /// How far a window reaches up, down and sideways in which pixels are linked, radians. Default
    /// 0.05: four times [`Self::gap`], from where on things are as isolated as can be.
    pub window: f64,
    /// Groups of fewer pixels are absorbed by what they join, and are no instances. Default 5.
    pub least_points: usize,
    /// Nodes of fewer pixels are no objects. Default 10.
    pub least_scored: usize,
    /// Nodes that are longer are no objects, metres. Default 22: an articulated truck and a bit.
    pub longest: f64,
    /// A gap from which on things begin to be isolated, as an angle seen from the sensor, radians.
    /// Default 0.012.
    pub gap: f64,
    /// The same near the sensor, metres. Default 0.1.
    pub nearest_gap: f64,
    /// What the gaps within a node are at least when those around it are held against them, as an
    /// angle, radians. Default 0.005.
    pub least_gap: f64,
    /// How much a node loses that fills the whole box of what it joins, 0 to 1. Default 0.2.
    pub wholeness: f64,
    /// How much a node loses of whose face nothing is seen, 0 to 1. Default 0.4.
    pub filled: f64,
    /// Nodes of a lower score are no objects. Default 0.2.
    pub least_score: f64,
    /// Power of a score that is summed up. Default 1.5: a plain sum prefers two halves to a whole.
    pub power: f64,
    /// What is no object is put together across gaps up to this, metres. Default 1.
    pub background: f64,
}

impl Default for TreeMerge {
    fn default() -> Self {
        TreeMerge {
            height_weight: 0.7,
            nearest: 0.08,
            farthest: 2.0,
            window: 0.05,
            least_points: 5,
            least_scored: 10,
            longest: 22.0,
            gap: 0.012,
            nearest_gap: 0.1,
            least_gap: 0.005,
            wholeness: 0.2,
            filled: 0.4,
            least_score: 0.2,
            power: 1.5,
            background: 1.0,
        }
    }
}

/// Where a shadowed object point looks for the pixel whose label it takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct BackProjection {
    /// Rows to look up and down. `paper`: 2, a 5 x 5 window.
    pub rows: usize,
    /// Columns to look left and right. `paper`: 2.
    pub columns: usize,
    /// What "nearest" means.
    pub nearest: Nearest,
}

/// What the nearest pixel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
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
