//! How a track moves on the plane: a Kalman filter of place and velocity (Kalman 1960), with
//! accelerations as white noise.

use nalgebra::Vector2;

use crate::cloud::Body;

/// How bodies move: what is expected of the velocity before it was measured, and how it changes.
#[derive(Debug, Clone, Copy)]
struct MotionModel {
    /// Standard deviation of a velocity that is not known, m/s: usual speeds in traffic.
    speed: f64,
    /// Standard deviation of the change of velocity in a second, m/s.
    change: f64,
}

impl MotionModel {
    fn of(body: Option<Body>) -> Self {
        match body {
            Some(Body::Person) => MotionModel { speed: 1.5, change: 1.0 },
            Some(Body::TwoWheeler) => MotionModel { speed: 8.0, change: 2.0 },
            Some(Body::Car) => MotionModel { speed: 15.0, change: 3.0 },
            Some(Body::LargeVehicle) => MotionModel { speed: 12.0, change: 2.0 },
            None => MotionModel { speed: 0.5, change: 0.3 },
        }
    }
}

/// Place and velocity on the plane, with one covariance for both axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kinematics {
    /// Metres.
    pub place: Vector2<f64>,
    /// Metres in a second.
    pub velocity: Vector2<f64>,
    /// Variance of the place, covariance, variance of the velocity.
    covariance: [f64; 3],
    body: Option<Body>,
}

impl Kinematics {
    /// At rest as far as is known; `error` is the standard deviation of the place, metres.
    pub fn new(place: Vector2<f64>, error: f64, body: Option<Body>) -> Self {
        let speed = MotionModel::of(body).speed;
        let covariance = [error * error, 0.0, speed * speed];
        Kinematics { place, velocity: Vector2::zeros(), covariance, body }
    }

    /// The same after some seconds.
    pub fn after(&self, seconds: f64) -> Self {
        let [place, both, velocity] = self.covariance;
        let noise = MotionModel::of(self.body).change.powi(2) * seconds;
        let covariance = [
            place
                + 2.0 * seconds * both
                + seconds * seconds * velocity
                + noise * seconds * seconds / 3.0,
            both + seconds * velocity + noise * seconds / 2.0,
            velocity + noise,
        ];
        Kinematics { place: self.place + self.velocity * seconds, covariance, ..*self }
    }

    /// The same corrected by a measured place of a standard error in metres.
    pub fn corrected(&self, measured: Vector2<f64>, error: f64, body: Option<Body>) -> Self {
        let [place, both, velocity] = self.covariance;
        let total = place + error * error;
        let innovation = measured - self.place;
        Kinematics {
            place: self.place + innovation * (place / total),
            velocity: self.velocity + innovation * (both / total),
            covariance: [
                place * (1.0 - place / total),
                both * (1.0 - place / total),
                velocity - both * both / total,
            ],
            body,
        }
    }

    /// Variance of the place, square metres.
    pub fn place_variance(&self) -> f64 {
        self.covariance[0]
    }

    /// Variance of the velocity, (m/s)².
    pub fn velocity_variance(&self) -> f64 {
        self.covariance[2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_velocity_is_learned_and_carried_on() {
        let mut car = Kinematics::new(Vector2::zeros(), 0.1, Some(Body::Car));
        for frame in 1..=20 {
            let measured = Vector2::new(1.2 * f64::from(frame), 0.0);
            car = car.after(0.1).corrected(measured, 0.1, Some(Body::Car));
        }
        assert!((car.velocity - Vector2::new(12.0, 0.0)).norm() < 0.1, "{}", car.velocity);
        let later = car.after(1.0);
        assert!((later.place.x - 36.0).abs() < 0.2, "{}", later.place);
        assert!(later.place_variance() > car.place_variance());
    }

    #[test]
    fn what_is_background_hardly_moves() {
        let wall = Kinematics::new(Vector2::zeros(), 0.1, None).after(0.1);
        let moved = wall.corrected(Vector2::new(0.5, 0.0), 0.1, None);
        assert!(moved.velocity.norm() < 1.0, "{}", moved.velocity);
    }
}
