//! How far an estimated trajectory departs from the true one, as KITTI states it.

use nalgebra::Isometry3;

/// Shortest way that a drift is stated for, metres: below, the error of a single frame decides.
const SHORTEST: f64 = 1.0;

/// Mean relative error over the stretches of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Error of the translation as a share of the way.
    pub translation: f64,
    /// Error of the rotation over the way, radians per metre.
    pub rotation: f64,
    /// Mean way of a stretch, metres.
    pub length: f64,
    /// Number of stretches.
    pub stretches: usize,
}

impl Drift {
    /// Error of the translation in percent of the way.
    pub fn translation_percent(&self) -> f64 {
        self.translation * 100.0
    }

    /// Error of the rotation in degrees per metre.
    pub fn degrees_per_metre(&self) -> f64 {
        self.rotation.to_degrees()
    }
}

/// The drift of estimated poses against true ones, `world_from_sensor` each and frame by frame.
///
/// As in KITTI's odometry benchmark (Geiger et al., CVPR 2012): from a start to the first frame
/// that is `length` metres of the true way farther, the motion that was estimated is compared with
/// the true one. Here a stretch starts at every frame and has one length; a trajectory that is
/// shorter is one stretch. The two worlds need not be the same. `None` where the true way is below
/// a metre, or the numbers of poses differ.
pub fn drift(estimated: &[Isometry3<f64>], truth: &[Isometry3<f64>], length: f64) -> Option<Drift> {
    let way = ways(truth);
    let whole = *way.last()?;
    if estimated.len() != truth.len() || whole < SHORTEST {
        return None;
    }
    let length = length.min(whole);
    let mut sum = Drift { translation: 0.0, rotation: 0.0, length: 0.0, stretches: 0 };
    for from in 0..truth.len() {
        let to = way.partition_point(|&at| at - way[from] < length);
        if to == truth.len() {
            break;
        }
        let covered = way[to] - way[from];
        let motion = |poses: &[Isometry3<f64>]| poses[from].inv_mul(&poses[to]);
        let error = motion(estimated).inv_mul(&motion(truth));
        sum.translation += error.translation.vector.norm() / covered;
        sum.rotation += error.rotation.angle() / covered;
        sum.length += covered;
        sum.stretches += 1;
    }
    let count = sum.stretches as f64;
    (sum.stretches > 0).then(|| Drift {
        translation: sum.translation / count,
        rotation: sum.rotation / count,
        length: sum.length / count,
        ..sum
    })
}

/// The way from the first pose to each, metres.
fn ways(poses: &[Isometry3<f64>]) -> Vec<f64> {
    let mut way = 0.0;
    let mut ways = Vec::with_capacity(poses.len());
    for (number, pose) in poses.iter().enumerate() {
        let previous = &poses[number.saturating_sub(1)];
        way += (pose.translation.vector - previous.translation.vector).norm();
        ways.push(way);
    }
    ways
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    use super::*;

    /// Poses a metre apart along x, each estimated with the given scale and yaw per metre.
    fn line(count: usize, scale: f64, yaw: f64) -> Vec<Isometry3<f64>> {
        let pose = |number: usize| {
            let way = number as f64;
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw * way);
            Isometry3::from_parts(Translation3::new(scale * way, 0.0, 0.0), turn)
        };
        (0..count).map(pose).collect()
    }

    #[test]
    fn a_scale_and_a_turn_are_found() {
        let truth = line(301, 1.0, 0.0);
        let scaled = drift(&line(301, 1.02, 0.0), &truth, 100.0).unwrap();
        assert!((scaled.translation_percent() - 2.0).abs() < 1e-9 && scaled.rotation < 1e-12);
        assert_eq!((scaled.length, scaled.stretches), (100.0, 201));
        let turned = drift(&line(301, 1.0, 0.001), &truth, 100.0).unwrap();
        assert!((turned.rotation - 0.001).abs() < 1e-9, "{turned:?}");
    }

    #[test]
    fn a_short_way_is_one_stretch_and_a_stand_is_none() {
        let short = drift(&line(11, 0.9, 0.0), &line(11, 1.0, 0.0), 100.0).unwrap();
        assert_eq!((short.length, short.stretches), (10.0, 1));
        assert!((short.translation - 0.1).abs() < 1e-12);
        let standing = vec![Isometry3::identity(); 5];
        assert_eq!(drift(&standing, &standing, 100.0), None);
        assert_eq!(drift(&[], &[], 100.0), None);
        assert_eq!(drift(&line(10, 1.0, 0.0), &line(11, 1.0, 0.0), 100.0), None);
    }

    #[test]
    fn where_the_world_begins_is_no_error() {
        let truth = line(201, 1.0, 0.0);
        let elsewhere = Isometry3::new(Vector3::new(3.0, -2.0, 9.0), Vector3::new(0.1, 0.2, 0.3));
        let moved: Vec<_> = truth.iter().map(|pose| elsewhere * pose).collect();
        let found = drift(&moved, &truth, 100.0).unwrap();
        assert!(found.translation < 1e-12 && found.rotation < 1e-9, "{found:?}");
    }
}
