//! Points that are no returns though they have a position: what drivers and nodes put where a beam
//! came back with nothing.
//!
//! Zeros are moved along when a cloud is transformed to another frame, so that thousands of points
//! have one position. Other drivers fill in the maximum range, so that points stand on a sphere
//! around the sensor. Both are told by what no surface does, whatever the unit and the frame.

use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

use super::extent::{middle, sample, squared_distance};
use super::point_cloud::{PointCloud, wide};
use crate::geometry::statistics::median;

/// Share of the points, and their number, from which on a crowd of points may be fill values. A
/// patch of 1 cm half a metre away, in coordinates that are rounded to centimetres, fills less than
/// a thousandth of any sensor's view.
const LEAST_SHARE: f64 = 0.005;
const FEWEST_POINTS: usize = 64;

impl PointCloud {
    /// The same cloud with NaN for the positions that are fill values: one that a crowd of points
    /// has to the bit; and those of the farthest points, where a crowd of them lies on a sphere.
    /// O(N).
    pub fn without_fill_values(mut self) -> Self {
        let crowd = FEWEST_POINTS.max((LEAST_SHARE * self.len() as f64) as usize);
        for position in repeated_positions(&self, crowd) {
            drop_points(&mut self, |at| bits(at) == position);
        }
        if let Some(sphere) = filled_sphere(&self, crowd) {
            drop_points(&mut self, |at| sphere.holds(at));
        }
        self
    }
}

fn drop_points(cloud: &mut PointCloud, is_fill: impl Fn([f32; 3]) -> bool) {
    for point in 0..cloud.len() {
        if cloud.is_return(point) && is_fill(cloud.position(point)) {
            cloud.set_position(point, [f32::NAN; 3]);
        }
    }
}

fn bits(position: [f32; 3]) -> [u32; 3] {
    position.map(f32::to_bits)
}

/// The positions that at least a crowd of returns have. A look at some thousand points finds those
/// that may be, which all points are then counted for.
fn repeated_positions(cloud: &PointCloud, crowd: usize) -> Vec<[u32; 3]> {
    /// Of a crowd, the look finds twenty on average.
    const SUSPICIOUS: usize = 3;
    let seen = sample(cloud).filter(|&point| cloud.is_return(point));
    let mut seen: Vec<[u32; 3]> = seen.map(|point| bits(cloud.position(point))).collect();
    seen.sort_unstable();
    let suspects = seen.chunk_by(|a, b| a == b).filter(|same| same.len() >= SUSPICIOUS);
    let is_crowd = |position: &[u32; 3]| {
        (0..cloud.len()).filter(|&p| bits(cloud.position(p)) == *position).count() >= crowd
    };
    suspects.map(|same| same[0]).filter(is_crowd).collect()
}

/// Ranges all alike, seen from wherever a sensor stands.
struct Sphere {
    centre: Vector3<f64>,
    radius: f64,
}

impl Sphere {
    /// How far from it points may be, as a share of the radius: the noise that some drivers add,
    /// and rounding.
    const THICKNESS: f64 = 1e-3;

    /// Distance of a position from the sphere, as a share of the radius.
    fn off(&self, at: Vector3<f64>) -> f64 {
        ((at - self.centre).norm() / self.radius - 1.0).abs()
    }

    fn holds(&self, at: [f32; 3]) -> bool {
        self.off(Vector3::from(wide(at))) <= Self::THICKNESS
    }

    /// The sphere of least squares: |p|^2 = 2 c p + (r^2 - |c|^2), linear in c and the bracket.
    fn through(points: &[Vector3<f64>]) -> Option<Sphere> {
        let count = points.len() as f64;
        let middle = points.iter().sum::<Vector3<f64>>() / count;
        let scale = points.iter().map(|at| (at - middle).norm()).sum::<f64>() / count;
        let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for at in points {
            let at = (at - middle) / scale;
            let row = Vector4::new(2.0 * at.x, 2.0 * at.y, 2.0 * at.z, 1.0);
            normal += row * row.transpose();
            right += row * at.norm_squared();
        }
        let found = normal.cholesky()?.solve(&right);
        let centre = found.xyz();
        let radius = (found.w + centre.norm_squared()).sqrt();
        radius
            .is_finite()
            .then(|| Sphere { centre: middle + centre * scale, radius: radius * scale })
    }

    /// The sphere that most of some points lie on, if there is one: fitted again and again to those
    /// that are not far off.
    fn of_most(points: &[Vector3<f64>]) -> Option<Sphere> {
        const ROUNDS: usize = 8;
        let mut sphere = Sphere::through(points)?;
        for _ in 0..ROUNDS {
            let mut off: Vec<f64> = points.iter().map(|&at| sphere.off(at)).collect();
            let limit = (2.0 * median(&mut off)?).max(Self::THICKNESS);
            let near = points.iter().copied().filter(|&at| sphere.off(at) <= limit);
            sphere = Sphere::through(&near.collect::<Vec<_>>())?;
        }
        let held = points.iter().filter(|&&at| sphere.off(at) <= Self::THICKNESS).count();
        (2 * held > points.len()).then_some(sphere)
    }
}

/// The sphere that a crowd of the farthest points lies on.
fn filled_sphere(cloud: &PointCloud, crowd: usize) -> Option<Sphere> {
    /// The sensor stands near the middle of the returns: seen from there, points of the sphere
    /// are this far at least, as a share of the farthest.
    const FARTHEST: f64 = 0.75;
    let middle = middle(cloud);
    let squared = |point: usize| squared_distance(cloud.position(point), middle);
    let returns = || (0..cloud.len()).filter(|&point| cloud.is_return(point));
    let farthest = returns().map(squared).fold(0.0, f64::max);
    let some = sample(cloud).filter(|&point| cloud.is_return(point));
    let far = some.filter(|&point| squared(point) >= FARTHEST * FARTHEST * farthest);
    let position = |point: usize| Vector3::from(wide(cloud.position(point)));
    let far: Vec<Vector3<f64>> = far.map(position).collect();
    let looked_at = sample(cloud).count().max(1);
    if 2 * far.len() * cloud.len() < crowd * looked_at {
        return None;
    }
    let sphere = Sphere::of_most(&far)?;
    let is_likely = (0.5..1.5).contains(&(sphere.radius / farthest.sqrt()));
    if !is_likely {
        return None;
    }
    let held = returns().filter(|&point| sphere.holds(cloud.position(point)));
    let held: Vec<Vector3<f64>> = held.map(position).collect();
    (held.len() >= crowd && are_all_around(&held, sphere.radius)).then_some(sphere)
}

/// Whether points of a sphere stand in many directions, and not on one circle, as a beam on level
/// ground does.
fn are_all_around(points: &[Vector3<f64>], radius: f64) -> bool {
    const WIDTH: f64 = 0.3;
    const OFF_PLANE: f64 = 0.003;
    let centre = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let spread = points.iter().fold(Matrix3::zeros(), |sum, at| {
        let from = (at - centre) / radius;
        sum + from * from.transpose()
    });
    let axes = spread.symmetric_eigen();
    let along = |axis: usize| {
        let axis = axes.eigenvectors.column(axis).into_owned();
        points.iter().map(move |at| (at - centre).dot(&axis) / radius)
    };
    let width = |axis: usize| {
        let reach = along(axis).fold((0.0_f64, 0.0_f64), |r, at| (r.0.min(at), r.1.max(at)));
        reach.1 - reach.0
    };
    let thinnest = axes.eigenvalues.imin();
    let mut off_plane: Vec<f64> = along(thinnest).map(f64::abs).collect();
    (0..3).any(|axis| width(axis) > WIDTH)
        && median(&mut off_plane).is_some_and(|off| off > OFF_PLANE)
}
