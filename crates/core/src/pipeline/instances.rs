//! Instances described: class, confidence, box, counts, and their coarse class where there are no
//! classes.

use super::appearance::Appearance;
use super::class_votes::{class_weights, majority};
use super::labels::InstancePixels;
use crate::cloud::shape::{ShapeMeasures, classify_background, classify_shape};
use crate::cloud::{Classification, CoarseClass, Instance, PointLabels, UprightBox};
use crate::cluster::tree::MergeTree;
use crate::cluster::tree::calibration::probability;
use crate::cluster::{MethodInput, Segmentation};
use crate::semantics::MaskSource;
use crate::semantics::ground::GroundHeights;

/// Describes the instances of a segmentation, given where the mask came from; the points of an
/// instance take its class.
pub(super) fn describe(
    input: &MethodInput,
    (source, segmentation): (MaskSource, &Segmentation),
    pixels: &InstancePixels,
    labels: &mut PointLabels,
) -> Vec<Instance> {
    let MethodInput { cloud, mask, objects, .. } = *input;
    let members = Members::new(&objects.points, &labels.instance, pixels.pixels.len());
    let weights = class_weights(cloud, mask);
    let mut instances = Vec::with_capacity(pixels.pixels.len());
    for id in 1..=pixels.pixels.len() as u32 {
        let points = members.of(id);
        let Some(bounds) = UprightBox::around(cloud, points) else {
            continue;
        };
        let (class, semantic) = majority(points, &mask.class, &labels.semantic, weights.as_deref());
        let confidence = weights.as_ref().map(|weights| {
            let own = points.iter().filter(|&&point| mask.class[point as usize] == class);
            own.map(|&point| f64::from(weights[point as usize])).sum::<f64>() / points.len() as f64
        });
        for &point in points {
            labels.semantic[point as usize] = semantic;
        }
        instances.push(Instance {
            id,
            semantic,
            class_name: source.class_name(class).to_owned(),
            confidence,
            coarse_class: None,
            points: points.len() as u32,
            pixels: pixels.pixels[id as usize - 1],
            components: pixels.components[id as usize - 1],
            bounds,
        });
    }
    if !mask.has_classes() {
        let measured;
        let ground = match &segmentation.ground {
            Some(known) => known,
            None => {
                let sensor = input.image.sensor_place();
                measured = GroundHeights::new(cloud, &mask.reason, sensor);
                &measured
            }
        };
        let tree = segmentation.post_merge.tree.as_ref();
        let of_pixels = (&*pixels.instance, pixels.pixels.len());
        let mut appearance = Appearance::new(input, of_pixels, ground);
        for instance in &mut instances {
            let (id, points) = (instance.id, members.of(instance.id));
            let measures = appearance.measures(cloud, id, points, &instance.bounds);
            let merged = pixels.merged[id as usize - 1];
            instance.coarse_class = Some(coarse_class(measures, merged, tree));
        }
    }
    instances
}

/// The coarse class of an instance of the last merge: that of its body if the cut chose it as an
/// object, else one of background; where no tree was cut, the one that its shape is likeliest of.
fn coarse_class(measures: ShapeMeasures, merged: u32, tree: Option<&MergeTree>) -> Classification {
    let Some(tree) = tree else { return classify_shape(measures) };
    match tree.object(merged) {
        Some(score) => Classification {
            class: CoarseClass::Body(score.body),
            probability: probability(score, measures.smoothness()),
            measures,
        },
        None => classify_background(measures),
    }
}

/// The points of all instances.
pub(super) struct Members {
    /// Instance after instance.
    points: Vec<u32>,
    /// Those of instance k are points\[start\[k - 1\]..start\[k\]\].
    start: Vec<usize>,
}

impl Members {
    /// Of the object points those of each instance.
    pub fn new(points: &[u32], instance: &[u32], count: usize) -> Self {
        let labelled = || {
            let ids = points.iter().map(|&p| (p, instance[p as usize] as usize));
            ids.filter(|&(_, id)| id != 0)
        };
        let mut start = vec![0; count + 1];
        for (_, id) in labelled() {
            start[id] += 1;
        }
        for id in 1..=count {
            start[id] += start[id - 1];
        }
        let mut next = start.clone();
        let mut points = vec![0; start[count]];
        for (point, id) in labelled() {
            let place = &mut next[id - 1];
            points[*place] = point;
            *place += 1;
        }
        Members { points, start }
    }

    pub fn of(&self, id: u32) -> &[u32] {
        &self.points[self.start[id as usize - 1]..self.start[id as usize]]
    }
}
