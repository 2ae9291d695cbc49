//! Condition(a, b): do two neighbouring pixels belong together (ALGORITHM section 3)?

use super::authors::condition::{gated, nominal_angle_exceeds};
use super::params::{Condition, Rays};
use crate::cloud::taxonomy::ClassSize;

/// The condition with what it needs of the image and of its own parameters worked out beforehand.
#[derive(Debug, Clone, Copy)]
pub struct NeighbourTest<'a> {
    condition: &'a Condition,
    /// tan(theta).
    tangent: f64,
    /// Angle that a column stands for, radians.
    column_step: f64,
}

/// The direction in which two pixels are neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Along {
    /// In one row.
    Row,
    /// In one column.
    Column,
}

impl<'a> NeighbourTest<'a> {
    /// The condition on an image whose columns are so many radians apart.
    pub fn new(condition: &'a Condition, column_step: f64) -> Self {
        NeighbourTest { condition, tangent: condition.angle.tan(), column_step }
    }

    /// The same on an image whose columns are so many radians apart.
    #[inline]
    pub fn with_columns(self, column_step: f64) -> Self {
        NeighbourTest { column_step, ..self }
    }

    /// Whether two points belong together. Symmetric in them.
    ///
    /// `p` and `q` in metres, sensor frame, `apart` pixels from each other in their row or column.
    /// `size` is that of their class where it is known.
    #[inline]
    pub fn is_connected(
        &self,
        p: [f64; 3],
        q: [f64; 3],
        apart: usize,
        along: Along,
        size: Option<ClassSize>,
    ) -> bool {
        if let (Some(nearness), Some(size)) = (self.condition.nearness, size) {
            let reach = (nearness.share_of_width * size.width).min(nearness.at_most);
            return (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2) < reach * reach;
        }
        match &self.condition.gate {
            None => self.angle_exceeds(p, q, apart, along),
            Some(gate) => gated(p, q, apart, gate, || self.angle_exceeds(p, q, apart, along)),
        }
    }

    #[inline]
    fn angle_exceeds(&self, p: [f64; 3], q: [f64; 3], apart: usize, along: Along) -> bool {
        match self.condition.rays {
            Rays::Measured => measured_angle_exceeds(p, q, self.tangent),
            Rays::Nominal { row_step } => {
                let step = if along == Along::Row { self.column_step } else { row_step };
                nominal_angle_exceeds(p, q, apart as f64 * step, self.condition.angle)
            }
        }
    }
}

/// beta > theta without trigonometry per pair: |p x q| > tan(theta) (p.p - p.q), p the farther
/// point.
#[inline]
fn measured_angle_exceeds(p: [f64; 3], q: [f64; 3], tangent: f64) -> bool {
    let (pp, qq, pq) = (dot(p, p), dot(q, q), dot(p, q));
    let farther = pp.max(qq);
    let cross =
        norm([p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]);
    cross > tangent * (farther - pq)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::cluster::params::ClusterParams;

    /// Two points at ranges d1 and d2, `degrees` apart as seen from the sensor.
    fn pair(d1: f64, d2: f64, degrees: f64) -> ([f64; 3], [f64; 3]) {
        let (sin, cos) = degrees.to_radians().sin_cos();
        ([d1, 0.0, 0.0], [d2 * cos, d2 * sin, 0.0])
    }

    fn paper(d1: f64, d2: f64, degrees: f64) -> bool {
        let (p, q) = pair(d1, d2, degrees);
        let condition = ClusterParams::paper().condition;
        let test = NeighbourTest::new(&condition, TAU / 1800.0);
        let both = [(p, q), (q, p)].map(|(p, q)| test.is_connected(p, q, 1, Along::Row, None));
        assert_eq!(both[0], both[1], "not symmetric");
        both[0]
    }

    #[test]
    fn the_angle_decides() {
        // beta = atan2(d2 sin a, d1 - d2 cos a); by hand: 10 m and 10.1 m, 0.2 degrees apart: 19.2
        // degrees; 10 m and 10.3 m: 6.6 degrees.
        assert!(paper(10.1, 10.0, 0.2));
        assert!(!paper(10.3, 10.0, 0.2));
        assert!(paper(10.0, 10.0, 0.2));
    }

    #[test]
    fn equal_points_are_not_connected() {
        // 0 > 0 is false, as the formula has it.
        assert!(!paper(10.0, 10.0, 0.0));
    }

    #[test]
    fn nominal_and_measured_agree_where_the_nominal_angle_is_true() {
        for d1 in [10.0, 10.05, 10.15, 10.25, 11.0] {
            let (p, q) = pair(d1, 10.0, 0.3);
            let mut nominal = ClusterParams::paper().condition;
            nominal.rays = Rays::Nominal { row_step: 0.3_f64.to_radians() };
            for (columns, along) in [(1200, Along::Row), (7, Along::Column)] {
                let holds = NeighbourTest::new(&nominal, TAU / columns as f64)
                    .is_connected(p, q, 1, along, None);
                assert_eq!(holds, paper(d1, 10.0, 0.3));
            }
        }
    }

    #[test]
    fn gates_of_the_released_code() {
        let condition = ClusterParams::authors().condition;
        let holds = |d1: f64, d2: f64, degrees: f64, apart: usize| {
            let (p, q) = pair(d1, d2, degrees);
            let columns = (360.0 * apart as f64 / degrees).round() as usize;
            NeighbourTest::new(&condition, TAU / columns as f64).is_connected(
                p,
                q,
                apart,
                Along::Row,
                None,
            )
        };
        assert!(holds(20.0, 20.0, 0.5, 3));
        assert!(!holds(20.0, 20.0, 0.5, 4), "beyond 15 m at most 3 pixels");
        assert!(!holds(20.0, 20.0, 6.0, 3), "farther apart than 1.5 m");
        assert!(!holds(4.6, 4.0, 0.2, 1), "0.6 m apart and the angle fails");
        assert!(!holds(5.2, 4.8, 0.2, 1), "touching but too far away");
        assert!(holds(4.3, 4.0, 0.2, 20), "touching and near");
    }
}
