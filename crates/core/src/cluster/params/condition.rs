//! Parameters of the condition on two neighbouring pixels.

use std::f64::consts::FRAC_PI_2;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// When two neighbouring pixels belong together: the angle condition of Bogoslavskyi and Stachniss
/// (2016), beta > theta, and optional distance gates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Condition {
    /// Least angle beta between neighbours of one object (theta), radians. `paper`: 10 degrees.
    #[schemars(range(min = 0.0))]
    #[schemars(extend("exclusiveMaximum" = FRAC_PI_2, "unit" = "rad", "slider" = [0.0, 0.7]))]
    #[schemars(extend("source" = "paper, Figure 2: theta; Bogoslavskyi and Stachniss 2016"))]
    pub angle: f64,
    /// Where the angle between the two rays comes from.
    #[schemars(extend("source" = "ALGORITHM 3"))]
    pub rays: Rays,
    /// Distance gates. `paper`: none.
    #[schemars(extend("source" = "the released code"))]
    pub gate: Option<Gate>,
    /// In place of the angle, for classes of known size: nearness on the bird's-eye plane. `paper`:
    /// none.
    pub nearness: Option<Nearness>,
}

/// Two neighbouring pixels of one class belong together if they are near on the bird's-eye plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Nearness {
    /// How near they have to be, as a share of the class's width. Default 0.2.
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0, "slider" = [0.02, 2.0]))]
    pub share_of_width: f64,
    /// How near they have to be whatever the class, metres. Default 0.5.
    #[schemars(range(max = 100.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [0.05, 3.0]))]
    pub at_most: f64,
}

/// Where the angle between two rays comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Rays {
    /// From the two points themselves: |p x q| > tan(theta) (p.p - p.q), p the farther.
    Measured,
    /// From the distance in pixels: 2 pi / W per column, `row_step` radians per row.
    Nominal {
        /// Elevation between two rows in radians.
        #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = FRAC_PI_2))]
        #[schemars(extend("unit" = "rad", "slider" = [0.001, 0.05]))]
        #[schemars(extend("source" = "the released code: 28 degrees / 64"))]
        row_step: f64,
    },
}

/// Distance gates on the condition (the released C++).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Gate {
    /// The angle counts only for points nearer to each other than this, metres. `authors`: 1.5.
    #[schemars(range(min = 0.0), extend("unit" = "m", "slider" = [0.0, 5.0]))]
    #[schemars(extend("source" = "the released code"))]
    pub farthest: f64,
    /// Points nearer to each other than this belong together whatever the angle, if both ranges are
    /// below `touching_range`, metres. `authors`: 0.5.
    #[schemars(range(min = 0.0), extend("unit" = "m", "slider" = [0.0, 3.0]))]
    #[schemars(extend("source" = "the released code"))]
    pub touching: f64,
    /// Range up to which points belong together that are nearer than `touching`, metres. `authors`:
    /// 5.
    #[schemars(range(min = 0.0), extend("unit" = "m", "slider" = [0.0, 50.0]))]
    #[schemars(extend("source" = "the released code"))]
    pub touching_range: f64,
    /// (range, pixels): where the nearer range exceeds `range` metres, the angle counts only up to
    /// so many pixels apart.
    #[schemars(extend("unit" = "m, pixels"))]
    #[schemars(extend("source" = "the released code"))]
    pub reach_by_range: Vec<(f64, usize)>,
}
