//! The released code's condition: the angle between nominal rays, and distance gates (ALGORITHM
//! section 7).

use crate::cluster::params::Gate;

/// beta = atan2(d2 sin alpha, d1 - d2 cos alpha) > theta for ranges d1 >= d2 and a given alpha.
#[inline]
pub fn nominal_angle_exceeds(p: [f64; 3], q: [f64; 3], alpha: f64, theta: f64) -> bool {
    let (p, q) = (norm(p), norm(q));
    let (d1, d2) = (p.max(q), p.min(q));
    (d2 * alpha.sin()).atan2(d1 - d2 * alpha.cos()) > theta
}

/// The condition behind its gates: the angle counts only where two points are near in space and in
/// the image, and points that touch near the sensor belong together whatever the angle.
#[inline]
pub fn gated(
    p: [f64; 3],
    q: [f64; 3],
    apart: usize,
    gate: &Gate,
    angle: impl Fn() -> bool,
) -> bool {
    let distance = norm([p[0] - q[0], p[1] - q[1], p[2] - q[2]]);
    let (p, q) = (norm(p), norm(q));
    let in_reach =
        gate.reach_by_range.iter().all(|&(range, pixels)| p.min(q) <= range || apart <= pixels);
    (distance < gate.farthest && in_reach && angle())
        || (distance < gate.touching && p.max(q) < gate.touching_range)
}

fn norm(a: [f64; 3]) -> f64 {
    (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt()
}
