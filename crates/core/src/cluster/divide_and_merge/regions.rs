//! The instances of the merge step on the bird's-eye plane: their points, regions and classes.

use std::sync::OnceLock;

use super::assigner::Merge;
use super::divide::Components;
use crate::cluster::objects::ObjectPixels;
use crate::cluster::params::{BirdsEye, Region};
use crate::geometry::footprint::{PlanePoint, convex_hull, distance, minimum_area_rectangle};

/// The region that stands for an instance on the plane.
#[derive(Debug, Clone, PartialEq)]
pub struct InstanceRegion {
    region: Region,
    /// Its points, metres; none where the region is a box.
    points: Vec<PlanePoint>,
    /// Computed when first needed.
    corners: OnceLock<Vec<PlanePoint>>,
    pub(in crate::cluster) low: PlanePoint,
    pub(in crate::cluster) high: PlanePoint,
}

impl InstanceRegion {
    /// The region around points in metres. `None` without points: such a region overlaps nothing.
    fn new(points: Vec<PlanePoint>, region: Region) -> Option<Self> {
        if points.is_empty() {
            return None;
        }
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for point in &points {
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        let points = if region == Region::Box { Vec::new() } else { points };
        Some(InstanceRegion { region, points, corners: OnceLock::new(), low, high })
    }

    fn corners(&self) -> &[PlanePoint] {
        self.corners.get_or_init(|| {
            let hull = convex_hull(&self.points);
            match (self.region, minimum_area_rectangle(&hull)) {
                (Region::Rectangle, Some(rectangle)) => rectangle.corners().to_vec(),
                _ => hull,
            }
        })
    }

    /// Metres between two regions; of boxes the greater of the gaps along the axes.
    pub fn gap(&self, other: &InstanceRegion) -> f64 {
        if self.region != Region::Box {
            return distance(self.corners(), other.corners());
        }
        let along = |axis: usize| {
            self.low[axis].max(other.low[axis]) - self.high[axis].min(other.high[axis])
        };
        along(0).max(along(1)).max(0.0)
    }

    /// Whether two regions overlap or are at most `margin` metres apart.
    pub(in crate::cluster) fn overlaps(&self, other: &InstanceRegion, margin: f64) -> bool {
        let boxes = (0..2).all(|axis| {
            self.high[axis].min(other.high[axis]) + margin >= self.low[axis].max(other.low[axis])
        });
        boxes && (self.region == Region::Box || distance(self.corners(), other.corners()) <= margin)
    }
}

/// The regions of all instances of the merge step; instance k at k - 1. `None` for an instance
/// without points, which may be where only grown pixels count.
pub fn regions(
    objects: &ObjectPixels,
    components: &Components,
    merge: &Merge,
    params: BirdsEye,
) -> Vec<Option<InstanceRegion>> {
    let points = points(objects, components, merge, params.grown_pixels_only);
    points.into_iter().map(|points| InstanceRegion::new(points, params.region)).collect()
}

/// The points of each instance on the plane.
pub(in crate::cluster) fn points(
    objects: &ObjectPixels,
    components: &Components,
    merge: &Merge,
    grown_pixels_only: bool,
) -> Vec<Vec<PlanePoint>> {
    let instance = |label: u32| merge.instance_of_component[label as usize - 1] as usize - 1;
    let members: Vec<(u32, u32)> = match grown_pixels_only {
        true => components.grown.clone(),
        false => {
            let labelled = (0..).zip(components.label.iter().copied());
            labelled.filter(|&(_, label)| label != 0).collect()
        }
    };
    let mut counts = vec![0; merge.count as usize];
    members.iter().for_each(|&(_, label)| counts[instance(label)] += 1);
    let mut points: Vec<Vec<PlanePoint>> = counts.into_iter().map(Vec::with_capacity).collect();
    for (object, label) in members {
        let [x, y, _] = objects.position[object as usize];
        points[instance(label)].push([f64::from(x), f64::from(y)]);
    }
    points
}

/// The most frequent class of each instance's pixels; ties go to the lower class.
pub(in crate::cluster) fn classes(
    objects: &ObjectPixels,
    components: &Components,
    merge: &Merge,
) -> Vec<u16> {
    let labelled = || {
        let labelled = components.label.iter().enumerate().filter(|&(_, &label)| label != 0);
        labelled.map(|(object, &label)| {
            let instance = merge.instance_of_component[label as usize - 1];
            (instance - 1, objects.class[object])
        })
    };
    // Nearly all instances have pixels of one class.
    let mut first = vec![None; merge.count as usize];
    let mut is_mixed = vec![false; merge.count as usize];
    for (instance, class) in labelled() {
        is_mixed[instance as usize] |= *first[instance as usize].get_or_insert(class) != class;
    }
    let mut members: Vec<(u32, u16)> =
        labelled().filter(|&(instance, _)| is_mixed[instance as usize]).collect();
    members.sort_unstable();
    let mut best: Vec<(usize, u16)> =
        first.into_iter().map(|class| (0, class.unwrap_or(0))).collect();
    for run in members.chunk_by(|a, b| a == b) {
        let (instance, class) = run[0];
        if run.len() > best[instance as usize].0 {
            best[instance as usize] = (run.len(), class);
        }
    }
    best.into_iter().map(|(_, class)| class).collect()
}
