//! Euclidean cluster extraction (Rusu 2010).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::dbscan::{Dbscan, dbscan};
use super::shared::per_class;
use divmerge_core::cluster::{Method, MethodInput, Segmentation};

/// From point to point: whatever is near a point of a cluster is in it; class by class.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Euclidean {
    /// How near, metres. Default 0.5 (Zhao, Zhang and Huang's survey, arXiv 2108.09522).
    #[schemars(range(max = 100.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [0.05, 3.0]))]
    #[schemars(extend("source" = "Zhao, Zhang and Huang 2021, arXiv 2108.09522"))]
    pub reach: f64,
}

impl Default for Euclidean {
    fn default() -> Self {
        Euclidean { reach: 0.5 }
    }
}

impl Method for Euclidean {
    fn name(&self) -> &'static str {
        "euclidean"
    }

    parameters_are_fields!();

    fn segment(&self, input: &MethodInput) -> Segmentation {
        per_class(input, |_, points| clusters(points, self.reach))
    }
}

/// For each point its cluster from 1, clusters in the order of their first points: DBSCAN in which
/// every point is a core point, so that equal points cost no more than others.
fn clusters(points: &[[f64; 3]], reach: f64) -> Vec<u32> {
    dbscan(points, Dbscan { reach, min_points: 1 })
}

#[cfg(test)]
mod tests {
    use super::super::test_frames::{CAR, PERSON, instances};
    use super::*;
    use divmerge_core::geometry::kd_tree::KdTree;

    #[test]
    fn a_chain_is_one_and_a_wider_gap_parts() {
        let points = [0.0, 0.45, 0.9, 1.5, 1.9].map(|x| [x, 0.0, 0.0]);
        assert_eq!(clusters(&points, 0.5), [1, 1, 1, 2, 2]);
    }

    #[test]
    fn classes_stay_apart() {
        let at = |x: f32, class| ([x, 5.0, 0.0], class);
        let points = [at(0.0, CAR), at(0.1, PERSON), at(0.2, CAR), at(3.0, CAR)];
        assert_eq!(instances(&Euclidean::default(), 4, &points), [1, 3, 1, 2]);
    }

    proptest::proptest! {
        /// Against the definition: whatever is near a point of a cluster is in it.
        #[test]
        fn agrees_with_growing_point_by_point(
            grid in proptest::collection::vec((0..14_u8, 0..14_u8, 0..6_u8), 1..90),
        ) {
            let points: Vec<[f64; 3]> =
                grid.iter().map(|&(x, y, z)| [x, y, z].map(|v| f64::from(v) * 0.21)).collect();
            let tree = KdTree::new(&points);
            let (mut expected, mut count) = (vec![0; points.len()], 0);
            for first in 0..points.len() {
                let mut queue = if expected[first] == 0 { vec![first as u32] } else { Vec::new() };
                count += u32::from(!queue.is_empty());
                while let Some(point) = queue.pop() {
                    if std::mem::replace(&mut expected[point as usize], count) == 0 {
                        queue.extend(tree.within(points[point as usize], 0.5));
                    }
                }
            }
            assert_eq!(clusters(&points, 0.5), expected);
        }
    }

    #[test]
    fn far_points_are_not_near() {
        let points = [1e12, 1e12, 3e15, 3e25, -3e25, 3.4e38, -3.4e38].map(|x| [x, 0.0, 0.0]);
        assert_eq!(clusters(&points, 0.5), [1, 1, 2, 3, 4, 5, 6]);
    }

    #[test]
    fn heaps_of_equal_points_are_two_clusters() {
        let points: Vec<[f64; 3]> =
            (0..100_000).map(|number| [f64::from(number % 2) * 0.55, 0.0, 0.0]).collect();
        let found = clusters(&points, 0.5);
        assert!(found.iter().zip(0_u32..).all(|(&cluster, number)| cluster == 1 + number % 2));
    }
}
