//! Instances described: class, confidence, box, counts, and their coarse class where there are no
//! classes.

use std::collections::BTreeMap;

use super::appearance::Appearance;
use super::labels::InstancePixels;
use crate::cloud::point_cloud::PointCloud;
use crate::cloud::shape::{ShapeMeasures, classify_background, classify_shape};
use crate::cloud::{Classification, CoarseClass, Instance, PointLabels, UprightBox};
use crate::cluster::MethodInput;
use crate::cluster::tree::MergeTree;
use crate::cluster::tree::calibration::probability;
use crate::geometry::statistics::most_voted;
use crate::semantics::{MaskSource, ObjectMask};

/// Describes the instances, given where the mask came from and the tree that they are cut from, if
/// they are; the points of an instance take its class.
pub(super) fn describe(
    input: &MethodInput,
    (source, tree): (MaskSource, Option<&MergeTree>),
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
        let of_pixels = (&*pixels.instance, pixels.pixels.len());
        let mut appearance = Appearance::new(input, &labels.reason, of_pixels);
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
struct Members {
    /// Instance after instance.
    points: Vec<u32>,
    /// Those of instance k are points\[start\[k - 1\]..start\[k\]\].
    start: Vec<usize>,
}

impl Members {
    /// Of the object points those of each instance.
    fn new(points: &[u32], instance: &[u32], count: usize) -> Self {
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

    fn of(&self, id: u32) -> &[u32] {
        &self.points[self.start[id as usize - 1]..self.start[id as usize]]
    }
}

/// What each of N points counts in the vote on the class of its instance: the probability of its
/// class, so what is left of that of its first one where neighbours corrected it. `None`: all count
/// alike.
fn class_weights(cloud: &PointCloud, mask: &ObjectMask) -> Option<Vec<f32>> {
    let mut weights = cloud.confidence.clone()?;
    for &(point, _) in &mask.corrected {
        let weight = &mut weights[point as usize];
        *weight = 1.0 - *weight;
    }
    Some(weights)
}

/// The class of some points with most votes, and within it the raw id with most. Ties go to the
/// lower number, and where no point has any weight, all count alike.
fn majority(points: &[u32], class: &[u16], raw: &[u16], weights: Option<&[f32]>) -> (u16, u16) {
    let ids = |&p: &u32| (class[p as usize], raw[p as usize]);
    if let [first, rest @ ..] = points
        && rest.iter().all(|point| ids(point) == ids(first))
    {
        return ids(first);
    }
    let weighed = |weight: &dyn Fn(u32) -> f64| {
        let mut votes: BTreeMap<(u16, u16), f64> = BTreeMap::new();
        for point in points {
            *votes.entry(ids(point)).or_default() += weight(*point);
        }
        votes
    };
    let votes = match weights {
        Some(weights) => weighed(&|point| f64::from(weights[point as usize])),
        None => weighed(&|_| 1.0),
    };
    let votes = match votes.values().all(|&votes| votes == 0.0) {
        true => weighed(&|_| 1.0),
        false => votes,
    };
    let mut of_class: BTreeMap<u16, f64> = BTreeMap::new();
    for (&(class, _), votes) in &votes {
        *of_class.entry(class).or_default() += votes;
    }
    let class = most_voted(of_class.into_iter()).unwrap_or(0);
    let ids = votes.into_iter().filter(|(id, _)| id.0 == class);
    (class, most_voted(ids.map(|(id, votes)| (id.1, votes))).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surer_points_decide_and_ties_go_to_the_lower() {
        let (class, raw) = ([1, 1, 2, 2, 2], [10, 10, 30, 30, 254]);
        let points = [0, 1, 2, 3, 4];
        assert_eq!(majority(&points, &class, &raw, None), (2, 30));
        assert_eq!(majority(&points, &class, &raw, Some(&[0.9, 0.9, 0.3, 0.3, 0.4])), (1, 10));
        assert_eq!(majority(&points, &class, &raw, Some(&[0.1, 0.1, 0.1, 0.1, 0.4])), (2, 254));
        assert_eq!(majority(&points[1..3], &class, &raw, None), (1, 10));
        assert_eq!(majority(&points, &class, &raw, Some(&[0.0; 5])), (2, 30));
        assert_eq!(majority(&points[..2], &class, &raw, None), (1, 10));
        assert_eq!(majority(&[], &class, &raw, None), (0, 0));
    }

    #[test]
    fn a_corrected_point_counts_what_its_first_class_left() {
        let cloud = PointCloud::new(vec![1.0, 2.0], vec![0.0; 2], vec![0.0; 2]).unwrap();
        let cloud = cloud.with(|columns| columns.confidence = Some(vec![0.9, 0.4])).unwrap();
        let mask = ObjectMask { corrected: vec![(1, 10)], ..ObjectMask::default() };
        assert_eq!(class_weights(&cloud, &mask), Some(vec![0.9, 0.6]));
        let given = PointCloud::default();
        assert_eq!(class_weights(&given, &mask), None);
    }
}
