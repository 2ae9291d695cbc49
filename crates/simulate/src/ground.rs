//! The ground: a smooth, sloped surface with strips of different use along x, some of them raised.

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
        Ground { profile, crossfall, steepest: relief.steepest, strips }
    }

    /// The strip at y, metres.
    pub fn strip(&self, y: f64) -> &Strip {
        let index = self.strips.partition_point(|strip| strip.to_y <= y);
        &self.strips[index.min(self.strips.len() - 1)]
    }

    /// Height of the surface without kerbs, metres.
    fn base(&self, x: f64, y: f64) -> f64 {
        self.profile.iter().map(|wave| wave.value(x)).sum::<f64>() + y * self.crossfall.value(x)
    }

    /// Height of the surface, metres.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        self.base(x, y) + if self.strip(y).is_raised { KERB } else { 0.0 }
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
        if self.strip(ray.at(upper).y).is_raised {
            return Some(self.surface(ray, upper));
        }
        let lower = self.descend(ray, upper, 0.0, limit);
        let kerb = self.kerb_face(ray, upper, lower.unwrap_or(limit));
        kerb.or_else(|| lower.map(|range| self.surface(ray, range)))
    }

    fn surface(&self, ray: &Ray, range: f64) -> GroundHit {
        let at = ray.at(range);
        let strip = self.strip(at.y);
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
        let [start, end] = [from, to].map(|range| ray.at(range).y);
        let sign = (end - start).signum();
        let inner = &self.strips[..self.strips.len() - 1];
        let crossed = inner.iter().filter_map(|strip| {
            let is_crossed = (strip.to_y - start) * sign > 0.0 && (end - strip.to_y) * sign > 0.0;
            let beyond = self.strip(strip.to_y + 1e-6 * sign);
            (is_crossed && beyond.is_raised).then_some((strip.to_y, beyond))
        });
        let (y, beyond) = crossed.min_by(|a, b| (a.0 * sign).total_cmp(&(b.0 * sign)))?;
        Some(GroundHit {
            range: (y - ray.origin.y) / ray.direction.y,
            class: beyond.class,
            material: beyond.material,
            normal: Vector3::new(0.0, -sign, 0.0),
        })
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
