//! Casts the beams of one sweep.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use rand::RngExt;
use rand_pcg::Pcg32;

use super::ground::Ground;
use super::material::Material;
use super::mount::{Clutter, Mount};
use super::objects::{Model, Placed, class};
use super::random::{Purpose, normal, stream};
use super::sensor::Sensor;
use super::shapes::Ray;

/// Nothing closer than this is seen, metres.
const MIN_RANGE: f64 = 0.9;

/// Width of a beam's footprint in radians, where one that meets an edge gives two returns.
const FOOTPRINT: f64 = 3e-3;

/// Least distance between the two returns of a beam, metres.
const SEPARABLE: f64 = 0.6;

/// Azimuths in which targets are sorted, for sensors whose shots do not lie in columns.
const BINS: usize = 1800;

/// A beam that has passed this many surfaces is lost.
const MAX_SURFACES: usize = 8;

/// A beam's return.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Return {
    /// In the sensor's frame, metres.
    pub position: Vector3<f64>,
    pub class: u16,
    pub id: u16,
    pub material: Material,
    /// 0 to 1.
    pub intensity: f64,
}

/// What the sensor sees, in its own frame.
pub(super) struct View<'a> {
    pub sensor: Sensor,
    pub ground: &'a Ground,
    pub world_from_sensor: Isometry3<f64>,
    pub seed: u64,
    pub frame: usize,
    /// Only its field of view is used: the pose is in `world_from_sensor`.
    pub mount: Mount,
    pub clutter: Clutter,
    targets: Vec<Target>,
    /// Targets that a shot may meet, nearest first, by the column of its azimuth.
    bins: Vec<Vec<u32>>,
}

/// An object before the sensor.
struct Target {
    id: u16,
    model: Model,
    /// Rotation and translation that take the sensor's frame to the object's.
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    /// Range of its nearest point, at least; metres.
    nearest: f64,
    /// Bounds of its elevations, as tangents.
    tangents: [f64; 2],
}

/// The first surface on a beam's way.
struct Surface {
    range: f64,
    class: u16,
    id: u16,
    material: Material,
    /// Cosine of the angle of incidence.
    cosine: f64,
}

impl Surface {
    fn is_ground(&self) -> bool {
        matches!(self.material, Material::Asphalt | Material::Paving | Material::Grass)
    }
}

impl<'a> View<'a> {
    /// The objects around a sensor at `world_from_sensor`, sorted into its columns.
    pub fn new(
        sensor: Sensor,
        ground: &'a Ground,
        world_from_sensor: Isometry3<f64>,
        (seed, frame): (u64, usize),
        objects: Vec<Placed>,
    ) -> Self {
        let mut view = View {
            sensor,
            ground,
            world_from_sensor,
            seed,
            frame,
            mount: Mount::level(sensor.height()),
            clutter: Clutter::default(),
            targets: Vec::with_capacity(objects.len()),
            bins: vec![Vec::new(); bins(sensor)],
        };
        let mut spans: Vec<(Target, std::ops::Range<i64>)> =
            objects.into_iter().filter_map(|object| view.target(object)).collect();
        spans.sort_by(|a, b| a.0.nearest.total_cmp(&b.0.nearest));
        let count = bins(sensor) as i64;
        for (target, span) in spans {
            let index = view.targets.len() as u32;
            for column in span {
                view.bins[column.rem_euclid(count) as usize].push(index);
            }
            view.targets.push(target);
        }
        view
    }

    /// An object with the columns it may be seen in, or `None` if it is out of range.
    fn target(&self, object: Placed) -> Option<(Target, std::ops::Range<i64>)> {
        let sensor_from_object = self.world_from_sensor.inverse() * object.world_from_object;
        let (low, high) = (object.model.low, object.model.high);
        let half = (high - low) * 0.5;
        let centre = sensor_from_object * (low + half);
        // The sine by which the sensor leans against the object, a tenth at least.
        let lean = (sensor_from_object.rotation * Vector3::z()).xy().norm().max(0.1);
        let spread = half.xy().norm() + lean * half.z;
        let rise = half.z + lean * half.xy().norm();
        let distance = centre.coords.xy().norm();
        let nearest = distance - spread;
        if nearest > self.sensor.max_range() {
            return None;
        }
        let tangent = |z: f64, outward: f64| {
            let reference = if z * outward > 0.0 { nearest } else { distance + spread };
            z / reference.max(0.1)
        };
        let object_from_sensor = sensor_from_object.inverse();
        let target = Target {
            id: object.id,
            model: object.model,
            rotation: *object_from_sensor.rotation.to_rotation_matrix().matrix(),
            translation: object_from_sensor.translation.vector,
            nearest,
            tangents: [tangent(centre.z - rise, -1.0), tangent(centre.z + rise, 1.0)],
        };
        Some((target, self.columns_around(&centre, spread)))
    }

    /// Lets every beam meet every target, for comparison.
    #[cfg(test)]
    pub fn forget_bounds(&mut self) {
        let all: Vec<u32> = (0..self.targets.len() as u32).collect();
        self.bins.fill(all);
        for target in &mut self.targets {
            (target.nearest, target.tangents) = (0.0, [f64::NEG_INFINITY, f64::INFINITY]);
        }
    }

    /// The columns that a disc of `radius` around a point may reach into, jitter included.
    fn columns_around(&self, centre: &Point3<f64>, radius: f64) -> std::ops::Range<i64> {
        let count = self.bins.len() as i64;
        let distance = centre.coords.xy().norm();
        if distance <= 1.02 * radius {
            return 0..count;
        }
        let per_radian = count as f64 / std::f64::consts::TAU;
        let middle = (std::f64::consts::PI - centre.y.atan2(centre.x)) * per_radian - 0.5;
        let half = (radius / distance).asin() * per_radian + 2.0;
        let (first, last) = ((middle - half).floor() as i64, (middle + half).ceil() as i64);
        first..(last + 1).min(first + count)
    }

    /// The returns of all shots, row-major from the highest beam and the first column; of two
    /// returns of a shot the nearer first.
    pub fn cast(&self) -> Vec<[Option<Return>; 2]> {
        let (rows, columns) = (self.sensor.beams(), self.sensor.columns());
        let mut returns = vec![[None; 2]; rows * columns];
        for column in 0..columns {
            let mut rng = stream(self.seed, Purpose::Column, self.frame as u64, column as u64);
            let mut edges = stream(self.seed, Purpose::Edge, self.frame as u64, column as u64);
            for row in 0..rows {
                let [azimuth, elevation] = self.sensor.direction(row, column);
                if self.mount.sees(azimuth) {
                    let noise = self.sensor.azimuth_noise() * normal(&mut rng);
                    let shot = [azimuth + noise, elevation];
                    let first = self.fire(shot, shot, &mut rng);
                    let second = self.second(shot, &first, &mut edges);
                    returns[row * columns + column] = in_order(first, second);
                }
            }
        }
        returns
    }

    /// What else the footprint of a shot meets, where the sensor tells two returns of it apart.
    fn second(&self, shot: [f64; 2], first: &Option<Return>, rng: &mut Pcg32) -> Option<Return> {
        let first = first.as_ref().filter(|_| self.sensor.is_dual())?;
        let aside = [(); 2].map(|()| FOOTPRINT * (rng.random::<f64>() - 0.5));
        let through = [shot[0] + aside[0], shot[1] + aside[1]];
        let second = self.fire(shot, through, rng)?;
        let apart = (second.position.norm() - first.position.norm()).abs();
        (apart > SEPARABLE).then_some(second)
    }

    /// One shot: what a ray meets whose azimuth and elevation (radians) are `through`, and whether
    /// that comes back; the range is put down in the direction of the shot.
    fn fire(&self, shot: [f64; 2], through: [f64; 2], rng: &mut Pcg32) -> Option<Return> {
        let sensor = self.sensor;
        let direction = direction(through);
        let surface = self.first_surface(&direction, &self.bins[self.bin(through[0])], rng);
        let surface = self.or_clutter(surface, rng)?;
        let noise = sensor.range_noise() * normal(rng);
        let [comes_back, glitter] = [rng.random::<f64>(), rng.random::<f64>()];
        if comes_back > self.chance_of_return(&surface) {
            return None;
        }
        let range = ((surface.range + noise) / sensor.range_step()).round() * sensor.range_step();
        let brightness = surface.material.optics().reflectivity * (0.35 + 0.65 * surface.cosine);
        Some(Return {
            position: self::direction(shot) * range,
            class: surface.class,
            id: surface.id,
            material: surface.material,
            intensity: (brightness * (0.85 + 0.3 * glitter)).clamp(0.01, 1.0),
        })
    }

    /// The bin of an azimuth in radians.
    fn bin(&self, azimuth: f64) -> usize {
        let turns = (std::f64::consts::PI - azimuth) / std::f64::consts::TAU;
        ((turns.rem_euclid(1.0) * self.bins.len() as f64) as usize).min(self.bins.len() - 1)
    }

    /// A drop before the surface or what a mirroring ground shows instead of it, if either comes
    /// back.
    fn or_clutter(&self, surface: Option<Surface>, rng: &mut Pcg32) -> Option<Surface> {
        let clutter = |range| Surface {
            range,
            class: class::OUTLIER,
            id: 0,
            material: Material::Water,
            cosine: 1.0,
        };
        let free = surface.as_ref().map_or(self.sensor.max_range(), |surface| surface.range);
        if let Some(range) = self.clutter.drop(MIN_RANGE, rng).filter(|&range| range < free) {
            return Some(clutter(range));
        }
        let surface = surface?;
        let detour = surface.is_ground().then(|| self.clutter.detour(rng)).flatten();
        Some(detour.map_or(surface, |detour| clutter(free + detour)))
    }

    /// Dropouts, losses at the surface, and the echo's weakening with range and incidence.
    fn chance_of_return(&self, surface: &Surface) -> f64 {
        const DROPOUT: f64 = 0.008;
        let optics = surface.material.optics();
        let echo = optics.reflectivity * (0.04 + 0.96 * surface.cosine);
        let strength = echo * (self.sensor.reach() / surface.range).powi(2);
        (1.0 - DROPOUT) * (1.0 - optics.loss) * (1.0 - (-strength).exp())
    }

    /// The first surface that the beam does not pass.
    fn first_surface(
        &self,
        direction: &Vector3<f64>,
        candidates: &[u32],
        rng: &mut Pcg32,
    ) -> Option<Surface> {
        let ground = self.ground_surface(direction);
        let limit = ground.as_ref().map_or(self.sensor.max_range(), |g| g.range);
        let mut from = MIN_RANGE;
        for _ in 0..MAX_SURFACES {
            let Some(surface) = self.nearest_object(direction, candidates, from, limit, rng) else {
                return ground;
            };
            if rng.random::<f64>() >= surface.material.optics().transmission {
                return Some(surface);
            }
            from = surface.range + 1e-6;
        }
        None
    }

    fn ground_surface(&self, direction: &Vector3<f64>) -> Option<Surface> {
        let pose = &self.world_from_sensor;
        let ray =
            Ray { origin: pose.translation.vector.into(), direction: pose.rotation * direction };
        let hit = self.ground.hit(&ray, self.sensor.max_range())?;
        Some(Surface {
            range: hit.range,
            class: hit.class,
            id: 0,
            material: hit.material,
            cosine: hit.normal.dot(&ray.direction).abs(),
        })
    }

    /// The first surface of an object between two ranges.
    fn nearest_object(
        &self,
        direction: &Vector3<f64>,
        candidates: &[u32],
        from: f64,
        limit: f64,
        rng: &mut Pcg32,
    ) -> Option<Surface> {
        let tangent = direction.z / direction.xy().norm();
        let (mut limit, mut found) = (limit, None);
        for &index in candidates {
            let target = &self.targets[index as usize];
            if target.nearest > limit {
                break;
            }
            if (target.tangents[0]..=target.tangents[1]).contains(&tangent)
                && let Some(surface) = target.surface(direction, from, limit, rng)
            {
                limit = surface.range;
                found = Some(surface);
            }
        }
        found
    }
}

/// Number of bins of azimuth.
fn bins(sensor: Sensor) -> usize {
    if sensor.columns() > 4096 || !sensor.closes() { BINS } else { sensor.columns() }
}

/// The unit vector of an azimuth and an elevation in radians.
fn direction([azimuth, elevation]: [f64; 2]) -> Vector3<f64> {
    let ((sin, cos), level) = (azimuth.sin_cos(), elevation.cos());
    Vector3::new(level * cos, level * sin, elevation.sin())
}

/// Two returns of a shot, the nearer first.
fn in_order(first: Option<Return>, second: Option<Return>) -> [Option<Return>; 2] {
    match (&first, &second) {
        (Some(one), Some(other)) if other.position.norm() < one.position.norm() => [second, first],
        _ => [first, second],
    }
}

impl Target {
    /// The first surface of this object between two ranges.
    fn surface(
        &self,
        direction: &Vector3<f64>,
        from: f64,
        limit: f64,
        rng: &mut Pcg32,
    ) -> Option<Surface> {
        let ray = Ray { origin: self.translation.into(), direction: self.rotation * direction };
        let (mut limit, mut first) = (limit, None);
        for part in &self.model.parts {
            let Some((enter, leave)) = part.shape.span(&ray) else {
                continue;
            };
            if leave <= from || enter >= limit {
                continue;
            }
            let range = if part.coating.is_foliage() {
                enter.max(from) + foliage_depth(rng)
            } else if enter > from {
                enter
            } else if part.coating.is_shell() {
                leave
            } else {
                continue;
            };
            if range < limit.min(leave + 1e-9) {
                limit = range;
                first = Some(part);
            }
        }
        let part = first?;
        let at = ray.at(limit);
        let normal = part.shape.normal_at(&at);
        let cosine = normal.dot(&ray.direction).abs();
        Some(Surface {
            range: limit,
            class: part.class,
            id: self.id,
            material: part.coating.material_at(&at, &normal),
            cosine: if part.coating.is_foliage() { 0.7 } else { cosine },
        })
    }
}

/// How deep a beam goes into foliage, metres.
fn foliage_depth(rng: &mut Pcg32) -> f64 {
    -Material::FOLIAGE_DEPTH * (1.0 - rng.random::<f64>()).ln()
}
