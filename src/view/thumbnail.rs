//! A small picture of a part of the range image.

use super::png::raster_png;
use super::range_panel;
use super::scene::{FrameScene, row_from_top};

/// The instances around some points, a pixel of the picture for each of the range image, as PNG;
/// none of points without a pixel. `shape` is width over height, `aspect` height over width of the
/// whole range image.
pub fn thumbnail(scene: &FrameScene, points: &[usize], aspect: f64, shape: f64) -> Option<Vec<u8>> {
    let image = &scene.stages.image;
    let pixels: Vec<[usize; 2]> = points
        .iter()
        .filter_map(|&point| image.pixel_of(point))
        .map(|pixel| [row_from_top(image, pixel / image.columns()), pixel % image.columns()])
        .collect();
    if pixels.is_empty() {
        return None;
    }
    let window = scene.window_around(pixels.into_iter(), aspect, shape);
    raster_png(&range_panel::instances(scene, &window))
}
