//! Where the sensor of a cloud stands that has been brought into another frame: the vehicle's, or a
//! level one.
//!
//! A beam that turns about an axis sweeps a cone: all its returns are seen from the sensor under
//! one angle to the axis. Origin and axis are those under which the angles of each ring agree best:
//! five numbers, found by damped least squares on the sines of those angles, each ring's own angle
//! being eliminated, and returns that fit badly weighing little (Cauchy's weights). Only rings are
//! needed, no order and no time.

use nalgebra::{Isometry3, Matrix5, Point3, Translation3, UnitQuaternion, Vector3, Vector5};

use super::sweep::Sweep;
use crate::cloud::point_cloud::PointCloud;
use crate::geometry::statistics::median;

/// Returns that are looked at.
const MOST_RETURNS: usize = 4000;
/// Beams agree with a cone within this, radians: a tenth of a degree.
const AGREEMENT: f64 = 0.0018;
/// No sensor stands farther from the origin of the frame it reports in, metres: the length of a
/// lorry. (Seen from far enough anything agrees.)
const FARTHEST: f64 = 20.0;

/// The pose of the sensor in the cloud's frame, z its axis; `None` unless the rings say it clearly.
pub(super) fn of_rings(sweep: &Sweep, ring: &[u16]) -> Option<Isometry3<f64>> {
    const STEPS: usize = 40;
    let samples = samples(sweep, ring);
    let starts = [0.0, 1.0, 2.0].map(|height| View::new(Vector3::new(0.0, 0.0, height)));
    let found = starts.into_iter().filter_map(|start| {
        let mut view = start;
        let mut damping = 1e-3;
        let mut cost = Residuals::new(&samples, &view)?.scatter;
        for _ in 0..STEPS {
            let step = Residuals::new(&samples, &view)?.step(damping)?;
            let next = view.moved(&step);
            let next_cost = Residuals::new(&samples, &next)?.scatter;
            if next_cost < cost {
                let gain = cost - next_cost;
                (view, cost, damping) = (next, next_cost, damping * 0.3);
                if gain < 1e-7 {
                    break;
                }
            } else {
                damping *= 10.0;
                if damping > 1e6 {
                    break;
                }
            }
        }
        Some((cost, view))
    });
    let (cost, view) = found.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (cost < AGREEMENT && view.origin.norm() < FARTHEST).then(|| view.pose())
}

/// Where a sensor may stand that reports in a frame which lies on the ground, as those of vehicles
/// do; `None` where the frame hangs above the ground, as a sensor's own does.
///
/// Nothing but the ground says so: of most square metres around the origin the lowest return lies
/// at the height of the origin, where no sensor could see it. The height is that of a car's roof,
/// for want of better.
pub(super) fn over_ground(cloud: &PointCloud) -> Option<Isometry3<f64>> {
    const AROUND: f32 = 16.0;
    const SIDE: usize = 32;
    const FEWEST_CELLS: usize = 32;
    const ON_GROUND: f64 = 0.3;
    const ROOF: f64 = 1.8;
    let mut lowest = [f64::INFINITY; SIDE * SIDE];
    for point in (0..cloud.len()).filter(|&point| cloud.is_return(point)) {
        let [x, y, z] = cloud.position(point);
        if x.abs() < AROUND && y.abs() < AROUND {
            let [row, column] = [x, y].map(|along| ((along + AROUND) as usize).min(SIDE - 1));
            let lowest = &mut lowest[row * SIDE + column];
            *lowest = lowest.min(f64::from(z));
        }
    }
    let mut heights: Vec<f64> = lowest.into_iter().filter(|z| z.is_finite()).collect();
    let is_on_ground = heights.len() >= FEWEST_CELLS
        && median(&mut heights).is_some_and(|height| height.abs() < ON_GROUND);
    is_on_ground.then(|| Isometry3::translation(0.0, 0.0, ROOF))
}

/// Some returns and their rings.
fn samples(sweep: &Sweep, ring: &[u16]) -> Vec<(Vector3<f64>, usize)> {
    let every = sweep.sample.len().div_ceil(MOST_RETURNS).max(1);
    let chosen = sweep.sample.iter().step_by(every).map(|&point| point as usize);
    let position = |point: usize| Vector3::from(sweep.cloud.position(point).map(f64::from));
    chosen.map(|point| (position(point), usize::from(ring[point]))).collect()
}

/// A supposed sensor.
#[derive(Debug, Clone, Copy)]
struct View {
    origin: Vector3<f64>,
    axis: Vector3<f64>,
}

impl View {
    fn new(origin: Vector3<f64>) -> Self {
        View { origin, axis: Vector3::z() }
    }

    /// Two directions across the axis.
    fn across(&self) -> [Vector3<f64>; 2] {
        let one = self.axis.cross(&Vector3::x());
        let one = if one.norm() > 0.1 { one } else { self.axis.cross(&Vector3::y()) }.normalize();
        [one, self.axis.cross(&one)]
    }

    fn moved(&self, step: &Vector5<f64>) -> View {
        let [one, other] = self.across();
        View {
            origin: self.origin + Vector3::new(step[0], step[1], step[2]),
            axis: (self.axis + one * step[3] + other * step[4]).normalize(),
        }
    }

    fn pose(&self) -> Isometry3<f64> {
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &self.axis);
        let from = Translation3::from(Point3::from(self.origin).coords);
        Isometry3::from_parts(from, turn.unwrap_or_else(UnitQuaternion::identity))
    }
}

/// How far the sine of each return's angle is from those of its ring, and how it changes with the
/// view.
struct Residuals {
    rows: Vec<(f64, Vector5<f64>, usize)>,
    /// Median distance from the median of the ring.
    scatter: f64,
    rings: usize,
}

impl Residuals {
    fn new(samples: &[(Vector3<f64>, usize)], view: &View) -> Option<Self> {
        const NEAREST: f64 = 0.3;
        let across = view.across();
        let rings = samples.iter().map(|&(_, ring)| ring + 1).max()?;
        let mut of_ring: Vec<Vec<f64>> = vec![Vec::new(); rings];
        let mut rows = Vec::with_capacity(samples.len());
        for (position, ring) in samples {
            let ray = position - view.origin;
            let range = ray.norm().max(NEAREST);
            let ray = ray / range;
            let sine = view.axis.dot(&ray);
            let by_origin = (ray * sine - view.axis) / range;
            let by_axis = across.map(|across| across.dot(&ray));
            of_ring[*ring].push(sine);
            let slope = Vector5::new(by_origin.x, by_origin.y, by_origin.z, by_axis[0], by_axis[1]);
            rows.push((sine, slope, *ring));
        }
        let medians: Vec<f64> =
            of_ring.iter_mut().map(|sines| median(sines).unwrap_or(0.0)).collect();
        for (sine, _, ring) in &mut rows {
            *sine -= medians[*ring];
        }
        let mut sizes: Vec<f64> = rows.iter().map(|row| row.0.abs()).collect();
        Some(Residuals { scatter: median(&mut sizes)?, rows, rings })
    }

    /// The step of damped least squares, each ring's mean being free.
    fn step(&self, damping: f64) -> Option<Vector5<f64>> {
        const LEAST_SCALE: f64 = 1e-3;
        let scale = (2.0 * self.scatter).max(LEAST_SCALE);
        let weight = |residual: f64| 1.0 / (1.0 + (residual / scale).powi(2));
        let mut means = vec![(0.0, 0.0, Vector5::zeros()); self.rings];
        for (residual, slope, ring) in &self.rows {
            let (weight, mean) = (weight(*residual), &mut means[*ring]);
            *mean = (mean.0 + weight, mean.1 + weight * residual, mean.2 + weight * slope);
        }
        let (mut normal, mut right) = (Matrix5::zeros(), Vector5::zeros());
        for (residual, slope, ring) in &self.rows {
            let (total, residuals, slopes) = &means[*ring];
            let (weight, slope) = (weight(*residual), slope - slopes / *total);
            normal += weight * slope * slope.transpose();
            right -= weight * slope * (residual - residuals / *total);
        }
        for i in 0..5 {
            normal[(i, i)] *= 1.0 + damping;
        }
        normal.cholesky().map(|solve| solve.solve(&right))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use divmerge_simulate::{Drive, Mount, Scene, Sensor};

    /// A sweep in the frame of the vehicle's foot.
    fn swept(sensor: Sensor, mount: Mount) -> PointCloud {
        let mut drive = Drive::new(sensor, Scene::Street, 4);
        drive.mount = mount;
        let cloud = drive.frame(2).cloud;
        let to_vehicle = |point: usize| {
            let at = Point3::from(cloud.position(point).map(f64::from));
            mount.vehicle_from_sensor() * at
        };
        let moved: Vec<Point3<f64>> = (0..cloud.len()).map(to_vehicle).collect();
        let column = |axis: usize| moved.iter().map(|at| at[axis] as f32).collect();
        let moved = PointCloud::new(column(0), column(1), column(2)).unwrap();
        moved.with_ring(cloud.ring.clone().unwrap()).unwrap()
    }

    #[test]
    fn finds_a_sensor_by_its_rings() {
        let corner =
            Mount { ahead: 2.0, left: 0.9, yaw: 0.8, pitch: 0.05, roll: -0.1, ..Mount::level(1.0) };
        for sensor in [Sensor::Vlp16, Sensor::Hdl32e, Sensor::Vls128] {
            for mount in [Mount { ahead: 0.3, ..Mount::level(2.0) }, corner] {
                let cloud = swept(sensor, mount);
                let sweep = Sweep::new(&cloud);
                let found = of_rings(&sweep, cloud.ring.as_ref().unwrap()).expect("a pose");
                let expected = mount.vehicle_from_sensor();
                let off = (found.translation.vector - expected.translation.vector).norm();
                let leaning = (found * Vector3::z()).angle(&(expected * Vector3::z()));
                assert!(off < 0.05 && leaning < 0.005, "{sensor}: {off} m, {leaning} rad");
            }
        }
    }

    #[test]
    fn rings_that_are_no_beams_say_nothing() {
        let cloud = swept(Sensor::M1, Mount::level(1.8));
        assert_eq!(of_rings(&Sweep::new(&cloud), cloud.ring.as_ref().unwrap()), None);
    }
}
