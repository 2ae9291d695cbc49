//! Losses in the merge step: votes that joined an object with something else or kept it apart.

use super::context::{Found, Search, edges, most_frequent_group};
use crate::diagnose::explain::{Explanation, PostMergeStage, Subject, VoteEvidence, explain};
use crate::diagnose::failures::case::ObjectOrigin;
use crate::diagnose::failures::cause::{Cause, MergeCause, PostMergeCause};
use crate::evaluate::verdict::Segment;

impl Search<'_> {
    /// Two parts of an object that are apart: the two largest of a true object, or a found piece
    /// and the match beside it.
    pub fn apart(&self) -> Found {
        let judged = &self.target.judged;
        let id = |part: usize| judged.parts.get(part).map(|part| part.object.id);
        let (object, ids) = match self.target.side {
            ObjectOrigin::True => (judged.object, [id(0)?, id(1)?]),
            ObjectOrigin::Found => {
                let object = judged.parts.first()?.object;
                let found = self.oracles.seen.verdicts.of_true(object)?;
                (object, [judged.object.id, found.parts.first()?.object.id])
            }
        };
        let labels = &self.stages.labels.instance;
        let is_seen = |&point: &usize| self.oracles.is_seen[point];
        let [a, b] = ids.map(|id| -> Vec<usize> {
            let part = (0..labels.len()).filter(|&point| labels[point] == id);
            part.filter(is_seen).filter(|&point| self.is_of(point, object)).collect()
        });
        let [a, b] = self.nearest_pair(&a, &b)?;
        let explanation = explain(&self.run.frame, Subject::Pair(a, b));
        kept_apart(explanation).map(|cause| (cause, vec![a, b]))
    }

    /// The merge that put the object together with something else.
    pub fn joined_by_votes(&self, object: Segment) -> Found {
        let stages = self.stages;
        let own = self.is_own_pixel(object);
        let group = most_frequent_group(&own, |pixel| stages.merged_instance(pixel))?;
        let groups = &stages.merge.instance_of_component;
        let members: Vec<u32> =
            (1..).zip(groups).filter(|&(_, &of)| of == group).map(|(label, _)| label).collect();
        let place = |label: u32| members.binary_search(&label).ok();
        let steps: Vec<_> =
            stages.merge.steps.iter().filter(|step| place(step.target).is_some()).collect();
        let edges = edges(steps.iter().map(|step| [step.target, step.query]), place)?;
        let part_of = |pixel: usize| place(stages.components.label[pixel]);
        let (cut, show) = self.spoiling_edge(members.len(), &edges, &own, part_of)?;
        let step = steps[cut.edge];
        let cause = MergeCause::Joined {
            target: step.target,
            query: step.query,
            positive: step.positive,
            negative: step.negative,
        };
        Some((Cause::Merge(cause), show))
    }
}

/// The decision that kept two points apart.
fn kept_apart(explanation: Explanation) -> Option<Cause> {
    if let Some(cut) = explanation.cut() {
        let stage = PostMergeStage::Cut(cut.clone());
        return Some(Cause::Post(Box::new(PostMergeCause::Apart(stage))));
    }
    let (border, distance) = match explanation.votes {
        Some(VoteEvidence::Failed { mut links, weakest, .. }) => {
            return Some(Cause::Merge(MergeCause::Apart(Box::new(links.swap_remove(weakest)))));
        }
        Some(VoteEvidence::NoTrueCondition { border, distance, .. }) => (border.len(), distance),
        Some(VoteEvidence::DifferentClasses { distance, .. }) => (0, distance),
        _ => return None,
    };
    let joins_parts = |stage: &PostMergeStage| matches!(stage, PostMergeStage::Fragments { .. });
    Some(match explanation.post_merge.into_iter().find(joins_parts) {
        Some(stage) => Cause::Post(Box::new(PostMergeCause::Apart(stage))),
        None => Cause::Merge(MergeCause::Unlinked { border, distance }),
    })
}
