//! How a sensor sits on the ego vehicle, and what comes back besides surfaces.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use rand::RngExt;
use rand_pcg::Pcg32;

/// Where a sensor sits over the foot of the ego vehicle and how it is turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    /// Height above the ground in metres.
    pub height: f64,
    /// Metres ahead of the vehicle's foot.
    pub ahead: f64,
    /// Metres to the left of the vehicle's foot.
    pub left: f64,
    /// Turn about the vehicle's z (up) in radians, after pitch and roll: to the left where
    /// positive.
    pub yaw: f64,
    /// Turn about the vehicle's y (left) in radians: the front looks down where positive.
    pub pitch: f64,
    /// Turn about the vehicle's x (ahead) in radians, before the pitch: the left side looks up
    /// where positive; pi hangs the sensor upside down.
    pub roll: f64,
    /// Width of the field of view around straight ahead in radians; 2 pi for all of the turn.
    pub field_of_view: f64,
}

impl Mount {
    /// Level, upright and looking all round.
    pub fn level(height: f64) -> Self {
        Mount {
            height,
            ahead: 0.0,
            left: 0.0,
            yaw: 0.0,
            pitch: 0.0,
            roll: 0.0,
            field_of_view: 2.0 * PI,
        }
    }

    /// The sensor's frame in that of the vehicle's foot.
    pub fn vehicle_from_sensor(&self) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_euler_angles(self.roll, self.pitch, self.yaw);
        Isometry3::from_parts(Translation3::new(self.ahead, self.left, self.height), turn)
    }

    /// Whether the sensor fires at an azimuth (radians, -pi to pi).
    pub(super) fn sees(&self, azimuth: f64) -> bool {
        azimuth.abs() <= 0.5 * self.field_of_view
    }
}

/// Returns that are of no surface, with SemanticKITTI's id of outliers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Clutter {
    /// Share of the beams that a drop of rain would send back, were there no surface before it.
    pub drops: f64,
    /// Share of the returns of the ground that wet ground mirrors: they come back from farther
    /// along the beam, from below the ground.
    pub mirrored: f64,
}

impl Clutter {
    /// Mean range beyond the nearest at which drops are seen, metres.
    const DROP_RANGE: f64 = 6.0;
    /// Length of the way from the mirror to what it shows, metres.
    const DETOUR: std::ops::Range<f64> = 0.5..10.0;

    /// Range of the drop that a beam meets, if it meets one. Draws nothing in dry air.
    pub(super) fn drop(&self, nearest: f64, rng: &mut Pcg32) -> Option<f64> {
        if self.drops == 0.0 || rng.random::<f64>() >= self.drops {
            return None;
        }
        Some(nearest - Self::DROP_RANGE * (1.0 - rng.random::<f64>()).ln())
    }

    /// How much farther a return of the ground seems, if it is mirrored. Draws nothing on dry
    /// ground.
    pub(super) fn detour(&self, rng: &mut Pcg32) -> Option<f64> {
        if self.mirrored == 0.0 || rng.random::<f64>() >= self.mirrored {
            return None;
        }
        Some(rng.random_range(Self::DETOUR))
    }
}
