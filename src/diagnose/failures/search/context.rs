//! What is shared by the searches for a cause.

use crate::diagnose::failures::case::{LabelledRun, ObjectOrigin, Target};
use crate::diagnose::failures::cause::Cause;
use crate::diagnose::failures::oracles::Oracles;
use crate::diagnose::failures::tree::{Part, TreeCut, best_cut};
use crate::evaluate::verdict::{Segment, Verdict};
use divmerge_core::cloud::{Reason, wide};
use divmerge_core::geometry::kd_tree::KdTree;
use divmerge_core::geometry::statistics::most_frequent;
use divmerge_core::pipeline::Stages;

/// A cause and the points that show it; no points if it has none of its own.
pub(super) type Found = Option<(Cause, Vec<usize>)>;

/// A failure, the run it happened in and the oracles it is compared with.
pub(super) struct Search<'a> {
    pub run: &'a LabelledRun<'a>,
    pub oracles: &'a Oracles,
    pub target: &'a Target,
    pub stages: &'a Stages,
}

impl Search<'_> {
    /// Points to look at if the cause has none: for an object in parts, one of each of the largest
    /// two; for an object in one instance with something else, one of it and one beside it; else
    /// the point nearest to its middle.
    pub fn show(&self) -> Vec<usize> {
        let labels = &self.stages.labels.instance;
        let cloud = self.run.frame.cloud;
        let judged = &self.target.judged;
        let part = |number: usize| judged.parts.get(number).map(|part| part.object.id);
        if let (ObjectOrigin::True, Some(holder)) = (self.target.side, part(0)) {
            let [a, b] = match (judged.verdict, part(1)) {
                (Verdict::OverSegmented, Some(other)) => {
                    [holder, other].map(|id| self.seen(|point| labels[point] == id))
                }
                (Verdict::UnderSegmented, _) => {
                    let beside = (0..labels.len()).filter(|&point| {
                        let is_own = self.is_of(point, judged.object);
                        labels[point] == holder && !is_own && self.oracles.is_seen[point]
                    });
                    [self.seen(|point| labels[point] == holder), beside.collect()]
                }
                _ => Default::default(),
            };
            if let Some(pair) = self.nearest_pair(&a, &b) {
                return pair.to_vec();
            }
        }
        let returns = self.target.points.iter().copied().filter(|&point| cloud.is_return(point));
        let is_without = |point: usize| labels[point] == 0;
        let away = |point: usize| {
            let at = wide(cloud.position(point));
            (0..3).map(|axis| (at[axis] - judged.centre[axis]).powi(2)).sum::<f64>()
        };
        let is_missed = judged.verdict == Verdict::Missed;
        let wanted = returns.filter(|&point| !is_missed || is_without(point));
        wanted.min_by(|&a, &b| away(a).total_cmp(&away(b))).into_iter().collect()
    }

    /// The seen points of the failure that `wanted` accepts.
    pub fn seen(&self, wanted: impl Fn(usize) -> bool) -> Vec<usize> {
        let points = self.target.points.iter().copied();
        points.filter(|&point| self.oracles.is_seen[point] && wanted(point)).collect()
    }

    /// For each object pixel whether it shows a true object.
    pub fn is_own_pixel(&self, object: Segment) -> Vec<bool> {
        let is_own = |pixel: usize| self.is_of(self.point_of(pixel), object);
        (0..self.stages.objects.len()).map(is_own).collect()
    }

    /// Whether a point belongs to a true object.
    pub fn is_of(&self, point: usize, object: Segment) -> bool {
        self.run.true_id[point] == object.id && self.oracles.true_class[point] == object.class
    }

    /// The object pixels that show a true object.
    pub fn own_pixels(&self, object: Segment) -> Vec<usize> {
        let is_own = self.is_own_pixel(object);
        (0..is_own.len()).filter(|&pixel| is_own[pixel]).collect()
    }

    /// The point seen in an object pixel.
    pub fn point_of(&self, object: usize) -> usize {
        let pixel = self.stages.objects.pixel[object] as usize;
        self.stages.image.point_of_pixel.values()[pixel] as usize
    }

    /// The first point of the failure that has no instance for a reason; none if there is none.
    pub fn one_with(&self, reason: Reason) -> Vec<usize> {
        let reasons = &self.stages.labels.reason;
        let mut points = self.target.points.iter().copied();
        points.find(|&point| reasons[point] == reason).into_iter().collect()
    }

    /// The two points nearest to each other, one of each list; none if a list is empty.
    pub fn nearest_pair(&self, a: &[usize], b: &[usize]) -> Option<[usize; 2]> {
        let position = |&point: &usize| wide(self.run.frame.cloud.position(point));
        let tree = KdTree::new(&b.iter().map(position).collect::<Vec<_>>());
        let mut best: Option<(f64, [usize; 2])> = None;
        for point in a {
            let reach = best.map_or(f64::INFINITY, |(squared, _)| squared.sqrt());
            if let Some(near) = tree.nearest(position(point), 1, reach).first()
                && best.is_none_or(|(least, _)| near.squared < least)
            {
                best = Some((near.squared, [*point, b[near.point as usize]]));
            }
        }
        best.map(|(_, pair)| pair)
    }

    /// The edge of a tree of parts that spoiled the object, and a point on either side of it.
    pub fn spoiling_edge(
        &self,
        count: usize,
        edges: &[[usize; 2]],
        own: &[bool],
        part_of: impl Fn(usize) -> Option<usize>,
    ) -> Option<(TreeCut, Vec<usize>)> {
        let mut parts = vec![Part::default(); count];
        for (pixel, &is_own) in own.iter().enumerate() {
            if let Some(part) = part_of(pixel) {
                parts[part].own += u64::from(is_own);
                parts[part].all += 1;
            }
        }
        let total = own.iter().filter(|&&is_own| is_own).count() as u64;
        let cut = best_cut(&parts, edges, total)?;
        let on_side = |is_own_side: bool| -> Vec<usize> {
            let pixels = (0..own.len()).filter(|&pixel| own[pixel] == is_own_side);
            let on_side = pixels
                .filter(|&pixel| part_of(pixel).map(|p| cut.is_own_side[p]) == Some(is_own_side));
            on_side.map(|pixel| self.point_of(pixel)).collect()
        };
        let pair = self.nearest_pair(&on_side(true), &on_side(false))?;
        Some((cut, pair.to_vec()))
    }
}

/// The group, other than 0, that most of the object's pixels are in; of several the lowest.
pub(super) fn most_frequent_group(own: &[bool], group: impl Fn(usize) -> u32) -> Option<u32> {
    let groups = (0..own.len()).filter(|&pixel| own[pixel]).map(group);
    most_frequent(groups.filter(|&group| group != 0))
}

/// Pairs of labels as pairs of places; none if a label has no place.
pub(super) fn edges(
    pairs: impl Iterator<Item = [u32; 2]>,
    place: impl Fn(u32) -> Option<usize>,
) -> Option<Vec<[usize; 2]>> {
    pairs.map(|[a, b]| Some([place(a)?, place(b)?])).collect()
}
