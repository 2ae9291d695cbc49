//! Whether and how objects are followed over time.

use serde::{Deserialize, Serialize};

use crate::annotate::config::AnnotateConfig;
use divmerge_core::over_time::TrackParams;

/// Whether and how objects are followed over the clouds of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct TrackOptions {
    /// Whether they are.
    pub mode: TrackMode,
    /// Where the motion of the sensor comes from.
    pub ego_motion: EgoMotionSource,
    /// Parameters of the tracker.
    pub params: TrackParams,
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum EgoMotionSource {
    /// It is estimated from the clouds.
    #[default]
    Estimate,
    /// There is none: the frame of the clouds stands still.
    None,
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
