//! The points nearest to a place: a k-d tree (Bentley 1975), which is crate `kiddo`'s.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// n points in D dimensions, metres.
#[derive(Debug)]
pub struct KdTree<const D: usize>(Option<ImmutableKdTree<f64, D>>);

/// A point that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Near {
    /// Squared distance in square metres.
    pub squared: f64,
    /// Number of the point in the list that the tree was built of.
    pub point: u32,
}

impl<const D: usize> KdTree<D> {
    /// The tree of some points, finite all of them and fewer than 2^32.
    pub fn new(points: &[[f64; D]]) -> Self {
        // The crate's tree is made of one point at least.
        let tree = (!points.is_empty()).then(|| ImmutableKdTree::new_from_slice(points));
        KdTree(tree.and_then(Result::ok))
    }

    /// The `k` points nearest to a place and no farther than `reach` metres, the nearest first,
    /// those of one distance by their numbers. Which of several at the distance of the last are
    /// left out is not said.
    pub fn nearest(&self, at: [f64; D], k: usize, reach: f64) -> Vec<Near> {
        let (Some(tree), Some(k)) = (&self.0, NonZero::new(k)) else { return Vec::new() };
        let query = tree.query(&at).nearest_n::<SquaredEuclidean<f64>>(k).within(reach * reach);
        let found = query.execute();
        let near = found.into_iter().map(|near| Near { squared: near.distance, point: near.item });
        let mut near: Vec<Near> = near.collect();
        near.sort_by(|a, b| a.squared.total_cmp(&b.squared).then(a.point.cmp(&b.point)));
        near
    }

    /// The points no farther than `reach` metres from a place, in no order that is said.
    pub fn within(&self, at: [f64; D], reach: f64) -> Vec<u32> {
        let Some(tree) = &self.0 else { return Vec::new() };
        let query = tree.query(&at).within::<SquaredEuclidean<f64>>(reach * reach).unsorted();
        query.execute().into_iter().map(|near| near.item).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        let tree = KdTree::new(&[[0.0, 0.0], [3.0, 0.0], [0.0, 4.0], [1.0, 1.0]]);
        let found = tree.nearest([0.0, 0.0], 2, 10.0);
        assert_eq!(found[0], Near { squared: 0.0, point: 0 });
        assert_eq!(found[1], Near { squared: 2.0, point: 3 });
        assert_eq!(tree.nearest([0.0, 0.0], 9, 3.0).len(), 3);
        assert!(tree.nearest([9.0, 9.0], 1, 3.0).is_empty());
        assert!(tree.nearest([0.0, 0.0], 0, 3.0).is_empty());
        assert!(KdTree::<2>::new(&[]).nearest([0.0, 0.0], 3, 3.0).is_empty());
        assert!(KdTree::<2>::new(&[]).within([0.0, 0.0], 3.0).is_empty());
    }

    proptest::proptest! {
        /// Few distinct coordinates, so that many points coincide or share one, more than a leaf
        /// holds.
        #[test]
        fn agrees_with_looking_at_every_point(
            grid in proptest::collection::vec((0..4_u8, 0..9_u8, 0..3_u8), 0..400),
            at in (0..9_u8, 0..9_u8, 0..9_u8),
            k in 1..40_usize,
            reach in 0..8_u8,
        ) {
            let place = |(x, y, z): (u8, u8, u8)| [f64::from(x), f64::from(y), f64::from(z)];
            let points: Vec<[f64; 3]> = grid.into_iter().map(place).collect();
            let (at, reach) = (place(at), f64::from(reach));
            let squared = |p: &[f64; 3]| (0..3).map(|i| (p[i] - at[i]).powi(2)).sum::<f64>();
            let mut all: Vec<(f64, u32)> = points.iter().map(squared).zip(0..).collect();
            all.retain(|&(squared, _)| squared <= reach * reach);
            all.sort_by(|a, b| a.partial_cmp(b).expect("finite"));

            let tree = KdTree::new(&points);
            let mut within = tree.within(at, reach);
            within.sort_unstable();
            let mut expected: Vec<u32> = all.iter().map(|&(_, point)| point).collect();
            expected.sort_unstable();
            assert_eq!(within, expected);

            let found = tree.nearest(at, k, reach);
            let distances: Vec<f64> = found.iter().map(|near| near.squared).collect();
            let expected: Vec<f64> = all.iter().take(k).map(|&(squared, _)| squared).collect();
            assert_eq!(distances, expected);
            for (near, &(_, point)) in found.iter().zip(&all) {
                let is_at_the_end = near.squared == distances[distances.len() - 1];
                assert!(near.point == point || is_at_the_end);
                assert_eq!(near.squared, squared(&points[near.point as usize]));
            }
        }
    }
}
