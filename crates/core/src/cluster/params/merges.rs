//! Parameters of the merges that follow the votes or take their place.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::cloud::taxonomy::ClassSize;

/// The bird's-eye merge (paper, section III.E).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BirdsEye {
    /// The region that stands for an instance.
    #[schemars(extend("source" = "paper, III.E"))]
    pub region: Region,
    /// Regions count as overlapping up to this far apart, metres (boxes: along each axis).
    #[schemars(range(min = 0.0), extend("unit" = "m", "slider" = [0.0, 2.0]))]
    #[schemars(extend("source" = "the released code: 0.1"))]
    pub margin: f64,
    /// Whether only instances of one class merge. An instance without a class merges with none
    /// then.
    #[schemars(extend("source" = "paper, III.E"))]
    pub same_class: bool,
    /// Whether a chain of overlaps is one instance. Else one pass over all pairs i < j, in which j
    /// takes i's label and the union of their boxes: the last writer wins; region `box` only.
    #[schemars(extend("source" = "ALGORITHM 6"))]
    pub transitive: bool,
    /// Whether the region holds only pixels that the growth added, not the seeds (the released
    /// C++); region `box` only.
    #[schemars(extend("source" = "the released code"))]
    pub grown_pixels_only: bool,
}

/// The region that stands for an instance on the bird's-eye plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Region {
    /// Axis-aligned box.
    Box,
    /// Rectangle of least area.
    Rectangle,
    /// Convex hull.
    Hull,
}

/// The merge of fragments by size ([`assemble`](super::super::assemble)).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FragmentMerge {
    /// Fragments nearer than this share of the class's width touch, and are one, if `touching`
    /// allows. Default 0.17.
    #[schemars(range(min = 0.0, max = 10.0), extend("slider" = [0.0, 1.0]))]
    pub touching_share: f64,
    /// Fragments farther apart than this never count as touching, metres. Default 0.3.
    #[schemars(range(min = 0.0, max = 100.0), extend("unit" = "m", "slider" = [0.0, 2.0]))]
    pub touching: f64,
    /// Fragments that touch are one only if the rectangle around them is no wider than this many
    /// widths of the class: what is wider are two objects side by side. Default 1.5.
    #[schemars(range(min = 0.0, max = 100.0), extend("slider" = [0.5, 5.0]))]
    pub widest: f64,
    /// Gaps are bridged up to this many widths of the class. Default 1.5.
    #[schemars(range(min = 0.0, max = 100.0), extend("slider" = [0.0, 5.0]))]
    pub bridged: f64,
    /// How much larger than usual the rectangle around two touching fragments may be; the allowance
    /// shrinks to nothing at a gap of the class's width, and beyond the rectangle has to be smaller
    /// than usual. Default 1.2.
    #[schemars(range(min = 0.0, max = 100.0), extend("slider" = [0.5, 3.0]))]
    pub slack: f64,
    /// Metres of gap that a metre of the union's perimeter weighs in the order of merging. Default
    /// 0.02.
    #[schemars(range(min = 0.0, max = 100.0), extend("slider" = [0.0, 1.0]))]
    pub perimeter_weight: f64,
    /// Metres of gap that a metre beyond the usual size weighs in the order of merging. Default
    /// 0.1.
    #[schemars(range(min = 0.0, max = 100.0), extend("slider" = [0.0, 1.0]))]
    pub excess_weight: f64,
    /// Metres of gap that a fragment of one pixel waits in the order of merging; one of n pixels
    /// waits an n-th of that. Default 0.3.
    #[schemars(range(min = 0.0, max = 100.0), extend("unit" = "m", "slider" = [0.0, 2.0]))]
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

/// Objects without a class as a cut of the tree of merges ([`tree`](super::super::tree)).
///
/// Defaults were chosen on labelled drives and simulated ones by `examples/06_objects.rs`, by the
/// things found whole first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TreeMerge {
    /// What a metre of height counts in a distance. Default 0.7: objects stand beside one another,
    /// seldom on one another, while windows, shadows of a railing and dark paint cut objects level.
    #[schemars(range(min = 0.0, max = 100.0), extend("slider" = [0.0, 2.0]))]
    pub height_weight: f64,
    /// Pixels up to this far apart are one from the start, metres. Default 0.08: nothing is told
    /// apart below.
    #[schemars(range(min = 0.0, max = 10.0), extend("unit" = "m", "slider" = [0.0, 0.5]))]
    pub nearest: f64,
    /// Pixels farther apart are never linked, metres. Default 2.
    #[schemars(range(max = 100.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [0.2, 5.0]))]
    pub farthest: f64,
    /// How far a window reaches up, down and sideways in which pixels are linked, radians. Default
    /// 0.05: four times `gap`, from where on things are as isolated as can be.
    #[schemars(range(max = 0.5))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "rad", "slider" = [0.01, 0.2]))]
    pub window: f64,
    /// Groups of fewer pixels are absorbed by what they join, and are no instances. Default 5.
    #[schemars(range(min = 1, max = 1000000), extend("unit" = "pixels", "slider" = [1, 50]))]
    pub least_points: usize,
    /// Nodes of fewer pixels are no objects. Default 10.
    #[schemars(range(min = 1, max = 1000000), extend("unit" = "pixels", "slider" = [1, 100]))]
    pub least_scored: usize,
    /// Nodes that are longer are no objects, metres. Default 22: an articulated truck and a bit.
    #[schemars(range(max = 1000.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [1.0, 50.0]))]
    pub longest: f64,
    /// A gap from which on things begin to be isolated, as an angle seen from the sensor, radians.
    /// Default 0.012.
    #[schemars(range(max = 1.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "rad", "slider" = [0.001, 0.05]))]
    pub gap: f64,
    /// The same near the sensor, metres. Default 0.1.
    #[schemars(range(min = 0.0, max = 10.0), extend("unit" = "m", "slider" = [0.0, 0.5]))]
    pub nearest_gap: f64,
    /// What the gaps within a node are at least when those around it are held against them, as an
    /// angle, radians. Default 0.005.
    #[schemars(range(min = 0.0, max = 1.0), extend("unit" = "rad", "slider" = [0.0, 0.02]))]
    pub least_gap: f64,
    /// How much a node loses that fills the whole box of what it joins, 0 to 1. Default 0.2.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub wholeness: f64,
    /// How much a node loses of whose face nothing is seen, 0 to 1. Default 0.4.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub filled: f64,
    /// Nodes of a lower score are no objects. Default 0.2.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub least_score: f64,
    /// Power of a score that is summed up. Default 1.5: a plain sum prefers two halves to a whole.
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0, "slider" = [0.5, 3.0]))]
    pub power: f64,
    /// What is no object is put together across gaps up to this, metres. Default 1.
    #[schemars(range(min = 0.0, max = 100.0), extend("unit" = "m", "slider" = [0.0, 5.0]))]
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
