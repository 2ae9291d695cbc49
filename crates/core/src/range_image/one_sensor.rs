//! The image of one sensor, from where it stands.

use nalgebra::{Isometry3, Point3, Translation3};

use super::band::as_return;
use super::evidence::Evidence;
use super::image::RangeImage;
use super::params::{ProjectionParams, RowsFrom};
use super::viewpoint::Viewpoint;
use super::{organised, project, viewpoint};
use crate::cloud::PointCloud;
use crate::cloud::point_cloud::wide;

/// The image of the points of one sensor: from the origin of their frame where that shows beams,
/// else from where the sensor is found to stand.
pub(super) fn one_sensor(cloud: &PointCloud, params: &ProjectionParams) -> RangeImage {
    if let Some(origin) = cloud.sensor_origin {
        let sensor = Translation3::from(origin).into();
        return from_viewpoint(cloud, &Viewpoint { sensor, evidence: Evidence::Given }, params);
    }
    let image = from_origin(cloud, params);
    if params.rows_from != RowsFrom::Best || viewpoint::is_origin(cloud, &image) {
        return image;
    }
    match viewpoint::find(cloud, &image) {
        None => image,
        Some(found) => from_viewpoint(cloud, &found, params),
    }
}

fn from_viewpoint(cloud: &PointCloud, from: &Viewpoint, params: &ProjectionParams) -> RangeImage {
    let mut image = from_origin(&seen_from(cloud, &from.sensor), params);
    for band in &mut image.bands {
        (band.sensor, band.evidence) = (from.sensor, from.evidence);
    }
    image
}

pub(super) fn from_origin(cloud: &PointCloud, params: &ProjectionParams) -> RangeImage {
    organised::project(cloud, params).unwrap_or_else(|| project::unorganised(cloud, params))
}

/// The cloud in the frame of a sensor in it.
fn seen_from(cloud: &PointCloud, sensor: &Isometry3<f64>) -> PointCloud {
    let mut seen = cloud.clone();
    for point in (0..cloud.len()).filter(|&point| cloud.is_return(point)) {
        let at = sensor.inverse_transform_point(&Point3::from(wide(cloud.position(point))));
        seen.set_position(point, as_return(at.into()));
    }
    seen
}
