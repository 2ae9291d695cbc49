//! Losses before the first step: by the mask, and by points that do not own their pixel.

use super::context::{Found, Search};
use crate::diagnose::failures::cause::Cause;
use crate::evaluate::verdict::Verdict;
use divmerge_core::geometry::statistics::most_frequent;

impl Search<'_> {
    /// The mask, where no cut of it could be right.
    pub fn mask(&self) -> Found {
        let is_spurious = self.target.judged.verdict == Verdict::Spurious;
        let is_blamed = is_spurious || !self.oracles.perfect_cut.is_right(self.target);
        is_blamed.then(|| (self.mask_cause(), Vec::new()))
    }

    /// The mask, where a true one would have made the run right and no later step is found that
    /// lost the object.
    pub fn mask_after_all(&self) -> Found {
        let is_blamed = self.oracles.is_right_with_true_mask(self.target);
        is_blamed.then(|| (self.mask_cause(), Vec::new()))
    }

    fn mask_cause(&self) -> Cause {
        let mask = &self.stages.mask;
        let points = &self.target.points;
        let not_objects = points.iter().filter(|&&point| !mask.is_object[point]).count() as u64;
        let true_class = &self.oracles.true_class;
        let is_misnamed =
            |point: &&usize| mask.has_classes() && mask.class[**point] != true_class[**point];
        let given: Vec<u16> =
            points.iter().filter(is_misnamed).map(|&point| mask.class[point]).collect();
        let name = |class: u16| self.run.taxonomy.classes()[usize::from(class)].name.clone();
        Cause::Mask {
            points: points.len() as u64,
            not_objects,
            other_class: (given.len() as u64).saturating_sub(not_objects),
            given: most_frequent(given).map(name),
        }
    }

    pub fn projection(&self) -> Found {
        let points = &self.target.points;
        let is_seen = |point: &usize| self.oracles.is_seen[*point];
        let shadowed: Vec<usize> = points.iter().copied().filter(|point| !is_seen(point)).collect();
        let is_right = self.oracles.seen.is_right(self.target);
        if shadowed.is_empty() || !(is_right || shadowed.len() == points.len()) {
            return None;
        }
        let labels = &self.stages.labels;
        let match_of = self.oracles.seen.verdicts.of_true(self.target.judged.object);
        let own = match_of.and_then(|judged| judged.parts.first()).map(|part| part.object.id);
        let is_wrong = |point: &&usize| Some(labels.instance[**point]) != own;
        let unlabelled = shadowed.iter().filter(|&&point| labels.instance[point] == 0).count();
        let cause = Cause::Projection {
            points: points.len() as u64,
            shadowed: shadowed.len() as u64,
            unlabelled: unlabelled as u64,
        };
        Some((cause, shadowed.iter().find(is_wrong).into_iter().copied().collect()))
    }
}
