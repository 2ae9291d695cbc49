//! Parameters of the tracker.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Parameters of a [`Tracker`](super::Tracker).
///
/// All but the first two were chosen on simulated drives (`examples/14_tracks` scores some).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrackParams {
    /// How far the tracker looks ahead before it decides, seconds. 0: not at all. Default 1.
    #[schemars(range(min = 0.0, max = 60.0), extend("unit" = "s", "slider" = [0.0, 5.0]))]
    pub lag_s: f64,
    /// How long an object may be out of sight and keep its track, seconds. Default 3: two and a
    /// half behind another one, and the time in which it is seen too little on both sides.
    #[schemars(range(min = 0.0, max = 600.0), extend("unit" = "s", "slider" = [0.0, 10.0]))]
    pub gap_s: f64,
    /// Least affinity of a track and an instance, 0 to 1. Default 0.2.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub least_affinity: f64,
    /// Share of the distance in the affinity; the rest is the overlap. Default 0.5.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub distance_weight: f64,
    /// Error of the place of an instance, metres; to it comes a tenth of its length, for faces that
    /// come into sight and go. Default 0.3.
    #[schemars(range(max = 100.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [0.05, 2.0]))]
    pub place_error: f64,
    /// Error of a measured displacement, metres. Default 0.15.
    #[schemars(range(max = 100.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [0.05, 2.0]))]
    pub displacement_error: f64,
    /// Affinity of a track that was last seen a second ago, as a share. Default 0.9: how uncertain
    /// its place has become is counted already.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub kept_after_second: f64,
    /// Affinity of a track and an instance of another class, as a share; its root where bodies are
    /// told by shape alone. Default 0.3.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub other_class: f64,
    /// Affinity of a track of one or two frames, as a share. Default 0.7.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub young: f64,
    /// Least likelihood with which a track that begins continues one that ended. Default 0.1.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub least_continuation: f64,
    /// Least share of an instance's cells that another track takes with the whole of it. Default
    /// 0.7.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub whole_share: f64,
    /// Least share of a track's usual cells that are cut out of another's instance. Default 0.3.
    #[schemars(range(min = 0.0, max = 1.0), extend("slider" = [0.0, 1.0]))]
    pub part_share: f64,
}

impl Default for TrackParams {
    fn default() -> Self {
        TrackParams {
            lag_s: 1.0,
            gap_s: 3.0,
            least_affinity: 0.2,
            distance_weight: 0.5,
            place_error: 0.3,
            displacement_error: 0.15,
            kept_after_second: 0.9,
            other_class: 0.3,
            young: 0.7,
            least_continuation: 0.1,
            whole_share: 0.7,
            part_share: 0.3,
        }
    }
}
