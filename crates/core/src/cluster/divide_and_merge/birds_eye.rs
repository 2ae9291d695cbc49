//! The bird's-eye merge: instances whose regions overlap on the plane become one (paper, section
//! III.E; ALGORITHM section 6).

use super::assigner::Merge;
use super::divide::Components;
use super::regions::{InstanceRegion, classes, regions};
use crate::cluster::authors::birds_eye::last_writer_wins;
use crate::cluster::objects::ObjectPixels;
use crate::cluster::params::BirdsEye;
use crate::cluster::post_merge::PostMerge;
use crate::geometry::disjoint_sets::DisjointSets;

/// Merges the instances of the merge step whose regions overlap, and keeps the regions.
///
/// Regions are taken from the instances' pixels; the class of an instance is the most frequent
/// among them. `params` is `None` where nothing is merged. Where only instances of one class merge
/// and there are no classes, nothing is merged and no region is made.
///
/// Time O(k log k) in the instances and linear in the pairs whose spans along x overlap.
pub fn birds_eye(
    objects: &ObjectPixels,
    components: &Components,
    merge: &Merge,
    params: Option<BirdsEye>,
) -> PostMerge {
    let Some(params) = params else {
        return PostMerge::unchanged(merge.count);
    };
    let classes = classes(objects, components, merge);
    if params.same_class && classes.iter().all(|&class| class == 0) {
        return PostMerge { classes, ..PostMerge::unchanged(merge.count) };
    }
    let regions = regions(objects, components, merge, params);
    let may_merge =
        |a: usize, b: usize| !params.same_class || (classes[a] != 0 && classes[a] == classes[b]);
    let instance = match params.transitive {
        true => transitive(&regions, may_merge, params.margin),
        false => last_writer_wins(regions.clone(), may_merge, params.margin),
    };
    PostMerge { instance, classes, regions, ..PostMerge::default() }
}

/// A chain of overlaps is one instance. Regions are swept along x.
fn transitive(
    regions: &[Option<InstanceRegion>],
    may_merge: impl Fn(usize, usize) -> bool,
    margin: f64,
) -> Vec<u32> {
    let mut order: Vec<(usize, &InstanceRegion)> = regions
        .iter()
        .enumerate()
        .filter_map(|(instance, region)| region.as_ref().map(|region| (instance, region)))
        .collect();
    order.sort_by(|a, b| a.1.low[0].total_cmp(&b.1.low[0]));
    let mut sets = DisjointSets::new(regions.len());
    let mut open: Vec<(usize, &InstanceRegion)> = Vec::new();
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
