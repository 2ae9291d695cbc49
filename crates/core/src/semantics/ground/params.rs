//! Parameters of the ground removal.

use std::f64::consts::FRAC_PI_2;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Least height of a sensor over the ground, metres: a cleaning robot's. What a sensor sees at its
/// own height is what it stands among.
pub(super) const CLEARANCE: f32 = 0.08;

/// Parameters of the ground removal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GroundParams {
    /// Steepest ground, radians from the level plane that is found around the sensor. Default 25
    /// degrees: a road of 10 % (6 degrees), the error of that plane, and a grass bank of 14 degrees
    /// (1 in 4).
    #[schemars(range(min = 0.0))]
    #[schemars(extend("exclusiveMaximum" = FRAC_PI_2, "unit" = "rad", "slider" = [0.0, 1.0]))]
    pub max_slope: f64,
    /// Shortest horizontal distance over which a slope is measured, metres; rises over less count
    /// as over this. Default 0.35: with `max_slope` it lets a kerb of 0.16 pass, and range noise of
    /// 0.03 tilts a slope by 7 degrees.
    #[schemars(range(max = 100.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [0.05, 2.0]))]
    pub baseline: f64,
    /// Highest step within ground, metres: a kerb of 0.15 and noise. Default 0.2. Anything steeper
    /// than `wall_slope` that rises more is rejected down to its foot.
    #[schemars(range(min = 0.0, max = 100.0), extend("unit" = "m", "slider" = [0.0, 1.0]))]
    pub step: f64,
    /// Slope of a face from which on it is a wall, radians from the horizontal. Default 45 degrees
    /// (the paper's limit for ground).
    #[schemars(range(min = 0.0))]
    #[schemars(extend("exclusiveMaximum" = FRAC_PI_2, "unit" = "rad", "slider" = [0.1, 1.5]))]
    #[schemars(extend("source" = "Bogoslavskyi and Stachniss 2016: 45 degrees"))]
    pub wall_slope: f64,
    /// Slope by which ground may leave the level between successive rows of a column when it
    /// spreads, radians; added to `step`. Default 5 degrees (the paper's largest change of slope).
    #[schemars(range(min = 0.0))]
    #[schemars(extend("exclusiveMaximum" = FRAC_PI_2, "unit" = "rad", "slider" = [0.0, 0.5]))]
    #[schemars(extend("source" = "Bogoslavskyi and Stachniss 2016: 5 degrees"))]
    pub slope_change: f64,
    /// Largest horizontal distance of the returns that the plane is fitted to and that ground
    /// starts from, metres; at most 64 cells. Default 20: a sensor 3 m up with a lowest beam of -15
    /// degrees meets the ground at 11 m. Where the lowest returns of most columns are more than
    /// half as far away, as those of a sensor on a mast, it is twice their distance, and cells grow
    /// with it.
    #[schemars(range(max = 1000.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [2.0, 60.0]))]
    pub start_distance: f64,
    /// Side of the cells in which the ground is seen from above, metres. Default 1: a 10 % road
    /// rises 0.05 from their centre to their edge.
    #[schemars(range(min = 0.05, max = 100.0), extend("unit" = "m", "slider" = [0.2, 5.0]))]
    pub cell: f64,
    /// How far from the height of the ground around it a return may be ground, metres; more where
    /// that ground is known only in coarser cells (5 % of the cell's side, a 10 % road's rise over
    /// half of it). Default 0.08: twice the noise of 0.03 and the roughness of asphalt or short
    /// grass.
    #[schemars(range(min = 0.0, max = 100.0), extend("unit" = "m", "slider" = [0.0, 0.5]))]
    pub height_band: f64,
}

impl Default for GroundParams {
    fn default() -> Self {
        GroundParams {
            max_slope: 25.0_f64.to_radians(),
            baseline: 0.35,
            step: 0.2,
            wall_slope: 45.0_f64.to_radians(),
            slope_change: 5.0_f64.to_radians(),
            start_distance: 20.0,
            cell: 1.0,
            height_band: 0.08,
        }
    }
}

impl GroundParams {
    /// These parameters for a sensor that sees the ground from so far away on, metres.
    pub(super) fn seen_from_distance(&self, nearest: f64) -> GroundParams {
        /// Ground that starts farther away is not looked for, metres.
        const FARTHEST: f64 = 60.0;
        let reach = 2.0 * nearest.min(FARTHEST);
        if reach <= self.start_distance {
            return self.clone();
        }
        let cell = self.cell * reach / self.start_distance;
        GroundParams { start_distance: reach, cell, ..self.clone() }
    }
}
