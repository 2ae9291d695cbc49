//! The slopes along one column of returns, bottom up.

use super::params::GroundParams;
use super::profile::Return;

/// A return that is no ground whatever lies around it.
const NEVER: f32 = f32::INFINITY;

/// By how much noise may part two returns of an upright face along the ground, metres: twice the
/// noise of 0.03. The slope between returns of dense rows, which lie closer together than that,
/// says nothing.
const NOISE: f32 = 0.06;

/// The slopes of one column from `anchor` on, a place known or taken to be ground.
///
/// Each return is measured against the last flat one at least a baseline before it. Faces do not
/// move the anchor, so that whatever lies beyond them is measured against the ground in front of
/// them.
pub(super) fn climb(column: &[Return], anchor: Return, limits: &Limits, slopes: &mut [f32]) {
    let mut anchor = anchor;
    for (up, seen) in column.iter().enumerate().filter(|(_, seen)| seen.exists()) {
        let run = seen.distance - anchor.distance;
        let rise = seen.height - anchor.height;
        slopes[up] = limits.slope(rise, run);
        if slopes[up] > limits.max_slope && rise > limits.step {
            reject_face(column, up, limits.wall_slope, slopes);
        } else if run >= limits.baseline && slopes[up].abs() <= limits.max_slope {
            anchor = *seen;
        }
    }
}

/// Rejects the return `top` and those right under it, down to the foot of the face that they are
/// on.
fn reject_face(column: &[Return], top: usize, wall_slope: f32, slopes: &mut [f32]) {
    slopes[top] = NEVER;
    let head = column[top];
    for under in (0..top).rev().filter(|&under| column[under].exists()) {
        let run = (head.distance - column[under].distance).abs();
        let is_face = run < NOISE || head.height - column[under].height > wall_slope * run;
        if !is_face || slopes[under] == NEVER {
            break;
        }
        slopes[under] = NEVER;
    }
}

/// The parameters as tangents and in the cloud's precision.
#[derive(Debug)]
pub(super) struct Limits {
    /// Steepest ground, rise over run.
    pub max_slope: f32,
    wall_slope: f32,
    baseline: f32,
    step: f32,
}

impl Limits {
    /// The limits that `params` set.
    pub fn new(params: &GroundParams) -> Self {
        Limits {
            max_slope: params.max_slope.tan() as f32,
            wall_slope: params.wall_slope.tan() as f32,
            baseline: params.baseline as f32,
            step: params.step as f32,
        }
    }

    /// Rise over run, never less run than the baseline: what stands or hangs in front of the anchor
    /// is steep as well.
    fn slope(&self, rise: f32, run: f32) -> f32 {
        rise / run.max(self.baseline)
    }
}
