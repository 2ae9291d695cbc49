//! The azimuth of every point, without a call per point.

use std::f32::consts::{FRAC_PI_2, PI};

use crate::cloud::point_cloud::PointCloud;

/// N: azimuth in radians, counter-clockwise from the x axis, in [-pi, pi]; NaN for points that are
/// no return, and for no others.
pub(super) fn azimuths(cloud: &PointCloud) -> Vec<f32> {
    let points = cloud.x.iter().zip(&cloud.y).zip(&cloud.z);
    points.map(|((&x, &y), &z)| azimuth(x, y, z)).collect()
}

/// atan2(y, x), or NaN if (x, y, z) is no return ([`PointCloud::is_return`]).
///
/// The polynomial is that of Abramowitz and Stegun 4.4.49, which is off by at most 2e-8 in exact
/// arithmetic and 4e-7 in this one: a ten-thousandth of a column. It compiles to a few vector
/// instructions and gives the same bits everywhere.
pub(super) fn azimuth(x: f32, y: f32, z: f32) -> f32 {
    let is_steep = y.abs() > x.abs();
    let (long, short) = if is_steep { (y.abs(), x.abs()) } else { (x.abs(), y.abs()) };
    // A point on the vertical axis has azimuth 0 (or pi), not 0 / 0.
    let t = short / if long < f32::MIN_POSITIVE { f32::MIN_POSITIVE } else { long };
    let s = t * t;
    let mut p = 0.002_866_225_7;
    for coefficient in [
        -0.016_165_737,
        0.042_909_614,
        -0.075_289_64,
        0.106_562_64,
        -0.142_089,
        0.199_935_51,
        -0.333_331_45,
        1.0,
    ] {
        p = p * s + coefficient;
    }
    let acute = p * t;
    let quadrant = if is_steep { FRAC_PI_2 - acute } else { acute };
    let half = if x < 0.0 { PI - quadrant } else { quadrant };
    // A NaN among x and y has come through to here; one that z is comes through `longest`.
    let longest = if long > z.abs() { long } else { z.abs() };
    let is_return = (longest > 0.0) & (longest < f32::INFINITY);
    if is_return { half.copysign(y) } else { f32::NAN }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_library_all_round() {
        for step in 0..100_000 {
            let angle = -std::f64::consts::PI + f64::from(step) * 6.283e-5;
            let (y, x) = ((angle.sin() * 30.0) as f32, (angle.cos() * 30.0) as f32);
            let expected = f64::from(y).atan2(f64::from(x));
            let found = f64::from(azimuth(x, y, 0.0));
            assert!((found - expected).abs() < 4e-7, "{x} {y}: {found} for {expected}");
        }
        assert_eq!(azimuth(0.0, 0.0, 1.0), 0.0);
        assert_eq!(azimuth(1.0, 0.0, 1.0), 0.0);
        assert_eq!(azimuth(0.0, 2.0, 1.0), FRAC_PI_2);
        assert_eq!(azimuth(-1.0, 0.0, 1.0), PI);
        assert_eq!(azimuth(0.0, -1.0, 1.0), -FRAC_PI_2);
    }

    #[test]
    fn nan_marks_what_is_no_return() {
        let odd = [0.0, -0.0, 1.0, -3.0, 1e-40, f32::MAX, f32::NAN, f32::INFINITY, -f32::INFINITY];
        let triples = odd.iter().flat_map(|&x| odd.map(|y| odd.map(|z| [x, y, z]))).flatten();
        let [mut x, mut y, mut z] = [const { Vec::new() }; 3];
        for point in triples {
            x.push(point[0]);
            y.push(point[1]);
            z.push(point[2]);
        }
        let cloud = PointCloud::new(x, y, z).unwrap();
        for (point, azimuth) in azimuths(&cloud).into_iter().enumerate() {
            assert_eq!(azimuth.is_nan(), !cloud.is_return(point), "{:?}", cloud.position(point));
            assert!(azimuth.is_nan() || azimuth.abs() <= PI);
        }
    }
}
