//! Arguments about objects over time.

use clap::Args;

use super::values::{NamedValue, lag, one_of};
use crate::annotate::{EgoMotionSource, TrackMode, TrackOptions};
use crate::parameters::ParameterSet;

const TIME: &str = "Time";

/// How objects are followed over the clouds of a topic.
#[derive(Args)]
pub struct TrackArguments {
    /// Follow objects over time: the field `track` of T/instances, the ids of boxes and all
    /// colours are then those of an object, from its first cloud to its last
    #[arg(long, help_heading = TIME, default_value = "auto", value_parser = one_of(MODES))]
    track: TrackMode,

    #[command(flatten)]
    following: FollowArguments,
}

/// How objects are followed.
#[derive(Args)]
pub struct FollowArguments {
    /// How far to look ahead before the tracks of a cloud are decided, seconds; what is written
    /// waits for as long. 0 decides at once [default: 1]
    #[arg(long, help_heading = TIME, value_name = "SECONDS", value_parser = lag)]
    lag: Option<f64>,

    /// Where the motion of the sensor comes from: `auto` takes it from /tf, odometry, poses or
    /// satellites once these are seen to agree with the clouds, and until then from the clouds;
    /// `tf` from /tf alone; `topic:T` from nav_msgs/Odometry, geometry_msgs/PoseStamped or
    /// sensor_msgs/NavSatFix on T alone; `estimate` from the clouds alone; `none`: the frame of
    /// the clouds stands still
    #[arg(long, help_heading = TIME, value_name = "SOURCE", default_value = "auto")]
    ego_motion: EgoMotionSource,
}

const MODES: &[NamedValue<TrackMode>] = &[
    ("auto", "With preset best, on topics of several clouds", TrackMode::Auto),
    ("on", "With any preset and method, on topics of several clouds", TrackMode::On),
    ("off", "Ids begin anew in every cloud", TrackMode::Off),
];

impl TrackArguments {
    /// With the parameters of the run, of which `--lag` changes one.
    pub fn options(&self, parameters: &ParameterSet) -> TrackOptions {
        TrackOptions { mode: self.track, ..self.following.options(parameters) }
    }
}

impl FollowArguments {
    /// With the parameters of the run, of which `--lag` changes one.
    pub fn options(&self, parameters: &ParameterSet) -> TrackOptions {
        let ego_motion = self.ego_motion.clone();
        let mut options = TrackOptions { ego_motion, ..TrackOptions::default() };
        options = options.with_parameters(parameters);
        options.params.lag_s = self.lag.unwrap_or(options.params.lag_s);
        options
    }
}
