//! Aligns a scan with the local map.

use nalgebra::{
    Isometry3, Matrix3, Matrix6, Point3, Quaternion, Translation3, UnitQuaternion, Vector3, Vector6,
};

use super::principal_axes::principal_axes;
use super::surfels::{Surfel, SurfelMap};

/// Iterations at most.
const ITERATIONS: usize = 30;

/// The alignment is done when a step moves the sensor by less than this, metres, and turns it by
/// less than a tenth of that, radians.
const DONE: f64 = 5e-4;

/// How well a scan fits to the map.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Fit {
    /// Points of the scan.
    pub points: usize,
    /// Share of the points that lie in a voxel of the map with a surface.
    pub matched_share: f64,
    /// Share of the matched points that lie on its surface, within 0.2 m.
    pub inlier_share: f64,
    /// Mean distance of those from their surface, metres.
    pub mean_residual: f64,
    /// How well the surfaces hold the direction of motion that they hold least, as a share of what
    /// all of them could: 1/3 for surfaces towards all sides, 0 along a corridor without ends.
    pub weakest_direction: f64,
}

/// Distance from a surface within which a point counts as on it, metres.
const ON_SURFACE: f64 = 0.2;

/// The normal equations of one iteration, and what they are made of.
#[derive(Default)]
struct Equations {
    matrix: Matrix6<f64>,
    right: Vector6<f64>,
    /// Points in a voxel with a surface, and those on it with their distances.
    matched: usize,
    inliers: usize,
    residuals: f64,
    /// Weights of all points.
    weight: f64,
}

/// What is aligned to what.
#[derive(Clone, Copy)]
pub struct Alignment<'a> {
    /// From fine to coarse: a point is held by the first that has a surface where it lies.
    pub maps: &'a [SurfelMap],
    /// Points of the scan, metres, in the sensor's frame.
    pub points: &'a [Point3<f64>],
    /// The pose that the motion before leads to.
    pub predicted: Isometry3<f64>,
    /// By how many points the prediction counts.
    pub prediction_weight: f64,
}

/// A point and the surface of its voxel.
struct Match<'a> {
    position: Point3<f64>,
    surfel: &'a Surfel,
    /// From the surface, along its normal, metres.
    distance: f64,
    /// How far the surface is trusted there, 0 to 1.
    trust: f64,
}

impl Alignment<'_> {
    /// The pose of the sensor in the map, from a guess, and how well the scan fits there.
    ///
    /// Gauss-Newton on the distances of points from surfaces with the kernel of Geman and McClure.
    /// Its width, metres, begins at `width` and halves until `least_width`, so that what moves by
    /// itself counts less and less.
    pub fn align(
        &self,
        guess: Isometry3<f64>,
        width: f64,
        least_width: f64,
    ) -> (Isometry3<f64>, Fit) {
        let (mut pose, mut width) = (guess, width.max(least_width));
        for _ in 0..ITERATIONS {
            let mut equations = self.equations(&pose, width);
            equations.pull_to(&self.predicted, &pose, self.prediction_weight);
            let Some(step) = equations.solve() else { break };
            pose = moved(&pose, &step);
            let is_small = step.fixed_rows::<3>(0).norm() < DONE
                && step.fixed_rows::<3>(3).norm() < 0.1 * DONE;
            if is_small && width <= least_width {
                break;
            }
            width = (0.5 * width).max(least_width);
        }
        let fit = self.equations(&pose, least_width).fit(self.points.len());
        (pose, fit)
    }

    /// How well the points fit to upright surfaces from a pose: what lies flat fits wherever the
    /// sensor is, and best where the beams meet the ground in the same places as before.
    pub fn score(&self, pose: &Isometry3<f64>, width: f64) -> f64 {
        let mut score = 0.0;
        for Match { surfel, distance, trust, .. } in self.matches(pose) {
            let upright = 1.0 - surfel.normal.z * surfel.normal.z;
            score += upright * trust * kernel(distance, width);
        }
        score
    }

    /// The points that have a surface in their voxel, seen from a pose.
    fn matches<'s>(&'s self, pose: &'s Isometry3<f64>) -> impl Iterator<Item = Match<'s>> {
        self.points.iter().filter_map(move |point| {
            let position = pose * point;
            let surfel = self.surfel(&position)?;
            let offset = position - surfel.mean;
            let distance = surfel.normal.dot(&offset);
            let trust = surfel.trust(offset.norm_squared() - distance * distance);
            Some(Match { position, surfel, distance, trust })
        })
    }

    fn surfel(&self, position: &Point3<f64>) -> Option<&Surfel> {
        self.maps.iter().find_map(|map| map.at(position))
    }

    fn equations(&self, pose: &Isometry3<f64>, width: f64) -> Equations {
        let mut equations = Equations::default();
        let centre = Point3::from(pose.translation.vector);
        for Match { position, surfel, distance, trust } in self.matches(pose) {
            let weight = trust * kernel(distance, width);
            equations.add(&surfel.normal, &(position - centre), distance, weight);
        }
        equations
    }
}

/// The kernel of Geman and McClure: the weight of a distance, given the width of the kernel.
#[inline]
fn kernel(distance: f64, width: f64) -> f64 {
    let share = width * width / (width * width + distance * distance);
    share * share
}

impl Equations {
    /// Adds the distance of a point from a surface with a normal; `arm` leads from the sensor to
    /// the point.
    #[inline]
    fn add(&mut self, normal: &Vector3<f64>, arm: &Vector3<f64>, distance: f64, weight: f64) {
        let turn = arm.cross(normal);
        let row = Vector6::new(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z);
        for column in 0..6 {
            let weighted = weight * row[column];
            for line in 0..=column {
                self.matrix[(line, column)] += weighted * row[line];
            }
            self.right[column] -= weighted * distance;
        }
        self.weight += weight;
        self.matched += 1;
        if distance.abs() < ON_SURFACE {
            self.inliers += 1;
            self.residuals += distance.abs();
        }
    }

    /// Adds that the pose is near the predicted one: what no surface holds follows the prediction.
    fn pull_to(&mut self, predicted: &Isometry3<f64>, pose: &Isometry3<f64>, weight: f64) {
        /// An arm in metres by which a turn counts as much as a shift.
        const ARM: f64 = 10.0;
        let shift = pose.translation.vector - predicted.translation.vector;
        let turn = 2.0 * (pose.rotation * predicted.rotation.inverse()).imag();
        for axis in 0..3 {
            self.matrix[(axis, axis)] += weight;
            self.right[axis] -= weight * shift[axis];
            self.matrix[(axis + 3, axis + 3)] += weight * ARM * ARM;
            self.right[axis + 3] -= weight * ARM * ARM * turn[axis];
        }
    }

    fn solve(&self) -> Option<Vector6<f64>> {
        let mut matrix = self.matrix;
        matrix.fill_lower_triangle_with_upper_triangle();
        let step = matrix.cholesky()?.solve(&self.right);
        step.iter().all(|along| along.is_finite()).then_some(step)
    }

    fn fit(&self, points: usize) -> Fit {
        let share = |count: usize, of: usize| count as f64 / of.max(1) as f64;
        let mut normals: Matrix3<f64> = self.matrix.fixed_view::<3, 3>(0, 0).into_owned();
        normals.fill_lower_triangle_with_upper_triangle();
        let ([weakest, ..], _) = principal_axes(normals);
        Fit {
            points,
            matched_share: share(self.matched, points),
            inlier_share: share(self.inliers, self.matched),
            mean_residual: self.residuals / self.inliers.max(1) as f64,
            weakest_direction: weakest.max(0.0) / self.weight.max(f64::MIN_POSITIVE),
        }
    }
}

/// A pose after a small shift and a turn about the sensor.
fn moved(pose: &Isometry3<f64>, step: &Vector6<f64>) -> Isometry3<f64> {
    let shift = step.fixed_rows::<3>(0).into_owned();
    let turn = step.fixed_rows::<3>(3).into_owned();
    Isometry3::from_parts(
        Translation3::from(pose.translation.vector + shift),
        small_turn(&turn) * pose.rotation,
    )
}

/// A turn about an axis by its length in radians, to second order: no function of angles, whose
/// last bits differ from machine to machine.
pub fn small_turn(turn: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::from_parts(1.0, 0.5 * turn))
}
