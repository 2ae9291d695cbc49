//! The azimuth of every point, without a call per point.

use std::f32::consts::{FRAC_PI_2, PI};

use crate::cloud::PointCloud;

/// N: azimuth in radians, counter-clockwise from the x axis, in [-pi, pi]; anything for points that are
/// no return.
pub(super) fn azimuths(cloud: &PointCloud) -> Vec<f32> {
    cloud.y.iter().zip(&cloud.x).map(|(&y, &x)| atan2(y, x)).collect()
}

/// atan2 by the polynomial of Abramowitz and Stegun 4.4.49, which is off by at most 2e-8 in exact
/// arithmetic and 4e-7 in this one: a ten-thousandth of a column. It compiles to a few vector
/// instructions and gives the same bits everywhere.
fn atan2(y: f32, x: f32) -> f32 {
    let (long, short) = (x.abs().max(y.abs()), x.abs().min(y.abs()));
    // A point on the vertical axis has azimuth 0 (or pi), not 0 / 0.
    let t = short / long.max(f32::MIN_POSITIVE);
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
    let quadrant = if y.abs() > x.abs() { FRAC_PI_2 - acute } else { acute };
    let half = if x < 0.0 { PI - quadrant } else { quadrant };
    half.copysign(y)
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
            let found = f64::from(atan2(y, x));
            assert!((found - expected).abs() < 4e-7, "{x} {y}: {found} for {expected}");
        }
        assert_eq!(atan2(0.0, 0.0), 0.0);
        assert_eq!(atan2(0.0, 1.0), 0.0);
        assert_eq!(atan2(2.0, 0.0), FRAC_PI_2);
        assert_eq!(atan2(0.0, -1.0), PI);
        assert_eq!(atan2(-1.0, 0.0), -FRAC_PI_2);
    }
}
