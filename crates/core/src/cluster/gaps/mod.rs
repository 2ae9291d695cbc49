//! Merge by gaps: pieces are put together by the gaps between them, for objects without a class.
//! Ours; preset `best` makes it in place of the bird's-eye merge (paper, III.E), which needs
//! classes.
//!
//! No size is known, so only gaps count, and how densely the sensor samples:
//!
//! 1. Two pixels *touch* if they are near in space: across the ground nearer than
//!    [`GapMerge::across`], in height nearer than [`GapMerge::upright`] (both together as an
//!    ellipsoid), and both a little more where the sensor's own columns and rows lie farther apart.
//!    Height may be bridged farther because objects stand beside one another, seldom on one
//!    another, while windows, shadows of a railing and dark paint cut objects level.
//! 2. Pieces with pixels that touch are one.
//! 3. A leftover, a piece of fewer than [`GapMerge::leftover`] pixels, shows too little of itself
//!    to be told from a splinter of what stands next to it: it joins the piece nearest to it within
//!    [`GapMerge::leftover_reach`] times the reach of touching. The nearest pair goes first.
//!
//! What touches nothing stays as it is, however small.
//!
//! Neighbouring pixels are connected where they touch, too, not by the angle: at range d and a step
//! a between beams the angle joins across a depth of d sin(a) / tan(theta), 2 m at 50 m.
//!
//! Time O(M log M) in the object pixels for a bounded number of pixels per cubic metre.

mod groups;
mod space;

use std::cmp::Ordering;

use rustc_hash::FxHashMap;

use super::divide_and_merge::assigner::Merge;
use super::divide_and_merge::divide::Components;
use super::divide_and_merge::merge_by_votes;
use super::method::{Method, MethodInput, Segmentation};
use super::objects::ObjectPixels;
use super::params::{ClusterParams, GapMerge};
use super::post_merge::PostMerge;
use groups::Groups;
use space::{Cell, Space};

/// The method of preset `best` for objects without classes: connected components, then the merge by
/// gaps.
#[derive(Debug)]
pub struct MergeByGaps<'a> {
    /// Parameters of the components.
    pub params: &'a ClusterParams,
    /// Parameters of the merge.
    pub merge: &'a GapMerge,
}

impl Method for MergeByGaps<'_> {
    fn name(&self) -> &'static str {
        "merge-by-gaps"
    }

    fn parameters(&self) -> serde_json::Value {
        serde_json::json!(self.params)
    }

    fn segment(&self, input: &MethodInput) -> Segmentation {
        let mut segmentation = merge_by_votes(input.objects, self.params);
        let Segmentation { components, merge, .. } = &segmentation;
        segmentation.post_merge = join_by_gaps(input.objects, components, merge, self.merge);
        segmentation
    }
}

/// Puts the instances of the merge step together by the gaps between their pixels. Returns the
/// group of each (instance k at k - 1), groups numbered from 1 in the order of their first members,
/// and the joins in the order in which they were made.
pub fn join_by_gaps(
    objects: &ObjectPixels,
    components: &Components,
    merge: &Merge,
    params: &GapMerge,
) -> PostMerge {
    let mut groups = Groups::new(components, merge);
    let space = Space::new(objects, &groups, params);
    join_touching(objects, &space, &mut groups);
    join_leftovers(objects, &space, &mut groups, params);
    PostMerge { instance: groups.sets.numbered(), joins: groups.joins, ..PostMerge::default() }
}

/// Pieces with pixels that touch become one.
fn join_touching(objects: &ObjectPixels, space: &Space, groups: &mut Groups) {
    for cell in &space.cells {
        for pair in space.objects(cell).windows(2) {
            groups.join_pixels(objects, pair[0], pair[1], None);
        }
    }
    space.pairs_in_reach(|cell, other| {
        let (own, others) = (space.objects(cell), space.objects(other));
        if groups.of(own[0]) == groups.of(others[0]) {
            return;
        }
        let mut pairs = own.iter().flat_map(|&a| others.iter().map(move |&b| (a, b)));
        let touch =
            |&(a, b): &(u32, u32)| objects.squared_separation(a as usize, b as usize) <= 1.0;
        if let Some((a, b)) = pairs.find(touch) {
            groups.join_pixels(objects, a, b, None);
        }
    });
}

/// Leftovers join the nearest piece in reach, the nearest pair first.
fn join_leftovers(objects: &ObjectPixels, space: &Space, groups: &mut Groups, params: &GapMerge) {
    let is_leftover: Vec<bool> =
        groups.pixels.iter().map(|&pixels| pixels < params.leftover).collect();
    let root_of: Vec<usize> =
        (0..groups.pixels.len()).map(|piece| groups.sets.root(piece)).collect();
    let root = |object: u32| root_of[groups.piece[object as usize] as usize];
    let mut nearest: FxHashMap<(usize, usize), (f64, u32, u32)> = FxHashMap::default();
    let chosen = |cell: &Cell| is_leftover[root(space.objects(cell)[0])];
    space.pairs_of(chosen, params.leftover_reach, |cell, other| {
        let (own, others) = (space.objects(cell), space.objects(other));
        let (a, b) = (root(own[0]), root(others[0]));
        if a == b {
            return;
        }
        let pairs = own.iter().flat_map(|&p| others.iter().map(move |&q| (p, q)));
        let apart = pairs.filter_map(|(p, q)| {
            within(objects, p, q, params.leftover_reach).map(|apart| (apart, p.min(q), p.max(q)))
        });
        if let Some(found) = apart.min_by(order) {
            let least = nearest.entry((a.min(b), a.max(b))).or_insert(found);
            if order(&found, least).is_lt() {
                *least = found;
            }
        }
    });
    let mut pairs: Vec<_> = nearest.into_iter().collect();
    pairs.sort_unstable_by(|a, b| order(&a.1, &b.1));
    for (_, (_, p, q)) in pairs {
        let [one, other] = [p, q].map(|object| groups.of(object));
        let fewer = groups.pixels[one].min(groups.pixels[other]);
        if fewer < params.leftover {
            groups.join_pixels(objects, p, q, Some(fewer));
        }
    }
}

/// Pairs of pixels by their separation, ties by the pixels.
fn order(a: &(f64, u32, u32), b: &(f64, u32, u32)) -> Ordering {
    a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2)))
}

/// The separation of two pixels if it is at most that.
fn within(objects: &ObjectPixels, a: u32, b: u32, at_most: f64) -> Option<f64> {
    let squared = f64::from(objects.squared_separation(a as usize, b as usize));
    (squared <= at_most * at_most).then(|| squared.sqrt())
}
#[cfg(test)]
mod tests {
    use super::space::{pack, unpack};
    use super::*;
    use crate::cluster::post_merge::{Evidence, Join};

    fn params() -> GapMerge {
        ClusterParams::best().gaps.expect("best joins by gaps")
    }

    /// Pixels at those places, all with one reach, in pieces numbered from 1.
    fn scene(places: &[[f32; 3]], piece: &[u32]) -> (ObjectPixels, Components, Merge) {
        let count = piece.iter().copied().max().unwrap_or(0);
        let reach = [params().across as f32, params().upright as f32];
        let objects = ObjectPixels {
            position: places.to_vec(),
            pixel: (0..places.len() as u32).collect(),
            reach: vec![reach; places.len()],
            ..ObjectPixels::default()
        };
        let components = Components { label: piece.to_vec(), count, ..Components::default() };
        let instance_of_component = (1..=count).collect();
        (objects, components, Merge { instance_of_component, count, steps: Vec::new() })
    }

    fn groups(places: &[[f32; 3]], piece: &[u32], params: &GapMerge) -> (Vec<u32>, Vec<Join>) {
        let (objects, components, merge) = scene(places, piece);
        let found = join_by_gaps(&objects, &components, &merge, params);
        (found.instance, found.joins)
    }

    #[test]
    fn what_stands_apart_stays_apart_and_what_lies_above_joins() {
        let alone = GapMerge { leftover: 0, ..params() };
        // Two posts half a metre apart; a third part 0.7 m above the first.
        let places = [[5.0, 0.0, 0.0], [5.0, 0.5, 0.0], [5.0, 0.0, 0.7]];
        let (groups, joins) = groups(&places, &[1, 2, 3], &alone);
        assert_eq!(groups, [1, 2, 1]);
        assert_eq!((joins[0].target, joins[0].query), (1, 3));
        assert_eq!(joins[0].evidence, Evidence::Touching);
        assert!((joins[0].gap - 0.7).abs() < 1e-6, "{joins:?}");
    }

    #[test]
    fn a_leftover_joins_the_nearest_and_larger_pieces_wait_for_no_one() {
        let mut places = Vec::new();
        let mut piece = Vec::new();
        for (number, y) in [(1, 0.0), (2, 1.3)] {
            for pixel in 0..20 {
                places.push([5.0, y, 0.1 * pixel as f32]);
                piece.push(number);
            }
        }
        // A pixel 0.75 m from the first and 0.55 m from the second; another out of reach of all.
        places.extend([[5.0, 0.75, 1.0], [9.0, 0.75, 1.0]]);
        piece.extend([3, 4]);
        let (found, joins) = groups(&places, &piece, &params());
        assert_eq!(found, [1, 2, 2, 3]);
        assert_eq!(joins.len(), 1);
        assert_eq!(joins[0].evidence, Evidence::Leftover { pixels: 1 });
        let alone = GapMerge { leftover: 0, ..params() };
        assert_eq!(groups(&places, &piece, &alone).0, [1, 2, 3, 4]);
    }

    #[test]
    fn pixels_without_a_component_have_no_piece() {
        let places = [[5.0, 0.0, 0.0], [5.0, 0.1, 0.0], [5.0, 0.2, 0.0]];
        assert_eq!(groups(&places, &[1, 0, 2], &params()).0, [1, 1]);
        assert!(groups(&[], &[], &params()).0.is_empty());
    }

    #[test]
    fn keys_keep_the_order_of_cells() {
        for cell in [[0, 0, 0], [-3, 7, -1], [1000, -1000, 5]] {
            assert_eq!(unpack(pack(cell)), cell);
        }
        let keys = [[-1, 5, 5], [0, -9, 9], [0, -8, -9], [0, -8, 0]].map(pack);
        assert!(keys.is_sorted(), "{keys:?}");
    }

    proptest::proptest! {
        /// Against all pairs, with reaches of their own.
        #[test]
        fn cells_find_all_that_touch(
            points in proptest::collection::vec((-12..12_i8, -12..12_i8, -6..6_i8, 0..4_u8), 1..70),
        ) {
            let place = |p: &(i8, i8, i8, u8)| [p.0, p.1, p.2].map(|x| f32::from(x) * 0.21 + 0.05);
            let places: Vec<[f32; 3]> = points.iter().map(place).collect();
            let pieces: Vec<u32> = (1..=points.len() as u32).collect();
            let (mut objects, components, merge) = scene(&places, &pieces);
            for (reach, point) in objects.reach.iter_mut().zip(&points) {
                let wider = 0.2 * f32::from(point.3);
                *reach = [reach[0] + wider, reach[1] + wider / 3.0];
            }
            let mut expected: Vec<usize> = (0..points.len()).collect();
            for a in 0..points.len() {
                for b in 0..a {
                    if objects.separation(a, b) <= 1.0 {
                        let (from, to) = (expected[a], expected[b]);
                        expected.iter_mut().filter(|e| **e == from).for_each(|e| *e = to);
                    }
                }
            }
            let alone = GapMerge { leftover: 0, ..params() };
            let joined = join_by_gaps(&objects, &components, &merge, &alone);
            let (found, joins) = (joined.instance, joined.joins);
            for a in 0..points.len() {
                for b in 0..a {
                    assert_eq!(expected[a] == expected[b], found[a] == found[b], "{a} and {b}");
                }
            }
            let count = found.iter().max().copied().unwrap_or(0) as usize;
            assert_eq!(joins.len(), points.len() - count);
        }
    }
}
