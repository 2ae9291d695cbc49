//! The points of one segment vote on whether it is a thing, where a network's classes bleed.
//!
//! A network that blurs objects also calls a patch of a bush, a fence or a wall a vehicle, and
//! leaves half of a van to a building. Such errors are contiguous, so that the nearest neighbours
//! of a point do not outvote them ([`Smoothing`](crate::semantics::Smoothing)). But the tree of
//! merges ([`cluster::tree`](crate::cluster::tree)), which sees no classes, knows what hangs
//! together, at every scale. Of its nodes those are segments that agree best with the classes and
//! are few: the disjoint ones with the greatest sum of
//!
//! votes of the majority + [`body`](SegmentVote::body) x score x votes -
//! [`points`](SegmentVote::points).
//!
//! The score says how much a node looks like one whole body. Then the majority of a segment
//! decides: all of it is a thing, or none of it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::class_votes::{class_weights, majority};
use super::labels::{InstancePixels, label_points};
use crate::cloud::Reason;
use crate::cloud::point_cloud::PointCloud;
use crate::cloud::taxonomy::Taxonomy;
use crate::cluster::tree::cut::cut;
use crate::cluster::{ClusterParams, CutTree, MergeTree, Method, MethodInput, ObjectPixels};
use crate::range_image::RangeImage;
use crate::semantics::{ObjectMask, mask_of_known_ground};

/// When a segment that the geometry finds decides on the classes of its points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SegmentVote {
    /// Votes that one more segment costs: a part of a segment is one of its own where more points
    /// than these are called otherwise. Default 20; 20 to 30 score alike.
    #[schemars(range(min = 0.0, max = 10000.0))]
    #[schemars(extend("unit" = "points", "slider" = [0.0, 100.0]))]
    pub points: f64,
    /// Share of its votes that a node gains that looks like one whole body; one that looks half
    /// like it gains half of that. Default 0.4; 0.3 to 0.5 score alike.
    #[schemars(range(min = 0.0, max = 10.0), extend("slider" = [0.0, 1.0]))]
    pub body: f64,
}

impl Default for SegmentVote {
    fn default() -> Self {
        SegmentVote { points: 20.0, body: 0.4 }
    }
}

/// What a point says of its segment.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Side {
    Thing,
    Other,
    /// None of the points of a segment is ground, so one that is called ground says nothing.
    Silent,
}

impl SegmentVote {
    /// Corrects the classes of a mask whose ground was found. Without a tree of merges among the
    /// parameters there are no segments, and nothing is corrected.
    pub(super) fn correct(
        &self,
        (cloud, image): (&PointCloud, &RangeImage),
        taxonomy: &Taxonomy,
        params: &ClusterParams,
        mask: &mut ObjectMask,
    ) {
        let Some(parts) = Parts::new((cloud, image), params, mask) else { return };
        let weights = class_weights(cloud, mask);
        let weight =
            |point: u32| weights.as_ref().map_or(1.0, |all| f64::from(all[point as usize]));
        let classes = taxonomy.classes();
        let side = |mask: &ObjectMask, point: u32| match &classes
            [usize::from(mask.class[point as usize])]
        {
            _ if mask.is_object[point as usize] => Side::Thing,
            class if class.is_ground() => Side::Silent,
            _ => Side::Other,
        };
        let segments = self.segments(parts, |point| (side(mask, point), weight(point)));
        let raw = mask.raw_ids(cloud);
        let mut corrected = Vec::new();
        for segment in segments {
            let votes = votes(&segment, |point| (side(mask, point), weight(point)));
            let winner = if votes[0] > votes[1] { Side::Thing } else { Side::Other };
            let (winners, others): (Vec<u32>, Vec<u32>) =
                segment.into_iter().partition(|&point| side(mask, point) == winner);
            let loses = |&point: &u32| winner == Side::Thing || side(mask, point) == Side::Thing;
            let losers: Vec<u32> = others.into_iter().filter(loses).collect();
            if winners.is_empty() || losers.is_empty() {
                continue;
            }
            let (class, id) = majority(&winners, &mask.class, &raw, weights.as_deref());
            for &point in &losers {
                let point = point as usize;
                mask.class[point] = class;
                mask.is_object[point] = winner == Side::Thing;
                mask.reason[point] = match winner {
                    Side::Thing => Reason::None,
                    _ => Reason::NotAnObject,
                };
            }
            corrected.extend(losers.into_iter().map(|point| (point, id)));
        }
        mask.correct(corrected);
    }

    /// The points of each segment, given what each point says and the weight of its vote.
    fn segments(&self, parts: Parts, says: impl Fn(u32) -> (Side, f64)) -> Vec<Vec<u32>> {
        let nodes = &parts.tree.tree.nodes;
        let mut of_node: Vec<[f64; 2]> =
            parts.own_points.iter().map(|own| votes(own, &says)).collect();
        for (number, node) in nodes.iter().enumerate() {
            if let Some(parent) = node.parent {
                let own = of_node[number];
                of_node[parent as usize].iter_mut().zip(own).for_each(|(sum, votes)| *sum += votes);
            }
        }
        let gain = of_node.iter().zip(&parts.tree.scores).map(|([things, others], score)| {
            let score = score.as_ref().map_or(0.0, |score| score.total);
            things.max(*others) + self.body * score * (things + others) - self.points
        });
        let cut = cut(nodes, &gain.collect::<Vec<f64>>());
        let mut segment_of = vec![None; nodes.len()];
        let mut segments = vec![Vec::new(); cut.chosen.len()];
        for (number, node) in nodes.iter().enumerate().rev() {
            let above = node.parent.and_then(|parent| segment_of[parent as usize]);
            segment_of[number] = cut.chosen.binary_search(&(number as u32)).ok().or(above);
            if let Some(segment) = segment_of[number] {
                segments[segment].extend_from_slice(&parts.own_points[number]);
            }
        }
        segments
    }
}

/// The votes of points: for a thing, and for all else.
fn votes(points: &[u32], says: impl Fn(u32) -> (Side, f64)) -> [f64; 2] {
    points.iter().fold([0.0, 0.0], |[things, others], &point| match says(point) {
        (Side::Thing, weight) => [things + weight, others],
        (Side::Other, weight) => [things, others + weight],
        (Side::Silent, _) => [things, others],
    })
}

/// The tree of merges of all that is not ground.
struct Parts {
    tree: MergeTree,
    /// By node: the points that are in none of its children, shadowed ones among them.
    own_points: Vec<Vec<u32>>,
}

impl Parts {
    fn new(
        (cloud, image): (&PointCloud, &RangeImage),
        params: &ClusterParams,
        mask: &ObjectMask,
    ) -> Option<Self> {
        let (tree, mask) = (params.tree.as_ref()?, mask_of_known_ground(cloud, mask)?);
        let objects = ObjectPixels::without_condition(cloud, image, &mask, params);
        let input = MethodInput::new(cloud, image, &mask, &objects, params);
        let segmentation = CutTree { params, tree }.segment(&input);
        let labels = label_points(&input, &segmentation, &InstancePixels::new(&segmentation, 0));
        let tree = segmentation.post_merge.tree?;
        let mut node_of = vec![None; segmentation.components.count as usize + 1];
        for (&component, &node) in segmentation.components.label.iter().zip(&tree.node_of_pixel) {
            node_of[component as usize] = node;
        }
        // Pixels without a component may be of a node all the same; their points have no component.
        node_of[0] = None;
        let mut own_points = vec![Vec::new(); tree.tree.nodes.len()];
        for (point, &component) in (0..).zip(&labels.component) {
            if let Some(node) = node_of[component as usize] {
                own_points[node as usize].push(point);
            }
        }
        Some(Parts { tree, own_points })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cluster::tree::nodes::{Node, Tree};

    /// Two leaves of some points each, and the node that they become.
    fn two_leaves(counts: [u32; 2]) -> Parts {
        let node = |parent: Option<u32>, children: Option<[u32; 2]>| Node {
            start: 0,
            len: 0,
            birth: 0.1,
            death: 0.2,
            parent,
            children,
        };
        let nodes = vec![node(Some(2), None), node(Some(2), None), node(None, Some([0, 1]))];
        let tree = Tree { nodes, pixels: Vec::new() };
        let [a, b] = counts;
        MergeTree { tree, scores: vec![None; 3], ..MergeTree::default() }.with_points(vec![
            (0..a).collect(),
            (a..a + b).collect(),
            Vec::new(),
        ])
    }

    impl MergeTree {
        fn with_points(self, own_points: Vec<Vec<u32>>) -> Parts {
            Parts { tree: self, own_points }
        }
    }

    #[test]
    fn a_part_is_a_segment_of_its_own_where_it_has_points_enough() {
        let sizes = |counts: [u32; 2]| {
            let vote = SegmentVote { points: 20.0, body: 0.0 };
            let says = |point| (if point < counts[0] { Side::Thing } else { Side::Other }, 1.0);
            let mut sizes: Vec<usize> =
                vote.segments(two_leaves(counts), says).iter().map(Vec::len).collect();
            sizes.sort_unstable();
            sizes
        };
        assert_eq!(sizes([30, 100]), [30, 100]);
        assert_eq!(sizes([15, 100]), [115]);
        let half_sure = |_| (Side::Thing, 0.5);
        let segments = SegmentVote::default().segments(two_leaves([30, 50]), half_sure);
        assert_eq!(segments.len(), 1, "what agrees is one segment");
    }
}
