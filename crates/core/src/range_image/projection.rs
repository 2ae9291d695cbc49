//! Ways from a cloud to an image.

use serde::Serialize;

/// Which projection made an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Projection {
    /// The cloud's own rows and columns.
    Organised,
    /// The cloud's own rows and columns, exchanged: its driver stores a beam per column.
    OrganisedTransposed,
    /// Rows from the ring field, columns from the azimuth.
    Ring,
    /// Rows from the order in which the points are stored, one turn of the azimuth per beam.
    ScanOrder,
    /// Rows from peaks in the distribution of the elevation.
    Elevations,
    /// Rows of equal elevation.
    UniformElevation,
    /// An image for each of several sensors.
    Sources,
}

impl Projection {
    /// A few words for people.
    pub fn describe(self) -> &'static str {
        match self {
            Projection::Organised => "organised cloud",
            Projection::OrganisedTransposed => "organised cloud, one column per beam",
            Projection::Ring => "ring field",
            Projection::ScanOrder => "storage order, one turn per beam",
            Projection::Elevations => "beams found in the elevations",
            Projection::UniformElevation => "equal steps of elevation",
            Projection::Sources => "an image for each sensor",
        }
    }
}
