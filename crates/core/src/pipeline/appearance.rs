//! What is measured on instances without a class.

use crate::cloud::UprightBox;
use crate::cloud::point_cloud::{PointCloud, wide};
use crate::cloud::shape::ShapeMeasures;
use crate::cluster::{MethodInput, ObjectPixels};
use crate::range_image::{NO_NEIGHBOUR, RangeImage};
use crate::semantics::ground::GroundHeights;

/// What [`ShapeMeasures`] need beyond an instance's own points.
pub(super) struct Appearance<'a> {
    ground: &'a GroundHeights,
    /// Departures of ranges, metres; those of instance k at k - 1.
    departures: Vec<Vec<f32>>,
}

impl<'a> Appearance<'a> {
    /// Of M object pixels with one of `count` instances each, on some ground. An instance need not
    /// have a pixel: all its points may be shadowed.
    pub fn new(
        input: &MethodInput,
        (instance, count): (&[u32], usize),
        ground: &'a GroundHeights,
    ) -> Self {
        let MethodInput { image, objects, .. } = *input;
        let mut departures = vec![Vec::new(); count];
        for (object, &own) in instance.iter().enumerate().filter(|&(_, &own)| own != 0) {
            departures[own as usize - 1].extend(departure(image, objects, instance, object));
        }
        Appearance { ground, departures }
    }

    /// The measures of an instance, given its points and its box.
    pub fn measures(
        &mut self,
        cloud: &PointCloud,
        id: u32,
        points: &[u32],
        bounds: &UprightBox,
    ) -> ShapeMeasures {
        let positions: Vec<[f64; 3]> =
            points.iter().map(|&point| wide(cloud.position(point as usize))).collect();
        let ground = self.ground.at(bounds.centre);
        let departures = &mut self.departures[id as usize - 1];
        ShapeMeasures::new(&positions, bounds, ground, departures)
    }
}

/// By how much the range of an object pixel departs from the mean of those to its left and right,
/// metres, if both are of its instance and as many columns away.
fn departure(
    image: &RangeImage,
    objects: &ObjectPixels,
    instance: &[u32],
    object: usize,
) -> Option<f32> {
    let [left, right, ..] = objects.neighbours[object];
    if left == NO_NEIGHBOUR || right == NO_NEIGHBOUR {
        return None;
    }
    let [left, right] = [left, right].map(|neighbour| neighbour as usize);
    if [left, right].iter().any(|&n| instance[n] != instance[object]) {
        return None;
    }
    // All three lie in one row, which may be joined at its ends.
    let apart = |from: usize, to: usize| match (objects.pixel[from], objects.pixel[to]) {
        (from, to) if from < to => to - from,
        (from, to) => to + image.columns() as u32 - from,
    };
    if apart(left, object) != apart(object, right) {
        return None;
    }
    let range = |object: usize| {
        objects.position[object].iter().map(|&x| f64::from(x).powi(2)).sum::<f64>().sqrt()
    };
    Some(((range(left) + range(right)) / 2.0 - range(object)).abs() as f32)
}
