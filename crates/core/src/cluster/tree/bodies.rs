//! The bodies that objects have, and the sizes at which they are seen.
//!
//! Sizes are of what is seen, so that they begin below those of the whole: a car from behind shows
//! 1.8 m by a few centimetres. Upper ends are those of whole bodies:
//!
//! - person: adults are 1.5 to 1.9 m tall (5th percentile of women to 95th of men, DIN 33402-2),
//!   children from 1.0 m; shoulders are 0.5 m wide, a stride 0.8 m long;
//! - two-wheeler: bicycles are up to 2.0 m long and 0.7 m wide, motorcycles 2.3 m and 1.0 m; with a
//!   rider 1.9 m high;
//! - car: 2.7 m (a microcar) to 5.2 m (a limousine) long, 1.5 to 2.0 m wide, 1.3 to 2.0 m high;
//!   vans to 6 m long and 2.6 m high;
//! - large vehicle: up to 2.6 m wide, 4.0 m high and 18.75 m long (Directive 96/53/EC).

use super::measures::NodeMeasures;

pub use crate::cloud::Body;

/// Rises from 0 to 1 between the first two values, stays at 1, and falls to 0 between the last two.
pub(super) type Trapezoid = [f64; 4];

/// What is known of a body before a cloud is seen.
pub(super) struct Prior {
    pub body: Body,
    /// How common it is: among what fits several bodies the rarer one counts less.
    pub frequency: f64,
    /// Longer side on the plane, metres.
    length: Trapezoid,
    /// Shorter side, metres.
    width: Trapezoid,
    height: Trapezoid,
    /// Height of its top above the ground, metres.
    top: Trapezoid,
    /// Exponent of isolation: people stand in groups.
    pub isolation: f64,
    /// How much isolation against the gaps within counts: in a group people are nearer to one
    /// another than things usually are, but not as near as their own points. Parts of a car are,
    /// too, so that it counts for people alone.
    pub by_gaps: f64,
}

pub(super) const BODIES: [Prior; 4] = [
    Prior {
        body: Body::Person,
        frequency: 1.0,
        length: [0.15, 0.3, 1.0, 1.4],
        width: [0.0, 0.1, 0.8, 1.1],
        height: [0.5, 1.0, 2.0, 2.3],
        top: [0.9, 1.3, 2.0, 2.3],
        isolation: 0.6,
        by_gaps: 0.5,
    },
    Prior {
        body: Body::TwoWheeler,
        frequency: 0.8,
        length: [0.8, 1.3, 2.1, 2.6],
        width: [0.0, 0.1, 0.9, 1.2],
        height: [0.4, 0.8, 1.9, 2.2],
        top: [0.6, 0.9, 2.0, 2.3],
        isolation: 0.6,
        by_gaps: 0.5,
    },
    Prior {
        body: Body::Car,
        frequency: 1.0,
        length: [0.9, 1.6, 5.2, 6.2],
        width: [0.0, 0.1, 2.2, 2.7],
        height: [0.4, 0.8, 2.2, 2.8],
        top: [0.9, 1.2, 2.2, 2.9],
        isolation: 1.0,
        by_gaps: 0.0,
    },
    Prior {
        body: Body::LargeVehicle,
        frequency: 1.0,
        length: [1.5, 2.5, 16.0, 20.0],
        width: [0.0, 0.2, 2.8, 3.4],
        height: [1.2, 1.8, 4.0, 4.6],
        top: [1.8, 2.2, 4.0, 4.6],
        isolation: 1.0,
        by_gaps: 0.0,
    },
];

impl Prior {
    /// Whether the body may be of that size, 0 to 1. Without ground its top is as high as itself.
    pub fn size(&self, measures: &NodeMeasures) -> f64 {
        let [length, width, height] = measures.size;
        let top = measures.above_ground.map_or(height, |[_, top]| top);
        trapezoid(self.length, length)
            * trapezoid(self.width, width)
            * trapezoid(self.height, height)
            * trapezoid(self.top, top)
    }
}

pub(super) fn trapezoid([from, full, until, end]: Trapezoid, x: f64) -> f64 {
    let rise = if x >= full { 1.0 } else { (x - from) / (full - from) };
    let fall = if x <= until { 1.0 } else { (end - x) / (end - until) };
    rise.min(fall).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trapezoid_rises_and_falls() {
        let of = |x: f64| trapezoid([0.0, 1.0, 2.0, 4.0], x);
        assert_eq!([-1.0, 0.5, 1.5, 3.0, 9.0].map(of), [0.0, 0.5, 1.0, 0.5, 0.0]);
        assert_eq!(trapezoid([0.0, 0.1, 1.0, 2.0], 0.0), 0.0);
    }

    #[test]
    fn whole_bodies_are_of_their_own_size() {
        let measures = |size: [f64; 3]| NodeMeasures {
            size,
            above_ground: Some([0.0, size[2]]),
            range: 10.0,
            filled: 1.0,
        };
        let whole = [[0.6, 0.4, 1.75], [1.8, 0.6, 1.7], [4.4, 1.8, 1.5], [12.0, 2.55, 3.2]];
        for (prior, size) in BODIES.iter().zip(whole) {
            assert_eq!(prior.size(&measures(size)), 1.0, "{:?}", prior.body);
        }
        assert!(BODIES.iter().all(|prior| prior.size(&measures([30.0, 0.5, 9.0])) == 0.0));
    }
}
