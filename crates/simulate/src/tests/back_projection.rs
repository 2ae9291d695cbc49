//! Which pixel a shadowed point takes its label from.

use divmerge_core::cluster::back_projection::BackProjector;
use divmerge_core::cluster::{ClusterParams, MethodInput, ObjectPixels};
use divmerge_core::range_image::{ProjectionParams, RangeImage};
use divmerge_core::semantics::{Corrections, GroundParams, MaskSource, object_mask};

use crate::{Drive, Scene, Sensor};

/// Against all object pixels of the window, one by one.
#[test]
fn rows_and_columns_that_are_left_out_hold_nothing_nearer() {
    let params = ClusterParams::best();
    let frame = Drive::new(Sensor::Hdl64e, Scene::Street, 3).frame(0);
    // So few columns that points hide one another.
    let coarse = ProjectionParams { columns: Some(700), ..ProjectionParams::default() };
    let image = RangeImage::new(&frame.cloud, &coarse);
    let source = MaskSource::NotGround(&GroundParams::default());
    let mask = object_mask(&frame.cloud, &image, source, Corrections::default());
    let objects = ObjectPixels::without_condition(&frame.cloud, &image, &mask, &params);
    let input = MethodInput::new(&frame.cloud, &image, &mask, &objects, &params);
    let projector = BackProjector::new(&input);
    let window = params.back_projection;
    let columns = image.columns();
    let mut shadowed = 0;
    for point in objects.points.iter().map(|&point| point as usize).step_by(5) {
        let Some(own) = image.pixel_of(point).filter(|_| image.is_shadowed(point)) else {
            continue;
        };
        shadowed += 1;
        let is_in_window = |&object: &usize| {
            let pixel = objects.pixel[object] as usize;
            let across = (pixel % columns).abs_diff(own % columns);
            across.min(columns - across) <= window.columns
                && (pixel / columns).abs_diff(own / columns) <= window.rows
        };
        let position = frame.cloud.position(point);
        let apart = |object: usize| {
            let other = objects.position[object];
            let along = |axis: usize| f64::from(position[axis]) - f64::from(other[axis]);
            (0..3).map(|axis| along(axis).powi(2)).sum::<f64>()
        };
        let all = (0..objects.len()).filter(is_in_window).map(apart);
        let found = projector.source(point).map_or(f64::INFINITY, apart);
        assert_eq!(found, all.fold(f64::INFINITY, f64::min), "of point {point}");
    }
    assert!(shadowed > 100, "{shadowed}");
}
