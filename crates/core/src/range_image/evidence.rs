//! How it is known where a sensor stands.

use serde::Serialize;

/// How it is known where a sensor stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Evidence {
    /// It is taken to stand at the origin of the cloud's frame, and nothing speaks against that.
    Origin,
    /// The user says so.
    Given,
    /// The beams are cones around that point.
    Beams,
    /// The recording's transforms say so, and nothing in the points does.
    Recorded,
    /// Nothing says where it stands. The image is that of an assumed place, from which ranges are
    /// measured too; objects without classes and the ground are found in space.
    Assumed,
}
