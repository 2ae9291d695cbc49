//! Angles of single points.

use crate::cloud::PointCloud;

/// Elevation of a position above the horizontal plane in radians.
pub(super) fn elevation_of([x, y, z]: [f64; 3]) -> f64 {
    z.atan2(x.hypot(y))
}

/// Elevation of a point above the sensor's horizontal plane in radians.
pub(super) fn elevation(cloud: &PointCloud, point: usize) -> f64 {
    elevation_of(cloud.position(point).map(f64::from))
}

/// Azimuth of a point in radians, counter-clockwise from the x axis.
pub(super) fn azimuth(cloud: &PointCloud, point: usize) -> f64 {
    f64::from(cloud.y[point]).atan2(f64::from(cloud.x[point]))
}
