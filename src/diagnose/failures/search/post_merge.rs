//! Losses after the merge step: later merges that joined too much, and the minimum size.

use super::context::{Found, Search, edges, most_frequent_group};
use crate::diagnose::explain::{PostMergeStage, Subject, explain};
use crate::diagnose::failures::cause::{Cause, DivideCause, PostMergeCause};
use crate::evaluate::verdict::Segment;
use divmerge_core::cloud::Reason;
use divmerge_core::cluster::Join;

impl Search<'_> {
    /// The minimum size, if most of the object's lost pixels were dropped by it; else the divide
    /// step.
    pub fn dropped(&self) -> Found {
        let pixels = self.own_pixels(self.target.judged.object);
        let reason = |&object: &usize| self.stages.labels.reason[self.point_of(object)];
        let count = |wanted| pixels.iter().filter(|object| reason(object) == wanted).count() as u64;
        let (dropped, unreached) = (count(Reason::TooSmall), count(Reason::Unreached));
        let all = pixels.len() as u64;
        if dropped >= unreached && dropped > 0 {
            let minimum = self.run.frame.config.cluster.min_pixels;
            let cause = PostMergeCause::TooSmall { dropped, pixels: all, minimum };
            return Some((Cause::Post(Box::new(cause)), self.one_with(Reason::TooSmall)));
        }
        let cause = Cause::Divide(DivideCause::Unreached { unreached, pixels: all });
        (unreached > 0).then(|| (cause, self.one_with(Reason::Unreached)))
    }

    /// The later merge that put the object together with something else.
    pub fn joined_later(&self, object: Segment) -> Found {
        let stages = self.stages;
        let own = self.is_own_pixel(object);
        let last = |group: u32| match group {
            0 => 0,
            group => stages.post_merge.instance[group as usize - 1],
        };
        let end = most_frequent_group(&own, |pixel| last(stages.merged_instance(pixel)))?;
        let groups = (1..=stages.merge.count).filter(|&group| last(group) == end);
        let groups: Vec<u32> = groups.collect();
        let place = |group: u32| groups.binary_search(&group).ok();
        let part_of = |pixel: usize| place(stages.merged_instance(pixel));
        let joins: Vec<&Join> =
            stages.post_merge.joins.iter().filter(|join| place(join.target).is_some()).collect();
        if !joins.is_empty() {
            let edges = edges(joins.iter().map(|join| [join.target, join.query]), place)?;
            let (cut, show) = self.spoiling_edge(groups.len(), &edges, &own, part_of)?;
            return Some((Cause::Post(Box::new(PostMergeCause::Joined(*joins[cut.edge]))), show));
        }
        let [a, b] = self.overlapping(&own, groups.len(), part_of)?;
        let stages = explain(&self.run.frame, Subject::Pair(a, b)).post_merge;
        let overlap = |stage: &PostMergeStage| {
            matches!(stage, PostMergeStage::BirdsEye { joined: true, .. } | PostMergeStage::Cut(_))
        };
        let stage = stages.into_iter().find(overlap)?;
        Some((Cause::Post(Box::new(PostMergeCause::Overlapped(stage))), vec![a, b]))
    }

    /// Two points near each other: one of the object's largest part and one of the largest other
    /// part.
    fn overlapping(
        &self,
        own: &[bool],
        parts: usize,
        part_of: impl Fn(usize) -> Option<usize>,
    ) -> Option<[usize; 2]> {
        let of_part = |part: usize, is_own: bool| -> Vec<usize> {
            let pixels = (0..own.len()).filter(|&pixel| part_of(pixel) == Some(part));
            let wanted = pixels.filter(|&pixel| own[pixel] == is_own);
            wanted.map(|pixel| self.point_of(pixel)).collect()
        };
        let own_part = (0..parts).max_by_key(|&part| of_part(part, true).len())?;
        let others = (0..parts).filter(|&part| part != own_part);
        let other = others.max_by_key(|&part| of_part(part, false).len())?;
        self.nearest_pair(&of_part(own_part, true), &of_part(other, false))
    }
}
