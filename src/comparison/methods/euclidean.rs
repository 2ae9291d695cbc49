//! Euclidean cluster extraction (Rusu 2010).

use super::shared::per_class;
use divmerge_core::cluster::{Method, MethodInput, Segmentation};
use divmerge_core::geometry::kd_tree::KdTree;

/// From point to point: whatever is near a point of a cluster is in it; class by class.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Euclidean {
    /// How near, metres. Default 0.5 (Zhao, Zhang and Huang's survey, arXiv 2108.09522).
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

    fn parameters(&self) -> serde_json::Value {
        serde_json::json!(self)
    }

    fn segment(&self, input: &MethodInput) -> Segmentation {
        per_class(input, |_, points| clusters(points, self.reach))
    }
}

/// For each point its cluster from 1, clusters in the order of their first points.
fn clusters(points: &[[f64; 3]], reach: f64) -> Vec<u32> {
    let tree = KdTree::new(points);
    let mut cluster = vec![0; points.len()];
    let (mut count, mut queue) = (0, Vec::new());
    for first in 0..points.len() {
        if cluster[first] != 0 {
            continue;
        }
        count += 1;
        cluster[first] = count;
        queue.push(first as u32);
        while let Some(point) = queue.pop() {
            for near in tree.within(points[point as usize], reach) {
                if std::mem::replace(&mut cluster[near as usize], count) == 0 {
                    queue.push(near);
                }
            }
        }
    }
    cluster
}

#[cfg(test)]
mod tests {
    use super::super::dbscan::{Dbscan, dbscan};
    use super::super::test_frames::{CAR, PERSON, instances};
    use super::*;

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
        /// DBSCAN with one point for a core point is another way to the same clusters.
        #[test]
        fn agrees_with_dbscan_of_single_points(
            grid in proptest::collection::vec((0..14_u8, 0..14_u8, 0..6_u8), 1..90),
        ) {
            let points: Vec<[f64; 3]> =
                grid.iter().map(|&(x, y, z)| [x, y, z].map(|v| f64::from(v) * 0.21)).collect();
            let other = dbscan(&points, Dbscan { reach: 0.5, min_points: 1 });
            assert_eq!(clusters(&points, 0.5), other);
        }
    }
}
