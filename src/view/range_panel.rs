//! Panels of the range image: a pixel of the panel for each row and column.

use super::canvas::{Raster, between};
use super::ramp;
use super::scene::{FrameScene, Window, row_from_top, thing_places};
use crate::messages::palette::{instance_colour, reason_colour};
use divmerge_core::cloud::Reason;

/// Colours a part of the range image by `colour(pixel, point)` of each pixel with a return.
pub fn raster(
    scene: &FrameScene,
    window: &Window,
    mut colour: impl FnMut(usize, usize) -> [u8; 3],
) -> Raster {
    let image = &scene.stages.image;
    let mut raster = Raster::filled(window.columns.len(), window.rows.len(), scene.look().panel);
    for (y, row) in window.rows.clone().enumerate() {
        let row = row_from_top(image, row);
        for (x, column) in window.columns.clone().enumerate() {
            let pixel = row * image.columns() + column;
            if let Some(point) = image.point_at(pixel) {
                raster.pixels[y * raster.width + x] = colour(pixel, point);
            }
        }
    }
    raster
}

/// Colour of a return that is not an object: the nearer, the farther from the
/// colour of the panel.
pub fn backdrop(scene: &FrameScene, point: usize) -> [u8; 3] {
    const NEAR: f64 = 4.0;
    const FAR: f64 = 60.0;
    let part = (scene.range(point) / NEAR).max(1.0).ln() / (FAR / NEAR).ln();
    let [far, near] = scene.look().other_returns;
    between(near, far, part.min(1.0))
}

/// The object mask, coloured by class where there are classes.
pub fn mask(scene: &FrameScene, window: &Window) -> Raster {
    let (mask, places) = (&scene.stages.mask, thing_places(scene.classes));
    raster(scene, window, |_, point| {
        if !mask.is_object[point] {
            return backdrop(scene, point);
        }
        match places.get(usize::from(mask.class[point])) {
            Some(&place) => scene.look().class_colour(place),
            None => scene.look().object,
        }
    })
}

/// The local components of the divide step, each in a colour of its own.
pub fn components(scene: &FrameScene, window: &Window) -> Raster {
    let component = scene.component_of_pixel();
    let mask = &scene.stages.mask;
    raster(scene, window, |pixel, point| match component[pixel] {
        0 if mask.is_object[point] => reason_colour(Reason::Unreached as u8),
        0 => backdrop(scene, point),
        component => instance_colour(component),
    })
}

/// The instances.
pub fn instances(scene: &FrameScene, window: &Window) -> Raster {
    let (labels, mask) = (&scene.stages.labels, &scene.stages.mask);
    raster(scene, window, |_, point| match labels.instance[point] {
        0 if mask.is_object[point] => reason_colour(labels.reason[point] as u8),
        0 => backdrop(scene, point),
        instance => scene.colour(instance),
    })
}

/// The range image by range in metres up to `far`.
pub fn range(scene: &FrameScene, window: &Window, far: f64) -> Raster {
    raster(scene, window, |_, point| ramp::near_to_far((scene.range(point) / far).sqrt()))
}

/// The range image by the square root of the intensity, 0 to `high`.
pub fn intensity(scene: &FrameScene, window: &Window, intensity: &[f32], high: f64) -> Raster {
    raster(scene, window, |_, point| {
        scene.look().intensity((f64::from(intensity[point]) / high).max(0.0).sqrt())
    })
}
