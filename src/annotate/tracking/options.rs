//! Whether and how objects are followed over time.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::annotate::config::AnnotateConfig;
use divmerge_core::over_time::TrackParams;
use divmerge_core::over_time::ego_motion::{EgoMotionParams, ScanParams};
use divmerge_core::parameters::ParameterSet;

/// Whether and how objects are followed over the clouds of a topic.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TrackOptions {
    /// Whether they are.
    pub mode: TrackMode,
    /// Where the motion of the sensor comes from.
    pub ego_motion: EgoMotionSource,
    /// Parameters of the tracker.
    pub params: TrackParams,
    /// How the motion of the sensor is estimated from the clouds.
    pub estimation: EgoMotionParams,
    /// What is kept of a cloud for that.
    pub registration: ScanParams,
}

/// Whether objects are followed over time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum TrackMode {
    /// With preset `best` and its own method, on topics of several clouds.
    #[default]
    Auto,
    /// On topics of several clouds.
    On,
    /// Not at all.
    Off,
}

/// Where the motion of the sensor comes from.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum EgoMotionSource {
    /// As it is recorded, in transforms, on a topic of odometry or poses or by satellites, once
    /// that is seen to agree with the clouds; else it is estimated from the clouds.
    #[default]
    Auto,
    /// Transforms alone: of the frame of the clouds in `odom`, `map`, `world` or `earth`, else in
    /// the farthest frame that it moves in.
    Transforms,
    /// A topic alone: `nav_msgs/Odometry`, `geometry_msgs/PoseStamped`,
    /// `geometry_msgs/PoseWithCovarianceStamped`, `foxglove.PoseInFrame`, `sensor_msgs/NavSatFix`
    /// or `foxglove.LocationFix`.
    Topic(String),
    /// It is estimated from the clouds.
    Estimate,
    /// There is none: the frame of the clouds stands still.
    None,
}

/// As [`FromStr`] reads it.
impl fmt::Display for EgoMotionSource {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            EgoMotionSource::Auto => out.write_str("auto"),
            EgoMotionSource::Transforms => out.write_str("tf"),
            EgoMotionSource::Topic(topic) => write!(out, "topic:{topic}"),
            EgoMotionSource::Estimate => out.write_str("estimate"),
            EgoMotionSource::None => out.write_str("none"),
        }
    }
}

impl FromStr for EgoMotionSource {
    type Err = String;

    /// `auto`, `tf`, `topic:T`, `estimate` or `none`.
    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.strip_prefix("topic:")) {
            ("auto", _) => Ok(EgoMotionSource::Auto),
            ("tf", _) => Ok(EgoMotionSource::Transforms),
            ("estimate", _) => Ok(EgoMotionSource::Estimate),
            ("none", _) => Ok(EgoMotionSource::None),
            (_, Some(topic)) if !topic.is_empty() => Ok(EgoMotionSource::Topic(topic.to_owned())),
            _ => Err("must be auto, tf, topic:T, estimate or none".to_owned()),
        }
    }
}

impl TrackOptions {
    /// The same with another lag, seconds.
    ///
    /// # Errors
    /// If it is below 0 or above a minute: all that was read waits in memory for as long.
    pub fn with_lag(mut self, seconds: f64) -> Result<Self, String> {
        const LONGEST: f64 = 60.0;
        if !(0.0..=LONGEST).contains(&seconds) {
            return Err(format!("must be in 0..={LONGEST} seconds: what was read waits in memory"));
        }
        self.params.lag_s = seconds;
        Ok(self)
    }

    /// The same with the parameters of a set.
    pub fn with_parameters(self, parameters: &ParameterSet) -> Self {
        TrackOptions {
            params: parameters.tracks,
            estimation: parameters.ego_motion.clone(),
            registration: parameters.registration,
            ..self
        }
    }

    /// Whether the objects of clouds are followed to which this is done.
    pub fn applies_to(&self, config: &AnnotateConfig) -> bool {
        let pipeline = &config.pipeline;
        match self.mode {
            TrackMode::Auto => pipeline.preset == "best" && pipeline.other_method.is_none(),
            TrackMode::On => true,
            TrackMode::Off => false,
        }
    }
}
