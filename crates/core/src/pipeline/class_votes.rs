//! Points vote on their class.

use std::collections::BTreeMap;

use crate::cloud::point_cloud::PointCloud;
use crate::geometry::statistics::most_voted;
use crate::semantics::ObjectMask;

/// What each of N points counts in the vote on the class of its instance or segment: the
/// probability of its class, so what is left of that of its first one where neighbours corrected
/// it. `None`: all count alike.
pub(super) fn class_weights(cloud: &PointCloud, mask: &ObjectMask) -> Option<Vec<f32>> {
    let mut weights = cloud.confidence.clone()?;
    for &(point, _) in &mask.corrected {
        let weight = &mut weights[point as usize];
        *weight = 1.0 - *weight;
    }
    Some(weights)
}

/// The class of some points with most votes, and within it the raw id with most. Ties go to the
/// lower number, and where no point has any weight, all count alike.
pub(super) fn majority(
    points: &[u32],
    class: &[u16],
    raw: &[u16],
    weights: Option<&[f32]>,
) -> (u16, u16) {
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
