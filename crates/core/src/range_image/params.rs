//! How clouds become images.

use std::f64::consts::FRAC_PI_2;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How clouds become images. Unset sizes are estimated from the data.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ProjectionParams {
    /// What gives the rows of a cloud that is not organised. Default: the best that the cloud
    /// offers.
    #[schemars(extend("source" = "paper, III: spherical range image"))]
    pub rows_from: RowsFrom,
    /// Rows of equal elevation, in place of any beams; an organised cloud stays as it stands.
    /// Default: the beams, where there are any; else as fine as the points lie, or 64 (the paper's)
    /// where few points tell.
    #[schemars(range(min = 1, max = 1024), extend("unit" = "pixels", "slider" = [16, 128]))]
    #[schemars(extend("source" = "the released code: 64"))]
    pub rows: Option<usize>,
    /// Columns of the full circle. Default: from the azimuth step between returns of one beam, or
    /// as fine as the points lie where there are no beams; 2048 (the paper's) where few points
    /// tell.
    #[schemars(range(min = 1, max = 16384), extend("unit" = "pixels", "slider" = [256, 4096]))]
    #[schemars(extend("source" = "the released code: 2048"))]
    pub columns: Option<usize>,
    /// Elevation of the image's upper and lower edge in radians, for rows of equal elevation in
    /// place of any beams. Default: the elevations that hold all but 0.2 % of the returns.
    #[schemars(extend("unit" = "rad", "slider" = [-FRAC_PI_2, FRAC_PI_2]))]
    #[schemars(extend("source" = "the released code: 3 to -25 degrees"))]
    pub field_of_view: Option<(f64, f64)>,
    /// Whether the first and the last column are neighbours.
    #[schemars(extend("source" = "ALGORITHM 1"))]
    pub wrap: Wrap,
}

/// Where the rows of an unorganised cloud come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RowsFrom {
    /// The ring field, else beams found in the data, else equal steps of elevation.
    #[default]
    Best,
    /// Equal steps of elevation, whatever the cloud offers.
    UniformElevation,
}

/// Whether the first and the last column are neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Wrap {
    /// Always, as ALGORITHM section 1 has it.
    Always,
    /// Never, as in the released C++.
    Never,
    /// Where the columns go all the way round; a sensor with a limited field of view has an edge
    /// there.
    #[default]
    WhereScanCloses,
}
