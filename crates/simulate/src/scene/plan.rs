//! What a scene consists of.

use super::actor::Actor;
use super::tile::Layer;
use super::trajectory::Trajectory;
use crate::ground::{SideStreets, Strip};

/// A scene before its seed is chosen.
pub(super) struct Plan {
    /// From right to left.
    pub strips: Vec<Strip>,
    pub side_streets: Option<SideStreets>,
    pub layers: Vec<Layer>,
    /// The way of the vehicle that carries the sensor.
    pub ego: Trajectory,
    /// Those who move along ways of their own, for a seed.
    pub actors: fn(u64) -> Vec<Actor>,
}

/// A vehicle with the sensor that drives straight on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ego {
    /// Metres.
    pub y: f64,
    /// Metres per second.
    pub speed: f64,
}

impl Plan {
    /// A scene whose ego vehicle drives straight on and whose others keep to their layers.
    pub fn straight(strips: Vec<Strip>, layers: Vec<Layer>, ego: Ego) -> Self {
        let ego = Trajectory::straight([0.0, ego.y], 0.0, ego.speed);
        Plan { strips, side_streets: None, layers, ego, actors: |_| Vec::new() }
    }
}
