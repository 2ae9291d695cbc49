//! Pairs of neighbouring pixels, and the angle beta that decided on each (ALGORITHM section 3).

use serde::Serialize;

use super::places::{Place, distance, place_of_object};
use super::subject::ClusteredCloud;
use divmerge_core::cluster::NeighbourCondition;
use divmerge_core::cluster::params::Rays;
use divmerge_core::range_image::NO_NEIGHBOUR;

/// A pair of neighbouring object pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BorderPair {
    /// One pixel ...
    pub a: Place,
    /// ... its component, or 0 ...
    pub component_a: u32,
    /// ... and the other ...
    pub b: Place,
    /// ... with its component, or 0.
    pub component_b: u32,
    /// Pixels from one to the other, along a row or a column.
    pub pixels_apart: usize,
    /// Whether they are in one row; else in one column.
    pub in_one_row: bool,
    /// Distance in metres.
    pub distance: f64,
    /// The angle beta, degrees.
    pub beta_degrees: f64,
    /// Whether the condition holds: a vote in favour, if the components differ.
    pub holds: bool,
    /// What the condition went by.
    pub rule: Rule,
}

/// What the condition of a pair of pixels went by.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "by", rename_all = "snake_case")]
pub enum Rule {
    /// beta > theta.
    Angle,
    /// Distance gates, which decided otherwise than the angle (preset `authors`).
    Gate,
    /// Nearness on the bird's-eye plane, the size of their class being known (preset `best`).
    Nearness {
        /// Distance on the plane, metres.
        distance: f64,
        /// They belong together if it is less than this, metres.
        reach: f64,
    },
}

impl BorderPair {
    /// How far the pair is from the other verdict, as a share of the threshold.
    fn margin(&self, theta_degrees: f64) -> f64 {
        match self.rule {
            Rule::Nearness { distance, reach } => (distance / reach - 1.0).abs(),
            _ => (self.beta_degrees / theta_degrees - 1.0).abs(),
        }
    }
}

/// The pair of an object pixel and its neighbour in a direction, which must be there.
pub(super) fn pair(frame: &ClusteredCloud, from: usize, direction: usize) -> BorderPair {
    let stages = frame.stages;
    let objects = &stages.objects;
    let to = objects.neighbours[from][direction] as usize;
    let [a, b] = [from, to].map(|object| place_of_object(stages, object));
    let in_one_row = direction < 2;
    let columns = stages.image.columns();
    let pixels_apart = match direction {
        0 => (a.column + columns - b.column - 1) % columns + 1,
        1 => (b.column + columns - a.column - 1) % columns + 1,
        _ => a.row.abs_diff(b.row),
    };
    let band = stages.image.band_of(stages.objects.pixel[from] as usize);
    let [p, q] = [a, b].map(|place| band.from_sensor(place.position.map(f64::from)));
    let condition = &frame.config.cluster.condition;
    let beta = match condition.rays {
        Rays::Measured => measured_beta(p, q),
        Rays::Nominal { row_step } => {
            let step = if in_one_row { band.column_step } else { row_step };
            nominal_beta(p, q, pixels_apart as f64 * step)
        }
    };
    let (image, sizes, params) = (&stages.image, &stages.mask.sizes, &frame.config.cluster);
    let holds = NeighbourCondition::new(objects, image, sizes, params).holds(from, direction);
    BorderPair {
        a,
        component_a: stages.components.label[from],
        b,
        component_b: stages.components.label[to],
        pixels_apart,
        in_one_row,
        distance: distance(p, q),
        beta_degrees: beta.to_degrees(),
        holds,
        rule: nearness(frame, from, to, direction).unwrap_or({
            let is_gated = condition.gate.is_some() && (beta > condition.angle) != holds;
            if is_gated { Rule::Gate } else { Rule::Angle }
        }),
    }
}

/// The rule of nearness, if it is in force: by the size of the class where that is known, the left
/// or upper pixel's.
fn nearness(frame: &ClusteredCloud, from: usize, to: usize, direction: usize) -> Option<Rule> {
    let ClusteredCloud { stages, config, .. } = frame;
    let first = if direction % 2 == 1 { from } else { to };
    let size = stages.mask.sizes[usize::from(stages.objects.class[first])]?;
    let nearness = config.cluster.condition.nearness?;
    let [p, q] = [from, to].map(|object| stages.objects.position[object].map(f64::from));
    Some(Rule::Nearness {
        distance: (p[0] - q[0]).hypot(p[1] - q[1]),
        reach: (nearness.share_of_width * size.width).min(nearness.at_most),
    })
}

/// All pairs with one pixel in a component that `is_left` accepts and the other in one that
/// `is_right` accepts, those nearest to the other verdict first.
pub(super) fn border(
    frame: &ClusteredCloud,
    is_left: impl Fn(u32) -> bool,
    is_right: impl Fn(u32) -> bool,
) -> Vec<BorderPair> {
    const FORWARD: [usize; 2] = [1, 3];
    let (objects, label) = (&frame.stages.objects, &frame.stages.components.label);
    let mut pairs = Vec::new();
    for from in 0..objects.len() {
        for direction in FORWARD {
            let to = objects.neighbours[from][direction];
            if to == NO_NEIGHBOUR {
                continue;
            }
            let (one, other) = (label[from], label[to as usize]);
            if one == other || one == 0 || other == 0 {
                continue;
            }
            if (is_left(one) && is_right(other)) || (is_left(other) && is_right(one)) {
                pairs.push(pair(frame, from, direction));
            }
        }
    }
    let theta = frame.config.cluster.condition.angle.to_degrees();
    pairs.sort_by(|a, b| a.margin(theta).total_cmp(&b.margin(theta)));
    pairs
}

/// beta = atan2(|p x q|, p.p - p.q) in radians, p the farther point.
fn measured_beta(p: [f64; 3], q: [f64; 3]) -> f64 {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cross = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    dot(cross, cross).sqrt().atan2(dot(p, p).max(dot(q, q)) - dot(p, q))
}

/// beta = atan2(d2 sin alpha, d1 - d2 cos alpha) in radians, d1 the longer range.
fn nominal_beta(p: [f64; 3], q: [f64; 3], alpha: f64) -> f64 {
    let (p, q) = (distance(p, [0.0; 3]), distance(q, [0.0; 3]));
    let (d1, d2) = (p.max(q), p.min(q));
    (d2 * alpha.sin()).atan2(d1 - d2 * alpha.cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beta_by_hand() {
        // 10 m and 10.1 m, 0.2 degrees apart: 19.2 degrees; 10 m and 10.3 m: 6.6 degrees.
        let (sin, cos) = 0.2_f64.to_radians().sin_cos();
        for (range, degrees) in [(10.1, 19.2), (10.3, 6.6)] {
            let (p, q) = ([range, 0.0, 0.0], [10.0 * cos, 10.0 * sin, 0.0]);
            for beta in [measured_beta(p, q), measured_beta(q, p)] {
                assert!((beta.to_degrees() - degrees).abs() < 0.05, "{}", beta.to_degrees());
            }
            let nominal = nominal_beta(p, q, 0.2_f64.to_radians());
            assert!((nominal - measured_beta(p, q)).abs() < 1e-9);
        }
    }
}
