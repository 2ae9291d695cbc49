//! How clouds become images.

use serde::Serialize;

/// How clouds become images. Unset sizes are estimated from the data.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ProjectionParams {
    /// What gives the rows of a cloud that is not organised. Default: the best that the cloud
    /// offers.
    pub rows_from: RowsFrom,
    /// Rows of equal elevation, in place of any beams; an organised cloud stays as it stands.
    /// Default: the beams, where there are any; else as fine as the points lie, or 64 (the paper's)
    /// where few points tell.
    pub rows: Option<usize>,
    /// Columns of the full circle. Default: from the azimuth step between returns of one beam, or
    /// as fine as the points lie where there are no beams; 2048 (the paper's) where few points
    /// tell.
    pub columns: Option<usize>,
    /// Elevation of the image's upper and lower edge in radians, for rows of equal elevation in
    /// place of any beams. Default: the elevations that hold all but 0.2 % of the returns.
    pub field_of_view: Option<(f64, f64)>,
    /// Whether the first and the last column are neighbours.
    pub wrap: Wrap,
}

/// Where the rows of an unorganised cloud come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RowsFrom {
    /// The ring field, else beams found in the data, else equal steps of elevation.
    #[default]
    Best,
    /// Equal steps of elevation, whatever the cloud offers.
    UniformElevation,
}

/// Whether the first and the last column are neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
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
