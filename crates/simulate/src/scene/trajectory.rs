//! Ways over the ground: straights and arcs, driven or walked at a speed that changes with time.

/// A part of a way.
#[derive(Debug, Clone, Copy)]
pub(super) enum Leg {
    /// So many metres straight on.
    Straight(f64),
    /// A turn by an angle in radians, to the left if it is positive, of a radius in metres.
    Turn { angle: f64, radius: f64 },
}

impl Leg {
    fn length(&self) -> f64 {
        match *self {
            Leg::Straight(length) => length,
            Leg::Turn { angle, radius } => angle.abs() * radius,
        }
    }
}

/// A way from a place, and when which part of it is covered.
#[derive(Debug, Clone)]
pub(super) struct Trajectory {
    /// Where it begins: x and y in metres, and the heading in radians.
    start: [f64; 3],
    /// After the last it goes straight on.
    legs: Vec<Leg>,
    /// Times in seconds, ascending, and the speed at each in metres per second; linear between them
    /// and constant before and after.
    speeds: Vec<(f64, f64)>,
}

impl Trajectory {
    /// Straight on from a place (metres) in a direction (radians) at a speed.
    pub fn straight([x, y]: [f64; 2], heading: f64, speed: f64) -> Self {
        Trajectory { start: [x, y, heading], legs: Vec::new(), speeds: vec![(0.0, speed)] }
    }

    /// The same along some legs.
    pub fn along(self, legs: &[Leg]) -> Self {
        Trajectory { legs: legs.to_vec(), ..self }
    }

    /// The same at speeds that change with time.
    pub fn at_speeds(self, speeds: &[(f64, f64)]) -> Self {
        Trajectory { speeds: speeds.to_vec(), ..self }
    }

    /// The same at rest.
    pub fn at_rest(self) -> Self {
        self.at_speeds(&[(0.0, 0.0)])
    }

    /// Speed after `time` seconds, metres per second.
    pub fn speed(&self, time: f64) -> f64 {
        let after = self.speeds.partition_point(|knot| knot.0 <= time);
        match (self.speeds[..after].last(), self.speeds.get(after)) {
            (Some(&(t0, v0)), Some(&(t1, v1))) => v0 + (v1 - v0) * (time - t0) / (t1 - t0),
            (Some(&(_, speed)), None) | (None, Some(&(_, speed))) => speed,
            (None, None) => 0.0,
        }
    }

    /// The way covered in `time` seconds from the first time on, metres.
    fn distance(&self, time: f64) -> f64 {
        let Some(&(first, _)) = self.speeds.first() else { return 0.0 };
        let (mut covered, mut from) = (0.0, first);
        let between = self.speeds.iter().map(|knot| knot.0).filter(|&t| first < t && t < time);
        for until in between.chain([time]) {
            covered += 0.5 * (self.speed(from) + self.speed_before(until)) * (until - from);
            from = until;
        }
        covered
    }

    /// Speed at a time as it is approached; of two speeds at one time the first.
    fn speed_before(&self, time: f64) -> f64 {
        let knot = self.speeds.iter().find(|knot| knot.0 == time);
        knot.map_or_else(|| self.speed(time), |knot| knot.1)
    }

    /// x and y in metres and the heading in radians after `time` seconds.
    pub fn at(&self, time: f64) -> [f64; 3] {
        let mut left = self.distance(time);
        let mut place = self.start;
        for leg in &self.legs {
            if left <= leg.length() {
                return advance(place, leg, left);
            }
            place = advance(place, leg, leg.length());
            left -= leg.length();
        }
        advance(place, &Leg::Straight(left), left)
    }
}

/// Where some metres along a leg lead.
fn advance([x, y, heading]: [f64; 3], leg: &Leg, length: f64) -> [f64; 3] {
    let (sin, cos) = heading.sin_cos();
    match *leg {
        Leg::Straight(_) => [x + length * cos, y + length * sin, heading],
        Leg::Turn { angle, radius } => {
            let turned = length / radius;
            let side = angle.signum();
            let (ahead, aside) = (radius * turned.sin(), side * radius * (1.0 - turned.cos()));
            let heading = heading + side * turned;
            [x + ahead * cos - aside * sin, y + ahead * sin + aside * cos, heading]
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    fn is_near(found: [f64; 3], expected: [f64; 3]) -> bool {
        found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    #[test]
    fn straight_at_a_constant_speed() {
        let way = Trajectory::straight([1.0, 2.0], FRAC_PI_2, 3.0);
        assert!(is_near(way.at(2.0), [1.0, 8.0, FRAC_PI_2]));
        assert!(is_near(way.at(-1.0), [1.0, -1.0, FRAC_PI_2]));
        assert!(is_near(way.at_rest().at(9.0), [1.0, 2.0, FRAC_PI_2]));
    }

    #[test]
    fn brakes_stands_and_starts_again() {
        let speeds = [(0.0, 8.0), (2.0, 8.0), (6.0, 0.0), (10.0, 0.0), (12.0, 4.0)];
        let way = Trajectory::straight([0.0, 0.0], 0.0, 0.0).at_speeds(&speeds);
        let expected = [(1.0, 8.0), (2.0, 16.0), (4.0, 28.0), (6.0, 32.0), (9.0, 32.0)];
        for (time, x) in expected.into_iter().chain([(12.0, 36.0), (13.0, 40.0)]) {
            assert!(is_near(way.at(time), [x, 0.0, 0.0]), "{time}");
        }
        assert_eq!([3.0, 8.0, 20.0].map(|time| way.speed(time)), [6.0, 0.0, 4.0]);
    }

    #[test]
    fn turns_to_either_side() {
        let turn = |angle: f64| Leg::Turn { angle, radius: 2.0 };
        let legs = [Leg::Straight(1.0), turn(FRAC_PI_2), turn(-FRAC_PI_2)];
        let way = Trajectory::straight([0.0, 0.0], 0.0, 1.0).along(&legs);
        let quarter = 2.0 * FRAC_PI_2;
        assert!(is_near(way.at(1.0), [1.0, 0.0, 0.0]));
        assert!(is_near(way.at(1.0 + quarter), [3.0, 2.0, FRAC_PI_2]));
        assert!(is_near(way.at(1.0 + 2.0 * quarter), [5.0, 4.0, 0.0]));
        assert!(is_near(way.at(2.0 + 2.0 * quarter), [6.0, 4.0, 0.0]));
        let half = 0.5 * quarter;
        let root = 2.0_f64.sqrt();
        assert!(is_near(way.at(1.0 + half), [1.0 + root, 2.0 - root, 0.5 * FRAC_PI_2]));
    }
}
