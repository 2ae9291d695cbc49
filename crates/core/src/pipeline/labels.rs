//! From the segmentation to a label for each point.

use std::cell::LazyCell;

use crate::cloud::{PointLabels, Reason};
use crate::cluster::back_projection::BackProjector;
use crate::cluster::{Components, MethodInput, Segmentation};

/// The final instance of each component and object pixel, or why it has none.
pub(super) struct InstancePixels {
    /// m + 1: final instance of each component from 1, or 0; component k at k.
    pub of_component: Vec<u32>,
    /// M: final instance from 1, or 0.
    pub instance: Vec<u32>,
    /// Pixels of each final instance; instance k at k - 1.
    pub pixels: Vec<u32>,
    /// Components of each final instance; instance k at k - 1.
    pub components: Vec<u32>,
    /// The instance of the last merge that each final instance is; instance k at k - 1.
    pub merged: Vec<u32>,
    /// Why a pixel without a component has none.
    unlabelled: Reason,
    /// Pixels of each instance after the last merge, before small ones are dropped; instance k at
    /// k - 1.
    pub before_drop: Vec<u32>,
}

impl InstancePixels {
    /// Drops instances with fewer pixels than the minimum, and numbers the others from 1 in the
    /// order of the merge.
    pub fn new(segmentation: &Segmentation, min_pixels: usize) -> Self {
        let Segmentation { components, merge, post_merge, of_point, .. } = segmentation;
        let of_merge = merge.instance_of_component.iter();
        let last = of_merge.map(|&merged| post_merge.instance[merged as usize - 1]);
        let merged: Vec<u32> = std::iter::once(0).chain(last).collect();
        let count = post_merge.instance.iter().copied().max().unwrap_or(0) as usize;
        let mut sizes = vec![0_u32; count + 1];
        for &label in &components.label {
            sizes[merged[label as usize] as usize] += 1;
        }
        // A method that looks at points may have found an instance none of whose points is seen in
        // the image.
        let mut is_there: Vec<bool> = sizes.iter().map(|&size| size > 0).collect();
        for &label in of_point.iter().flatten() {
            is_there[merged[label as usize] as usize] = true;
        }
        let mut number = vec![0_u32; count + 1];
        let (mut pixels, mut kept) = (Vec::new(), Vec::new());
        for instance in 1..=count {
            if is_there[instance] && sizes[instance] as usize >= min_pixels {
                pixels.push(sizes[instance]);
                kept.push(instance as u32);
                number[instance] = pixels.len() as u32;
            }
        }
        let of_component: Vec<u32> = merged.iter().map(|&merged| number[merged as usize]).collect();
        let of_label = |&label: &u32| of_component[label as usize];
        let instance: Vec<u32> = components.label.iter().map(of_label).collect();
        InstancePixels {
            components: component_counts(components, &instance, pixels.len()),
            instance,
            of_component,
            pixels,
            merged: kept,
            unlabelled: segmentation.unlabelled,
            before_drop: sizes.split_off(1),
        }
    }

    /// Why points of a component have no instance.
    fn reason(&self, component: u32) -> Reason {
        match (component, self.of_component[component as usize]) {
            (0, _) => self.unlabelled,
            (_, 0) => Reason::TooSmall,
            _ => Reason::None,
        }
    }
}

/// Number of components in each of the final instances.
fn component_counts(components: &Components, instance: &[u32], count: usize) -> Vec<u32> {
    let mut seen = vec![false; components.count as usize + 1];
    let mut counts = vec![0; count];
    for (&label, &instance) in components.label.iter().zip(instance) {
        if instance != 0 && !std::mem::replace(&mut seen[label as usize], true) {
            counts[instance as usize - 1] += 1;
        }
    }
    counts
}

/// Labels every point: an object point gets the instance of its pixel, a shadowed one that of a
/// pixel of its class nearby, all others a reason.
pub(super) fn label_points(
    input: &MethodInput,
    segmentation: &Segmentation,
    pixels: &InstancePixels,
) -> PointLabels {
    let MethodInput { cloud, image, mask, objects, .. } = *input;
    let mut labels = PointLabels {
        instance: vec![0; cloud.len()],
        component: vec![0; cloud.len()],
        semantic: mask.raw_ids(cloud),
        reason: mask.reason.clone(),
    };
    let mut set = |point: usize, component: Option<u32>| match component {
        None => labels.reason[point] = Reason::Shadowed,
        Some(component) => {
            let instance = pixels.of_component[component as usize];
            labels.instance[point] = instance;
            labels.reason[point] = pixels.reason(component);
            if instance != 0 {
                labels.component[point] = component;
            }
        }
    };
    let points = objects.points.iter().map(|&point| point as usize);
    if let Some(of_point) = &segmentation.of_point {
        points.for_each(|point| set(point, Some(of_point[point])));
        return labels;
    }
    let label = &segmentation.components.label;
    let seen = objects.pixel.iter().map(|&pixel| image.point_of_pixel.values()[pixel as usize]);
    for (point, &component) in seen.zip(label) {
        set(point as usize, Some(component));
    }
    let pixels_of_points = LazyCell::new(|| BackProjector::new(input));
    for point in points.filter(|&point| image.is_shadowed(point)) {
        set(point, pixels_of_points.source(point).map(|object| label[object]));
    }
    labels
}
