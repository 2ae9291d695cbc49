//! Merge by size: fragments of one object are put together where both fit its class. Ours; preset
//! `best` makes it in place of the paper's overlap test (section III.E).
//!
//! An occluded or dark object comes out of the votes in pieces. Two pieces of one class, or of two
//! that are easily taken for each other, belong together when they all but touch, or when the
//! rectangle around both still fits an object of that class; a wide gap between them asks for a
//! tight fit. The pair with the least evidence against it goes first, and outlines grow as pieces
//! join. Classes that only look alike, a person and a rider, are cut apart, since the two do meet:
//! pieces of them must touch, and fit what the larger is. The outline of a few pixels says little:
//! they wait until the larger pieces around them have become what they are.
//!
//! W is the width of the class. Two fragments of one family are one if their outlines are nearer
//! than [`FragmentMerge::touching_gap`] and the rectangle around both is no wider than
//! [`FragmentMerge::widest`]. Two of one class are also one if the rectangle fits within
//! [`FragmentMerge::longest_sides`], which shrink as the gap grows.

mod assembly;
mod cells;
pub mod group;

use super::divide_and_merge::{self, regions};
use super::method::{Method, MethodInput, Segmentation};
use super::params::{ClusterParams, FragmentMerge};
use super::post_merge::PostMerge;
use crate::geometry::footprint::convex_hull;
use assembly::Assembly;
pub use group::{Fragment, FragmentClass, Group, SizeTest};

/// The method of preset `best` for objects with classes: connected components, then assembly by
/// size.
///
/// The components are those of divide and merge; that votes decide which of them are one changes no
/// figure in `docs/results.md`.
#[derive(Debug)]
pub struct MergeBySize<'a> {
    /// Parameters of the components.
    pub params: &'a ClusterParams,
    /// Parameters of the merge.
    pub merge: &'a FragmentMerge,
}

impl Method for MergeBySize<'_> {
    fn name(&self) -> &'static str {
        "merge-by-size"
    }

    fn parameters(&self) -> serde_json::Value {
        serde_json::json!(self.params)
    }

    fn segment(&self, input: &MethodInput) -> Segmentation {
        let mut segmentation = divide_and_merge::merge_by_votes(input.objects, self.params);
        let fragments = fragments(input, &segmentation);
        segmentation.post_merge = assemble(&fragments, self.merge);
        segmentation
    }
}

/// The instances of the merge step as fragments.
fn fragments(input: &MethodInput, segmentation: &Segmentation) -> Vec<Fragment> {
    let (objects, mask) = (input.objects, input.mask);
    let Segmentation { components, merge, .. } = segmentation;
    let classes = regions::classes(objects, components, merge);
    let points = regions::points(objects, components, merge, false);
    let fragment = |(number, points): (u16, Vec<_>)| Fragment {
        class: FragmentClass {
            number,
            family: mask.families[usize::from(number)],
            lookalikes: mask.lookalikes[usize::from(number)],
            size: mask.sizes[usize::from(number)],
        },
        hull: convex_hull(&points),
        pixels: points.len() as u32,
    };
    classes.into_iter().zip(points).map(fragment).collect()
}

/// Puts fragments together. Returns for each (from 0) the group it belongs to, groups numbered from
/// 1 in the order of their first fragments, the joins in the order in which they were made, and the
/// last outlines.
///
/// 1. Fragments that touch join as they are.
/// 2. Of all pairs that belong together the one with the least evidence against it joins. Its
///    outline grows and is compared with its neighbours anew.
///
/// The evidence against a pair is the gap, plus a little for the size of the rectangle around both,
/// plus a delay for groups of few pixels.
///
/// Time grows with the pairs of fragments nearer than their class is wide. Of these only the pairs
/// that come up before either has joined another are measured.
pub fn assemble(fragments: &[Fragment], params: &FragmentMerge) -> PostMerge {
    let mut assembly = Assembly::new(fragments, params);
    assembly.join_touching();
    assembly.join_cheapest_first();
    assembly.finish()
}

#[cfg(test)]
mod tests {
    use super::group::FragmentClass;
    use super::*;
    use crate::cloud::taxonomy::ClassSize;
    use crate::geometry::footprint::{PlanePoint, convex_hull};

    const CAR: ClassSize = ClassSize { length: 4.5, width: 1.9 };
    const ONE: FragmentClass =
        FragmentClass { number: 1, family: 1, lookalikes: 0, size: Some(CAR) };

    /// A piece of a car: the box between two corners.
    fn piece(low: PlanePoint, high: PlanePoint) -> Fragment {
        let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
        Fragment { class: ONE, hull: convex_hull(&corners), pixels: 9 }
    }

    fn best() -> FragmentMerge {
        ClusterParams::best().fragments.expect("best assembles fragments")
    }

    fn groups(fragments: &[Fragment]) -> Vec<u32> {
        assemble(fragments, &best()).instance
    }

    #[test]
    fn the_halves_of_a_car_behind_a_pole_are_one() {
        let halves = [piece([0.0, 0.0], [1.6, 1.8]), piece([2.3, 0.0], [4.3, 1.8])];
        assert_eq!(groups(&halves), [1, 1]);
    }

    #[test]
    fn two_whole_cars_end_to_end_are_two() {
        let cars = [piece([0.0, 0.0], [4.4, 1.8]), piece([5.0, 0.0], [9.4, 1.8])];
        assert_eq!(groups(&cars), [1, 2]);
    }

    #[test]
    fn cars_side_by_side_in_bays_are_two() {
        let cars = [piece([0.0, 0.0], [4.4, 1.8]), piece([0.0, 2.4], [4.4, 4.2])];
        assert_eq!(groups(&cars), [1, 2]);
    }

    #[test]
    fn other_classes_and_unknown_sizes_stay_apart() {
        let mut pieces = [piece([0.0, 0.0], [1.0, 1.0]), piece([1.1, 0.0], [2.0, 1.0])];
        assert_eq!(groups(&pieces), [1, 1]);
        (pieces[1].class.number, pieces[1].class.family) = (2, 2);
        assert_eq!(groups(&pieces), [1, 2]);
        (pieces[1].class.number, pieces[1].class.family) = (1, 1);
        pieces[1].class.size = None;
        assert_eq!(groups(&pieces), [1, 2]);
    }

    #[test]
    fn kindred_classes_are_one_family() {
        let mut pieces = [piece([0.0, 0.0], [2.0, 1.8]), piece([2.1, 0.0], [4.2, 1.8])];
        (pieces[1].class.number, pieces[1].pixels) = (2, 5);
        assert_eq!(groups(&pieces), [1, 1]);
    }

    #[test]
    fn look_alikes_join_where_they_touch_and_fit_the_larger() {
        let of = |number: u16, size, low, high, pixels| {
            let size = Some(size);
            let class = FragmentClass { number, family: number, lookalikes: 1, size };
            Fragment { class, pixels, ..piece(low, high) }
        };
        let person = ClassSize { length: 0.73, width: 0.67 };
        let rider = ClassSize { length: 1.7, width: 0.6 };
        let body = of(1, person, [0.0, 0.0], [0.5, 0.3], 60);
        let arm = of(2, rider, [0.5, 0.0], [0.6, 0.3], 9);
        assert_eq!(groups(&[body.clone(), arm.clone()]), [1, 1]);
        let mut unlike = arm.clone();
        unlike.class.lookalikes = 2;
        assert_eq!(groups(&[body.clone(), unlike]), [1, 2]);
        let apart = of(2, rider, [0.7, 0.0], [0.8, 0.3], 9);
        assert_eq!(groups(&[body.clone(), apart]), [1, 2]);
        let beside = of(2, rider, [0.5, 0.0], [2.0, 0.3], 9);
        assert_eq!(groups(&[body, beside]), [1, 2], "too long for a person");
    }

    #[test]
    fn the_union_fits_the_class_of_the_larger_part() {
        let bus = ClassSize { length: 10.5, width: 2.9 };
        let mut pieces = [piece([0.0, 0.0], [2.0, 1.8]), piece([3.5, 0.0], [9.0, 1.8])];
        pieces[1].class.size = Some(bus);
        pieces[1].pixels = 200;
        assert_eq!(groups(&pieces), [1, 1]);
        pieces[1].pixels = 2;
        assert_eq!(groups(&pieces), [1, 2]);
    }

    #[test]
    fn cars_that_touch_along_their_sides_are_two() {
        let cars = [piece([0.0, 0.0], [4.4, 1.8]), piece([0.0, 1.9], [4.4, 3.7])];
        assert_eq!(groups(&cars), [1, 2]);
    }

    /// The front and the rear of a car, and behind it single pixels of a wall that are called car:
    /// each could join a part, and what is left would be too large.
    #[test]
    fn single_pixels_wait_for_the_parts_of_an_object() {
        let mut pieces = vec![piece([0.0, 0.0], [1.5, 1.8]), piece([3.0, 0.0], [4.5, 1.8])];
        let ghost = Fragment { pixels: 1, ..piece([-1.4, 0.9], [-1.4, 0.9]) };
        pieces.push(ghost.clone());
        assert_eq!(groups(&pieces), [1, 1, 2]);
        let impatient = FragmentMerge { delay: 0.0, ..best() };
        assert_eq!(assemble(&pieces, &impatient).instance, [1, 2, 1]);
    }

    #[test]
    fn a_growing_group_reaches_farther_pieces() {
        let pieces = [
            piece([0.0, 0.0], [1.0, 1.8]),
            piece([3.2, 0.0], [4.2, 1.8]),
            piece([1.2, 0.0], [3.0, 1.8]),
        ];
        assert_eq!(groups(&pieces), [1, 1, 1]);
    }

    #[test]
    fn nothing_and_pieces_without_points() {
        assert!(groups(&[]).is_empty());
        let empty = Fragment { class: ONE, hull: Vec::new(), pixels: 0 };
        assert_eq!(groups(&[empty.clone(), piece([0.0, 0.0], [1.0, 1.0]), empty]), [1, 2, 3]);
    }
}
