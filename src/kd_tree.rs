//! The points nearest to a place: a k-d tree (Bentley 1975).
//!
//! Of our own rather than a crate's (kiddo does far more): comparisons and evaluation alone need it, in
//! one way, and points at one distance must come in the order of their numbers, so that the same cloud
//! gives the same labels.

/// Most points of a leaf, which is searched from end to end.
const LEAF: usize = 12;

/// n points in D dimensions, metres. Building takes O(n log n), a search about O(log n + k).
///
/// The points lie in one list; the node of a range is its middle element, which parts the range along
/// one axis into what is not greater and what is not less.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct KdTree<const D: usize> {
    points: Vec<([f64; D], u32)>,
    /// The axis along which the point at a place parts its range.
    axis: Vec<u8>,
}

/// A point that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Near {
    /// Squared distance in square metres.
    pub squared: f64,
    /// Number of the point in the list that the tree was built of.
    pub point: u32,
}

impl Near {
    fn key(&self) -> (f64, u32) {
        (self.squared, self.point)
    }
}

impl<const D: usize> KdTree<D> {
    /// The tree of some points, finite all of them.
    pub fn new(points: &[[f64; D]]) -> Self {
        let mut tree = KdTree {
            points: points.iter().copied().zip(0..).collect(),
            axis: vec![0; points.len()],
        };
        part(&mut tree.points, &mut tree.axis);
        tree
    }

    /// The `k` points nearest to a place and no farther than `reach` metres, the nearest first. Of points
    /// at one distance those of lower number.
    pub fn nearest(&self, at: [f64; D], k: usize, reach: f64) -> Vec<Near> {
        let mut search = Search { at, k, squared_reach: reach * reach, found: Vec::new() };
        if k > 0 {
            self.visit(0, self.points.len(), &mut search);
        }
        search.found
    }

    fn visit(&self, low: usize, high: usize, search: &mut Search<D>) {
        if high - low <= LEAF {
            self.points[low..high].iter().for_each(|&point| search.consider(point));
            return;
        }
        let middle = low + (high - low) / 2;
        let axis = usize::from(self.axis[middle]);
        let beyond = search.at[axis] - self.points[middle].0[axis];
        let sides = [(low, middle), (middle + 1, high)];
        let (near, far) = if beyond < 0.0 { (sides[0], sides[1]) } else { (sides[1], sides[0]) };
        self.visit(near.0, near.1, search);
        search.consider(self.points[middle]);
        if beyond * beyond <= search.squared_reach {
            self.visit(far.0, far.1, search);
        }
    }
}

/// Orders a range of points as a tree.
fn part<const D: usize>(points: &mut [([f64; D], u32)], axis: &mut [u8]) {
    if points.len() <= LEAF {
        return;
    }
    let middle = points.len() / 2;
    let widest = widest_axis(points);
    points.select_nth_unstable_by(middle, |a, b| a.0[widest].total_cmp(&b.0[widest]));
    axis[middle] = widest as u8;
    let (below, above) = points.split_at_mut(middle);
    let (axis_below, axis_above) = axis.split_at_mut(middle);
    part(below, axis_below);
    part(&mut above[1..], &mut axis_above[1..]);
}

fn widest_axis<const D: usize>(points: &[([f64; D], u32)]) -> usize {
    let spread = |axis: usize| {
        let along = points.iter().map(|(point, _)| point[axis]);
        let (low, high) = along
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| (low.min(t), high.max(t)));
        high - low
    };
    (0..D).max_by(|&a, &b| spread(a).total_cmp(&spread(b))).unwrap_or(0)
}

struct Search<const D: usize> {
    at: [f64; D],
    k: usize,
    /// Nothing farther is of interest any more.
    squared_reach: f64,
    /// Ascending.
    found: Vec<Near>,
}

impl<const D: usize> Search<D> {
    fn consider(&mut self, (position, point): ([f64; D], u32)) {
        let along = |axis: usize| position[axis] - self.at[axis];
        let squared = (0..D).map(|axis| along(axis) * along(axis)).sum();
        if squared > self.squared_reach {
            return;
        }
        let near = Near { squared, point };
        let place = self.found.partition_point(|other| other.key() < near.key());
        self.found.insert(place, near);
        self.found.truncate(self.k);
        if self.found.len() == self.k {
            self.squared_reach = self.squared_reach.min(self.found[self.k - 1].squared);
        }
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
    }

    proptest::proptest! {
        /// Few distinct coordinates, so that many points coincide or share one.
        #[test]
        fn agrees_with_looking_at_every_point(
            grid in proptest::collection::vec((0..9_u8, 0..9_u8, 0..9_u8), 0..200),
            at in (0..9_u8, 0..9_u8, 0..9_u8),
            k in 1..40_usize,
            reach in 0..8_u8,
        ) {
            let place = |(x, y, z): (u8, u8, u8)| [f64::from(x), f64::from(y), f64::from(z)];
            let points: Vec<[f64; 3]> = grid.into_iter().map(place).collect();
            let (at, reach) = (place(at), f64::from(reach));
            let mut all: Vec<Near> = points
                .iter()
                .zip(0..)
                .map(|(p, point)| {
                    let squared = (0..3).map(|axis| (p[axis] - at[axis]).powi(2)).sum();
                    Near { squared, point }
                })
                .filter(|near| near.squared <= reach * reach)
                .collect();
            all.sort_by(|a, b| a.key().partial_cmp(&b.key()).expect("finite"));
            all.truncate(k);
            assert_eq!(KdTree::new(&points).nearest(at, k, reach), all);
        }
    }
}
