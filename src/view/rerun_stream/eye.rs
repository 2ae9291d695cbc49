//! Where a view of a scene is seen from.

use crate::view::numbers::quantile;
use divmerge_core::cloud::PointCloud;

/// Reach of a cloud that is shown, least and most, metres: a few far returns make no scene larger.
const REACH: [f64; 2] = [8.0, 60.0];

/// An eye, and what it looks at, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eye {
    /// Where it is.
    pub position: [f64; 3],
    /// What it looks at.
    pub target: [f64; 3],
}

impl Eye {
    /// For clouds that nobody looked at: from above and behind, with 40 m in view.
    pub fn usual() -> Self {
        Eye::behind([0.0, 0.0, -2.0], 40.0)
    }

    /// From above and behind, with what lies about the middle of a cloud in view.
    pub fn of_cloud(cloud: &PointCloud) -> Self {
        let returns: Vec<[f64; 3]> = (0..cloud.len())
            .filter(|&point| cloud.is_return(point))
            .map(|point| cloud.position(point).map(f64::from))
            .collect();
        if returns.is_empty() {
            return Eye::behind([0.0; 3], REACH[1]);
        }
        let part = |axis: usize, part: f64| quantile(returns.iter().map(|at| at[axis]), part);
        // The sensor, unless the cloud lies elsewhere.
        let middle = |axis: usize| {
            let [low, high] = [part(axis, 0.02), part(axis, 0.98)];
            if (low..=high).contains(&0.0) { 0.0 } else { part(axis, 0.5) }
        };
        let [x, y] = [middle(0), middle(1)];
        let distances = returns.iter().map(|at| (at[0] - x).hypot(at[1] - y));
        let reach = 1.3 * quantile(distances, 0.9);
        Eye::behind([x, y, part(2, 0.1)], reach.clamp(REACH[0], REACH[1]))
    }

    /// From above and behind a place, with all of a reach in view.
    fn behind([x, y, z]: [f64; 3], reach: f64) -> Self {
        let position = [x - 0.8 * reach, y - 0.3 * reach, z + 0.7 * reach];
        Eye { position, target: [x + 0.1 * reach, y, z] }
    }

    /// On some points from above, from the side of the sensor, with a reach around them in view.
    pub fn on(points: &[[f64; 3]], reach: f64) -> Self {
        const UP_DEGREES: f64 = 30.0;
        let count = points.len().max(1) as f64;
        let target = [0, 1, 2].map(|axis| points.iter().map(|at| at[axis]).sum::<f64>() / count);
        let [x, y, z] = target;
        let away = x.hypot(y);
        let toward = if away > 0.0 { [-x / away, -y / away] } else { [-1.0, 0.0] };
        let (up, along) = UP_DEGREES.to_radians().sin_cos();
        let distance = 2.2 * reach;
        let [dx, dy] = toward.map(|part| part * along * distance);
        Eye { position: [x + dx, y + dy, z + up * distance], target }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(radius: f32) -> PointCloud {
        let angles = || (0..628).map(|step| step as f32 * 0.01);
        let x = angles().map(|angle| radius * angle.cos()).collect();
        let y = angles().map(|angle| radius * angle.sin()).collect();
        PointCloud::new(x, y, vec![-1.7; 628]).unwrap()
    }

    #[test]
    fn one_outlier_moves_no_eye() {
        let mut cloud = ring(20.0);
        let before = Eye::of_cloud(&cloud);
        cloud.set_position(0, [4000.0, 0.0, -1.7]);
        let after = Eye::of_cloud(&cloud);
        let moved = (0..3).map(|axis| (before.position[axis] - after.position[axis]).abs());
        assert!(moved.fold(0.0, f64::max) < 0.5, "{before:?} {after:?}");
    }

    #[test]
    fn small_clouds_are_seen_from_near() {
        let [room, street] = [4.0, 25.0].map(|radius| Eye::of_cloud(&ring(radius)));
        assert!(room.position[2] < 6.0 && street.position[2] > 15.0, "{room:?} {street:?}");
    }

    #[test]
    fn a_pair_is_seen_from_the_sensor() {
        let eye = Eye::on(&[[10.0, 0.0, 0.0], [12.0, 0.0, 0.0]], 4.0);
        assert_eq!(eye.target, [11.0, 0.0, 0.0]);
        assert!(eye.position[0] < 10.0 && eye.position[2] > 1.0, "{eye:?}");
    }
}
