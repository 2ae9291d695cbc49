//! Poses by places alone: a vehicle heads where it drives.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector2, Vector3};

use crate::messages::fixes::{Fix, TangentPlane};

/// A heading is that of so much of the way, metres.
const CHORD: f64 = 2.0;

/// And of at least so many standard errors of a place: one of ten has an error of 0.1 rad.
const CHORD_ERRORS: f64 = 10.0;

/// What moved less since its heading was told stands, metres or standard errors.
const STANDS: f64 = 0.2;
const STANDS_ERRORS: f64 = 3.0;

/// Fixes with a larger standard error are left out, metres: a chord that tells a heading would be
/// longer than the turns of a vehicle.
const LARGEST_ERROR: f64 = 1.0;

/// Most places that are kept.
const MOST: usize = 256;

/// Poses by fixes one after another: x ahead and z up, in the plane that touches the earth at the
/// first of them.
#[derive(Debug, Default)]
pub(super) struct DrivenWay {
    plane: Option<TangentPlane>,
    /// Metres above the ellipsoid, where last known.
    altitude: Option<f64>,
    /// Places of the last chord, the latest last.
    way: VecDeque<Vector2<f64>>,
    /// The last heading, radians from east to north.
    heading: Option<f64>,
}

impl DrivenWay {
    /// The pose at the next fix; `None` before the vehicle has moved enough to show where it heads,
    /// and where the fix is too uncertain.
    pub(super) fn push(&mut self, fix: &Fix) -> Option<Isometry3<f64>> {
        let error = fix.error.unwrap_or(0.0);
        if error > LARGEST_ERROR {
            return None;
        }
        let altitude = fix.place.altitude.or(self.altitude).unwrap_or(0.0);
        self.altitude = Some(altitude);
        let plane = self.plane.get_or_insert_with(|| TangentPlane::at(&fix.place, altitude));
        let place = plane.local(&fix.place, altitude);
        self.head_to(place.xy(), error);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.heading?);
        Some(Isometry3::from_parts(Translation3::from(place), turn))
    }

    /// Takes the heading from the latest place that lies a chord behind.
    fn head_to(&mut self, place: Vector2<f64>, error: f64) {
        let chord = CHORD.max(CHORD_ERRORS * error);
        let least = STANDS.max(STANDS_ERRORS * error);
        let stands = |from: &Vector2<f64>| (place - from).norm() < least;
        if self.way.back().is_some_and(stands) {
            return;
        }
        while self.way.get(1).is_some_and(|second| (place - second).norm() >= chord)
            || self.way.len() >= MOST
        {
            self.way.pop_front();
        }
        let ahead = self.way.front().map(|behind| place - behind);
        if let Some(ahead) = ahead.filter(|ahead| ahead.norm() >= chord) {
            self.heading = Some(ahead.y.atan2(ahead.x));
        }
        self.way.push_back(place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::fixes::Geodetic;

    /// A fix so many metres east and north of 48 degrees north, 9 degrees east.
    fn fix(east: f64, north: f64, error: f64) -> Fix {
        let (latitude, longitude) = (48.0_f64.to_radians(), 9.0_f64.to_radians());
        // Radii of the ellipsoid there.
        let (along, across) = (6_370_944.0, 6_389_944.0);
        let latitude = latitude + north / along;
        let longitude = longitude + east / (across * latitude.cos());
        let place = Geodetic { latitude, longitude, altitude: Some(300.0) };
        Fix { stamp_ns: 0, frame_id: "gps".to_owned(), place, error: Some(error) }
    }

    fn heading(pose: Option<Isometry3<f64>>) -> Option<f64> {
        pose.map(|pose| pose.rotation.euler_angles().2)
    }

    #[test]
    fn a_vehicle_heads_where_it_drives_and_keeps_that_where_it_stands() {
        let mut way = DrivenWay::default();
        // Too little to say where it heads.
        for metres in [0.0, 0.5, 1.0, 1.5] {
            assert_eq!(heading(way.push(&fix(metres, 0.0, 0.01))), None);
        }
        let east = way.push(&fix(2.5, 0.0, 0.01)).expect("a pose");
        assert!((east.translation.vector - Vector3::new(2.5, 0.0, 0.0)).norm() < 0.01, "{east}");
        assert!(heading(Some(east)).expect("a heading").abs() < 0.01);
        // It stands, and its place jitters.
        for (x, y) in [(0.02, 0.03), (-0.04, 0.02), (0.01, -0.05)] {
            let stands = heading(way.push(&fix(2.5 + x, y, 0.01))).expect("a heading");
            assert!(stands.abs() < 0.01, "{stands}");
        }
        // It turns north.
        let turned = (1..=8).map(|step| way.push(&fix(2.5, 0.5 * f64::from(step), 0.01)));
        let north = heading(turned.last().flatten()).expect("a heading");
        assert!((north - std::f64::consts::FRAC_PI_2).abs() < 0.01, "{north}");
    }

    #[test]
    fn places_of_metres_say_nothing_and_those_of_decimetres_need_a_longer_way() {
        let mut way = DrivenWay::default();
        assert!((0..50).all(|step| way.push(&fix(f64::from(step), 0.0, 1.5)).is_none()));
        let mut way = DrivenWay::default();
        let said: Vec<bool> =
            (0..8).map(|step| way.push(&fix(f64::from(step), 0.0, 0.4)).is_some()).collect();
        assert_eq!(said, [false, false, false, false, true, true, true, true]);
        // Nothing grows on a circle that is smaller than a chord.
        for step in 0..5000 {
            let (y, x) = (0.1 * f64::from(step)).sin_cos();
            way.push(&fix(1.9 * x, 1.9 * y, 0.4));
        }
        assert!(way.way.len() <= MOST);
    }
}
