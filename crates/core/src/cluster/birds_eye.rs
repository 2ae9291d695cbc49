//! The bird's-eye merge: instances whose regions overlap on the plane become one (paper, section
//! III.E; ALGORITHM section 6).

use std::cell::OnceCell;

use super::divide::Components;
use super::fragments::Fragment;
use super::merge::Merge;
use super::objects::ObjectPixels;
use super::params::{BirdsEye, Region};
use crate::geometry::disjoint_sets::DisjointSets;
use crate::geometry::footprint::{PlanePoint, convex_hull, distance, minimum_area_rectangle};
use crate::semantics::ObjectMask;

/// For each instance of the merge step (instance k at k - 1) the instance it belongs to after the
/// bird's-eye merge, numbered from 1 in the order of their first members.
///
/// Regions are taken from the instances' pixels; the class of an instance is the most frequent
/// among them. Time O(k log k) in the instances and linear in the pairs whose spans along x
/// overlap.
pub fn birds_eye(
    objects: &ObjectPixels,
    components: &Components,
    merge: &Merge,
    params: Option<BirdsEye>,
) -> Vec<u32> {
    let Some(params) = params else {
        return (1..=merge.count).collect();
    };
    let classes = classes(objects, components, merge);
    if params.same_class && classes.iter().all(|&class| class == 0) {
        return (1..=merge.count).collect();
    }
    let points = points(objects, components, merge, params.grown_pixels_only);
    let regions: Vec<Option<Outline>> =
        points.into_iter().map(|points| Outline::new(points, params.region)).collect();
    let may_merge =
        |a: usize, b: usize| !params.same_class || (classes[a] != 0 && classes[a] == classes[b]);
    if params.transitive {
        transitive(&regions, may_merge, params.margin)
    } else {
        last_writer_wins(regions, may_merge, params.margin)
    }
}

/// The instances of the merge step as fragments, for [`assemble`](super::assemble).
pub fn fragments(
    objects: &ObjectPixels,
    components: &Components,
    merge: &Merge,
    mask: &ObjectMask,
) -> Vec<Fragment> {
    let classes = classes(objects, components, merge);
    let points = points(objects, components, merge, false);
    let fragment = |(class, points): (u16, Vec<PlanePoint>)| Fragment {
        class,
        family: mask.families[usize::from(class)],
        lookalikes: mask.lookalikes[usize::from(class)],
        size: mask.sizes[usize::from(class)],
        hull: convex_hull(&points),
        pixels: points.len() as u32,
    };
    classes.into_iter().zip(points).map(fragment).collect()
}

/// A region on the plane: the axis-aligned box around its points, and its outline once that is
/// asked for.
#[derive(Debug, Clone)]
struct Outline {
    region: Region,
    points: Vec<PlanePoint>,
    corners: OnceCell<Vec<PlanePoint>>,
    low: PlanePoint,
    high: PlanePoint,
}

impl Outline {
    /// `None` of no points: such a region overlaps nothing.
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
        Some(Outline { region, points, corners: OnceCell::new(), low, high })
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

    fn overlaps(&self, other: &Outline, margin: f64) -> bool {
        let boxes = (0..2).all(|axis| {
            self.high[axis].min(other.high[axis]) + margin >= self.low[axis].max(other.low[axis])
        });
        boxes && (self.region == Region::Box || distance(self.corners(), other.corners()) <= margin)
    }

    fn absorb(&mut self, other: &Outline) {
        for axis in 0..2 {
            self.low[axis] = self.low[axis].min(other.low[axis]);
            self.high[axis] = self.high[axis].max(other.high[axis]);
        }
    }
}

/// The points of each instance on the plane.
fn points(
    objects: &ObjectPixels,
    components: &Components,
    merge: &Merge,
    grown_pixels_only: bool,
) -> Vec<Vec<PlanePoint>> {
    let mut points: Vec<Vec<PlanePoint>> = vec![Vec::new(); merge.count as usize];
    let mut add = |object: usize, label: u32| {
        let instance = merge.instance_of_component[label as usize - 1];
        let [x, y, _] = objects.position[object];
        points[instance as usize - 1].push([f64::from(x), f64::from(y)]);
    };
    if grown_pixels_only {
        for &(object, label) in &components.grown {
            add(object as usize, label);
        }
    } else {
        for (object, &label) in components.label.iter().enumerate().filter(|&(_, &l)| l != 0) {
            add(object, label);
        }
    }
    points
}

/// The most frequent class of each instance's pixels; ties go to the lower class.
fn classes(objects: &ObjectPixels, components: &Components, merge: &Merge) -> Vec<u16> {
    let labelled = components.label.iter().enumerate().filter(|&(_, &label)| label != 0);
    let mut members: Vec<(u32, u16)> = labelled
        .map(|(object, &label)| {
            let instance = merge.instance_of_component[label as usize - 1];
            (instance - 1, objects.class[object])
        })
        .collect();
    members.sort_unstable();
    let mut best = vec![(0, 0); merge.count as usize];
    for run in members.chunk_by(|a, b| a == b) {
        let (instance, class) = run[0];
        if run.len() > best[instance as usize].0 {
            best[instance as usize] = (run.len(), class);
        }
    }
    best.into_iter().map(|(_, class)| class).collect()
}

fn transitive(
    regions: &[Option<Outline>],
    may_merge: impl Fn(usize, usize) -> bool,
    margin: f64,
) -> Vec<u32> {
    let mut order: Vec<(usize, &Outline)> = regions
        .iter()
        .enumerate()
        .filter_map(|(instance, region)| region.as_ref().map(|region| (instance, region)))
        .collect();
    order.sort_by(|a, b| a.1.low[0].total_cmp(&b.1.low[0]));
    let mut sets = DisjointSets::new(regions.len());
    let mut open: Vec<(usize, &Outline)> = Vec::new();
    for (instance, region) in order {
        open.retain(|(_, other)| other.high[0] + margin >= region.low[0]);
        for &(other, outline) in &open {
            if may_merge(instance, other)
                && sets.root(instance) != sets.root(other)
                && region.overlaps(outline, margin)
            {
                sets.join(instance, other);
            }
        }
        open.push((instance, region));
    }
    sets.numbered()
}

/// One pass over all pairs i < j; j takes i's label and the union of the two boxes.
fn last_writer_wins(
    mut regions: Vec<Option<Outline>>,
    may_merge: impl Fn(usize, usize) -> bool,
    margin: f64,
) -> Vec<u32> {
    let mut label: Vec<usize> = (0..regions.len()).collect();
    for i in 0..regions.len() {
        let Some(first) = regions[i].clone() else {
            continue;
        };
        for j in i + 1..regions.len() {
            if let Some(second) = &mut regions[j]
                && may_merge(i, j)
                && first.overlaps(second, margin)
            {
                label[j] = label[i];
                second.absorb(&first);
            }
        }
    }
    numbered(&label)
}

/// Numbers labels from 1 in the order in which they first appear.
fn numbered(labels: &[usize]) -> Vec<u32> {
    let mut number = vec![0; labels.len()];
    let mut next = 0;
    labels
        .iter()
        .map(|&label| {
            if number[label] == 0 {
                next += 1;
                number[label] = next;
            }
            number[label]
        })
        .collect()
}
