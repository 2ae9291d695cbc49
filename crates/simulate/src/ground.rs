//! The ground: a smooth, sloped surface with strips of different use along x, some of them raised.

use std::ops::Range;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;

use super::material::Material;
use super::random::{Purpose, stream};
use super::shapes::Ray;

/// Height of a kerb in metres.
pub(super) const KERB: f64 = 0.14;

/// How steep the ground is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Relief {
    /// Steepest slope and length in metres of the two waves of the profile along x.
    profile: [(f64, f64); 2],
    /// Steepest crossfall and the length in metres over which it comes and goes.
    crossfall: (f64, f64),
    /// No slope is steeper than this, along and across together, as far as a sensor sees.
    steepest: f64,
}

impl Relief {
    /// A plain: no more than 3 % along a road, 2 % across.
    pub const GENTLE: Relief = Relief {
        profile: [(0.022, 230.0), (0.008, 90.0)],
        crossfall: (0.02, 310.0),
        steepest: 0.07,
    };

    /// A plain that is level enough for a place that is wide across: no more than 2 % along a road,
    /// 0.8 % across.
    pub const LEVEL: Relief = Relief {
        profile: [(0.015, 230.0), (0.005, 90.0)],
        crossfall: (0.008, 310.0),
        steepest: 0.07,
    };

    /// Hills: up to 15 % along a road, 5 % across, crests and dips of 140 m radius.
    pub const HILLY: Relief =
        Relief { profile: [(0.12, 180.0), (0.03, 60.0)], crossfall: (0.05, 250.0), steepest: 0.32 };
}

/// A strip of ground along x.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strip {
    /// Where it ends towards +y, metres in the world frame.
    pub to_y: f64,
    /// SemanticKITTI's raw id.
    pub class: u16,
    pub material: Material,
    /// Whether it lies [`KERB`] above the road.
    pub is_raised: bool,
}

/// Streets across the strips: one in every so many metres, as low as the road.
#[derive(Debug, Clone)]
pub(super) struct SideStreets {
    /// Where one of them begins and ends along x, metres.
    pub first: Range<f64>,
    /// From the beginning of one to that of the next, metres.
    pub every: f64,
    /// Where they begin and end along y, metres.
    pub reach: Range<f64>,
    /// What they are made of; where it ends is given by `reach`.
    pub surface: Strip,
}

impl SideStreets {
    fn contains(&self, x: f64, y: f64) -> bool {
        let width = self.first.end - self.first.start;
        self.reach.contains(&y) && (x - self.first.start).rem_euclid(self.every) < width
    }

    /// Their edges along x between two places, and some beyond.
    fn edges(&self, from: f64, to: f64) -> impl Iterator<Item = f64> + use<> {
        let number = |x: f64| ((x - self.first.start) / self.every).floor() as i64;
        let (first, every) = (self.first.clone(), self.every);
        (number(from.min(to))..=number(from.max(to))).flat_map(move |number| {
            [first.start, first.end].map(|edge| edge + number as f64 * every)
        })
    }
}

/// A wave of the longitudinal profile or of the crossfall.
#[derive(Debug, Clone, Copy)]
struct Wave {
    amplitude: f64,
    per_metre: f64,
    phase: f64,
}

impl Wave {
    fn value(&self, x: f64) -> f64 {
        self.amplitude * (self.per_metre * x + self.phase).sin()
    }

    fn slope(&self, x: f64) -> f64 {
        self.amplitude * self.per_metre * (self.per_metre * x + self.phase).cos()
    }
}

/// The surface z = profile(x) + y * crossfall(x), plus the kerbs; metres in the world frame.
#[derive(Debug, Clone)]
pub(super) struct Ground {
    profile: [Wave; 2],
    crossfall: Wave,
    steepest: f64,
    /// From the rightmost (-y) to the leftmost; the last has no end.
    strips: Vec<Strip>,
    side_streets: Option<SideStreets>,
}

/// Where a ray meets the ground.
#[derive(Debug, Clone, Copy)]
pub(super) struct GroundHit {
    pub range: f64,
    pub class: u16,
    pub material: Material,
    /// Upward unit normal, or the kerb's horizontal one, in the world frame.
    pub normal: Vector3<f64>,
}

impl Ground {
    /// The slopes of `seed` under the given strips, rightmost first.
    pub fn new(seed: u64, relief: Relief, strips: Vec<Strip>) -> Self {
        let mut rng = stream(seed, Purpose::Ground, 0, 0);
        let mut wave = |steepness: f64, length: f64| {
            let per_metre = std::f64::consts::TAU / length;
            Wave {
                amplitude: steepness / per_metre,
                per_metre,
                phase: rng.random_range(0.0..std::f64::consts::TAU),
            }
        };
        let profile = relief.profile.map(|(steepness, length)| wave(steepness, length));
        let (amplitude, length) = relief.crossfall;
        let crossfall = Wave { amplitude, ..wave(1.0, length) };
        Ground { profile, crossfall, steepest: relief.steepest, strips, side_streets: None }
    }

    /// The same with streets across the strips.
    pub fn crossed_by(self, side_streets: Option<SideStreets>) -> Self {
        Ground { side_streets, ..self }
    }

    /// The strip at a place, metres.
    pub fn strip(&self, x: f64, y: f64) -> &Strip {
        let side_streets = self.side_streets.as_ref();
        if let Some(streets) = side_streets.filter(|streets| streets.contains(x, y)) {
            return &streets.surface;
        }
        let index = self.strips.partition_point(|strip| strip.to_y <= y);
        &self.strips[index.min(self.strips.len() - 1)]
    }

    /// Height of the surface without kerbs, metres.
    fn base(&self, x: f64, y: f64) -> f64 {
        self.profile.iter().map(|wave| wave.value(x)).sum::<f64>() + y * self.crossfall.value(x)
    }

    /// Height of the surface, metres.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        self.base(x, y) + if self.strip(x, y).is_raised { KERB } else { 0.0 }
    }

    /// Slopes along x and along y.
    pub fn slopes(&self, x: f64, y: f64) -> [f64; 2] {
        let along = self.profile.iter().map(|wave| wave.slope(x)).sum::<f64>();
        [along + y * self.crossfall.slope(x), self.crossfall.value(x)]
    }

    fn normal(&self, x: f64, y: f64) -> Vector3<f64> {
        let [along, across] = self.slopes(x, y);
        Vector3::new(-along, -across, 1.0).normalize()
    }

    /// The frame of something that stands on the surface with its z along the normal; `yaw` in
    /// radians from the world's x.
    pub fn frame_on_slope(&self, x: f64, y: f64, yaw: f64) -> Isometry3<f64> {
        let up = self.normal(x, y);
        let left = up.cross(&Vector3::new(yaw.cos(), yaw.sin(), 0.0)).normalize();
        let axes = Matrix3::from_columns(&[left.cross(&up), left, up]);
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        Isometry3::from_parts(self.foot(x, y), rotation)
    }

    /// The frame of something that stands upright on the surface; `yaw` in radians.
    pub fn frame_upright(&self, x: f64, y: f64, yaw: f64) -> Isometry3<f64> {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
        Isometry3::from_parts(self.foot(x, y), rotation)
    }

    fn foot(&self, x: f64, y: f64) -> Translation3<f64> {
        Translation3::new(x, y, self.height(x, y))
    }

    /// Where a ray of the world frame first meets the ground before `limit` metres: the top of a
    /// raised strip, a kerb's face, or the lower level.
    pub fn hit(&self, ray: &Ray, limit: f64) -> Option<GroundHit> {
        let upper = self.descend(ray, 0.0, KERB, limit)?;
        let at = ray.at(upper);
        if self.strip(at.x, at.y).is_raised {
            return Some(self.surface(ray, upper));
        }
        let lower = self.descend(ray, upper, 0.0, limit);
        let kerb = self.kerb_face(ray, upper, lower.unwrap_or(limit));
        kerb.or_else(|| lower.map(|range| self.surface(ray, range)))
    }

    fn surface(&self, ray: &Ray, range: f64) -> GroundHit {
        let at = ray.at(range);
        let strip = self.strip(at.x, at.y);
        GroundHit {
            range,
            class: strip.class,
            material: strip.material,
            normal: self.normal(at.x, at.y),
        }
    }

    /// The range at which a ray comes down to `lift` metres above the lower level. Each step is
    /// safe: the ray cannot come down faster than over the steepest slope.
    fn descend(&self, ray: &Ray, from: f64, lift: f64, limit: f64) -> Option<f64> {
        let across = ray.direction.xy().norm();
        let fastest = self.steepest * across - ray.direction.z;
        if fastest <= 0.0 {
            return None;
        }
        let mut range = from;
        for _ in 0..200 {
            let at = ray.at(range);
            let above = at.z - self.base(at.x, at.y) - lift;
            if above < 0.3 {
                let [along, sideways] = self.slopes(at.x, at.y);
                let descent =
                    along * ray.direction.x + sideways * ray.direction.y - ray.direction.z;
                if above < 1e-4 {
                    return Some(range);
                }
                // Newton's step where it is the shorter of two good ones, else the safe one.
                let safe = above / fastest;
                range += if descent > 0.5 * fastest {
                    (above / descent).max(safe)
                } else {
                    safe.max(1e-3)
                };
            } else {
                range += above / fastest;
            }
            if range > limit {
                return None;
            }
        }
        Some(range)
    }

    /// The face of the first raised strip that a ray runs into between two ranges.
    fn kerb_face(&self, ray: &Ray, from: f64, to: f64) -> Option<GroundHit> {
        let [start, end] = [from, to].map(|range| ray.at(range));
        let face = |axis: usize, edge: f64| {
            let sign = (end[axis] - start[axis]).signum();
            let is_crossed = (edge - start[axis]) * sign > 0.0 && (end[axis] - edge) * sign > 0.0;
            if !is_crossed {
                return None;
            }
            let range = (edge - ray.origin[axis]) / ray.direction[axis];
            let mut beyond = ray.at(range);
            beyond[axis] = edge + 1e-6 * sign;
            let strip = self.strip(beyond.x, beyond.y);
            let mut normal = Vector3::zeros();
            normal[axis] = -sign;
            let (class, material) = (strip.class, strip.material);
            strip.is_raised.then_some(GroundHit { range, class, material, normal })
        };
        let along = self.strips[..self.strips.len() - 1].iter();
        let along = along.filter_map(|strip| face(1, strip.to_y));
        let streets = self.side_streets.iter();
        let edges = streets.flat_map(|streets| streets.edges(start.x, end.x));
        let across = edges.filter_map(|edge| face(0, edge));
        along.chain(across).min_by(|a, b| a.range.total_cmp(&b.range))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    fn road_and_sidewalk() -> Ground {
        let strip =
            |to_y, class, is_raised| Strip { to_y, class, material: Material::Asphalt, is_raised };
        Ground::new(3, Relief::GENTLE, vec![strip(4.0, 40, false), strip(f64::INFINITY, 48, true)])
    }

    fn is_near(ground: &Ground, at: Point3<f64>, margin: f64) -> bool {
        (at.z - ground.height(at.x, at.y)).abs() < margin
    }

    fn level(mut ground: Ground) -> Ground {
        ground.profile.iter_mut().for_each(|wave| wave.amplitude = 0.0);
        ground.crossfall.amplitude = 0.0;
        ground
    }

    fn ray(direction: [f64; 3]) -> Ray {
        Ray { origin: Point3::new(0.0, 0.0, 2.0), direction: Vector3::from(direction).normalize() }
    }

    #[test]
    fn level_road_and_sidewalk_have_known_ranges() {
        let ground = level(road_and_sidewalk());
        let road = ground.hit(&ray([1.0, 0.0, -1.0]), 100.0).unwrap();
        assert!((road.range - 2.0 * 2.0_f64.sqrt()).abs() < 1e-3 && road.class == 40);
        // Down to the kerb's height after sqrt(2) * (2 - 0.14) * ... at y = 2 * 3.72 = 7.44.
        let walk = ground.hit(&ray([0.0, 4.0, -1.0]), 100.0).unwrap();
        assert!((walk.range - 1.86 * 17.0_f64.sqrt()).abs() < 1e-3 && walk.class == 48);
        // At y = 4 this ray is 0.08 m high, below the kerb's edge.
        let face = ground.hit(&ray([0.0, 4.0, -1.92]), 100.0).unwrap();
        assert_eq!((face.class, face.normal), (48, Vector3::new(0.0, -1.0, 0.0)));
        assert!((face.range - 4.0_f64.hypot(1.92)).abs() < 1e-9);
        assert!(ground.hit(&ray([1.0, 0.0, 0.1]), 100.0).is_none());
    }

    #[test]
    fn a_side_street_has_no_kerb_but_at_its_edges() {
        let surface =
            Strip { to_y: f64::INFINITY, class: 44, material: Material::Asphalt, is_raised: false };
        let streets = SideStreets { first: -3.0..5.0, every: 50.0, reach: 4.0..90.0, surface };
        let ground = level(road_and_sidewalk()).crossed_by(Some(streets));
        // Straight on into the side street: no kerb, and the lower level.
        let street = ground.hit(&ray([0.0, 4.0, -1.0]), 100.0).unwrap();
        assert!((street.range - 2.0 * 17.0_f64.sqrt()).abs() < 1e-3 && street.class == 44);
        // From the road obliquely into the side street and against its kerb at x = 5.
        let face = ground.hit(&ray([5.0, 6.0, -1.95]), 100.0).unwrap();
        assert_eq!((face.class, face.normal), (48, Vector3::new(-1.0, 0.0, 0.0)));
        assert!((face.range - 61.0_f64.sqrt().hypot(1.95)).abs() < 1e-9);
        let is_raised = [-3.1, -2.9, 4.9, 5.1, 46.9, 47.1].map(|x| ground.strip(x, 9.0).is_raised);
        assert_eq!(is_raised, [true, false, false, true, true, false]);
    }

    #[test]
    fn hits_lie_on_the_slope() {
        let ground = road_and_sidewalk();
        let mut count = 0;
        for step in 0..200 {
            let (sin, cos) = (step as f64 * 0.1).sin_cos();
            let down = -0.02 - 0.002 * step as f64;
            let mut ray = ray([cos, -sin.abs(), down]);
            ray.origin.z += ground.height(0.0, 0.0);
            if let Some(hit) = ground.hit(&ray, 120.0) {
                assert!(is_near(&ground, ray.at(hit.range), 2e-3));
                count += 1;
            }
        }
        assert!(count > 150, "{count}");
    }

    #[test]
    fn slopes_are_gentle_vary_and_match_the_height() {
        let ground = road_and_sidewalk();
        let slopes: Vec<[f64; 2]> = (0..400).map(|i| ground.slopes(i as f64, 10.0)).collect();
        for axis in 0..2 {
            let steepest = slopes.iter().map(|s| s[axis].abs()).fold(0.0, f64::max);
            assert!((0.01..0.05).contains(&steepest), "{steepest}");
        }
        let difference = ground.height(51.0, -3.0) - ground.height(49.0, -3.0);
        assert!((difference / 2.0 - ground.slopes(50.0, -3.0)[0]).abs() < 1e-3);
        let frame = ground.frame_on_slope(50.0, -3.0, 0.7);
        let ahead = frame * Point3::new(1.0, 0.0, 0.0);
        assert!(is_near(&ground, ahead, 2e-3));
    }
}
