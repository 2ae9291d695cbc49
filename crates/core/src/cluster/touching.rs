//! When two pixels touch in space, for objects without a class ([`gaps`](super::gaps)).

use super::params::GapMerge;
use crate::cloud::point_cloud::PointCloud;
use crate::range_image::RangeImage;

/// How far from each of M pixels another may be to touch it.
///
/// A pixel reaches [`GapMerge::across`] metres across the ground and [`GapMerge::upright`] metres
/// in height, or [`GapMerge::steps`] steps between the sensor's columns and rows where those are
/// wider, but never farther than [`GapMerge::at_most`].
///
/// `pixel` (M) are pixels of the image and `position` (M) the points seen in them, metres, sensor
/// frame. Returns M x 2: the reach across the ground and in height, metres. Time O(M).
pub fn reaches(
    pixel: &[u32],
    position: &[[f32; 3]],
    cloud: &PointCloud,
    image: &RangeImage,
    params: &GapMerge,
) -> Vec<[f32; 2]> {
    let columns = image.columns();
    let row_steps = image.row_steps(cloud);
    let reach = |(&pixel, position): (&u32, &[f32; 3])| {
        let band = image.band_of(pixel as usize);
        let from_sensor = band.from_sensor(position.map(f64::from));
        let range = from_sensor.iter().map(|x| x.powi(2)).sum::<f64>().sqrt();
        let within = |step: f64, least: f64| {
            (params.steps * step * range).min(params.at_most).max(least) as f32
        };
        let row_step = row_steps[pixel as usize / columns];
        [within(band.column_step, params.across), within(row_step, params.upright)]
    };
    pixel.iter().zip(position).map(reach).collect()
}

/// The square of the distance of two positions, in units of the larger of their reaches: they touch
/// up to 1.
#[inline]
pub fn squared_separation(a: [f32; 3], b: [f32; 3], reach_a: [f32; 2], reach_b: [f32; 2]) -> f32 {
    let (x, y, z) = (a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    let (across, upright) = (reach_a[0].max(reach_b[0]), reach_a[1].max(reach_b[1]));
    (x * x + y * y) / (across * across) + z * z / (upright * upright)
}
