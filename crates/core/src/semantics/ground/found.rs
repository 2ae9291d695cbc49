//! What the ground removal finds.

/// The ground among N points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ground {
    /// N: whether each point is ground.
    pub is_ground: Vec<bool>,
    /// N: how likely that is, 0 to 1: at least one half where it is ground, less where it is not, 0
    /// where there is no return.
    pub confidence: Vec<f32>,
    /// Whether it lies above the sensor, as where z points down.
    pub is_overhead: bool,
    /// Whether there is none around the sensor.
    pub is_missing: bool,
}

impl Ground {
    /// That of N points none is ground.
    pub(super) fn missing(points: usize) -> Self {
        let (is_ground, confidence) = (vec![false; points], vec![0.0; points]);
        Ground { is_ground, confidence, is_overhead: false, is_missing: true }
    }

    pub(super) fn from_confidence(confidence: Vec<f32>, is_overhead: bool) -> Self {
        let is_ground = confidence.iter().map(|&share| is_ground(share)).collect();
        Ground { is_ground, confidence, is_overhead, is_missing: false }
    }
}

/// Whether a point of so much confidence is ground.
pub(super) fn is_ground(confidence: f32) -> bool {
    confidence >= 0.5
}

/// How the ground around a sensor lies in the cloud's frame.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct GroundPose {
    /// Angle between its normal and the vertical of the frame, degrees.
    pub lean_degrees: f64,
    /// Whether it lies above the sensor.
    pub is_overhead: bool,
}
