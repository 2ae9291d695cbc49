//! Every parameter of a run, and the presets.

use std::sync::Arc;

use serde::{Serialize, Serializer};

use super::segment_vote::SegmentVote;
use super::vehicle_strips::VehicleStrips;
use crate::cluster::{ClusterParams, Method};
use crate::range_image::{ProjectionParams, RowsFrom, Wrap};
use crate::semantics::{GroundBleed, Smoothing};

/// Every parameter of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Config {
    /// Name of the preset these parameters started from.
    pub preset: &'static str,
    /// From cloud to range image.
    pub projection: ProjectionParams,
    /// How given classes are corrected by those around them; `None`: taken as they are.
    pub smoothing: Option<Smoothing>,
    /// How the ground is taken out of objects whose classes a network found; `None`: not at all.
    pub bleed: Option<GroundBleed>,
    /// How segments decide on the classes of their points where a network's bleed; `None`: not at
    /// all.
    pub segment_vote: Option<SegmentVote>,
    /// Which long, low strips are no vehicles where a network's classes bleed; `None`: all are.
    pub vehicle_strips: Option<VehicleStrips>,
    /// Divide, merge and what follows.
    pub cluster: ClusterParams,
    /// Another method in place of ours. Projection, mask, back-projection and minimum size stay.
    #[serde(rename = "baseline", serialize_with = "name_and_parameters")]
    pub other_method: Option<Arc<dyn Method>>,
}

impl Config {
    /// Preset `paper`: ALGORITHM to the letter.
    pub fn paper() -> Self {
        Config {
            preset: "paper",
            projection: ProjectionParams { wrap: Wrap::Always, ..ProjectionParams::default() },
            smoothing: None,
            bleed: None,
            segment_vote: None,
            vehicle_strips: None,
            cluster: ClusterParams::paper(),
            other_method: None,
        }
    }

    /// Preset `authors`: what the released C++ does, less its memory errors. Clouds that are not
    /// organised become its 64 x 2048 image of +3 to -25 degrees.
    pub fn authors() -> Self {
        Config {
            preset: "authors",
            projection: ProjectionParams {
                rows_from: RowsFrom::UniformElevation,
                rows: Some(64),
                columns: Some(2048),
                field_of_view: Some((3_f64.to_radians(), -25_f64.to_radians())),
                wrap: Wrap::Never,
            },
            smoothing: None,
            bleed: None,
            segment_vote: None,
            vehicle_strips: None,
            cluster: ClusterParams::authors(),
            other_method: None,
        }
    }

    /// Name of the method that cuts objects into instances, as at the command line.
    pub fn method_name(&self) -> &'static str {
        self.other_method.as_ref().map_or("divide-and-merge", |other| other.name())
    }

    /// The parameters in a few words, as in `preset best` or `euclidean in place of divide and
    /// merge, preset best`.
    pub fn describe(&self) -> String {
        match &self.other_method {
            None => format!("preset {}", self.preset),
            Some(other) => {
                format!("{} in place of divide and merge, preset {}", other.name(), self.preset)
            }
        }
    }

    /// Preset `best`: ours, the default.
    pub fn best() -> Self {
        Config {
            preset: "best",
            projection: ProjectionParams::default(),
            smoothing: Some(Smoothing::default()),
            bleed: Some(GroundBleed::default()),
            segment_vote: Some(SegmentVote::default()),
            vehicle_strips: Some(VehicleStrips::default()),
            cluster: ClusterParams::best(),
            other_method: None,
        }
    }
}

impl Default for Config {
    fn default() -> Self {
        Self::best()
    }
}

/// Another method as a map from its name to its parameters.
fn name_and_parameters<S: Serializer>(
    method: &Option<Arc<dyn Method>>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let entry = method.as_ref().map(|other| [(other.name(), other.parameters())]);
    entry.map(std::collections::BTreeMap::from).serialize(serializer)
}
