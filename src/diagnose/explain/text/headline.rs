//! The answer in one sentence.

use super::cut;
use super::votes::failed_link;
use super::words::{counted, instance, without_instance};
use crate::diagnose::explain::{Answer, DecidedBy, Explanation, PostMergeStage, VoteEvidence};

impl Explanation {
    /// The answer in one sentence.
    pub fn headline(&self) -> String {
        let own: Vec<String> = self.points.iter().map(instance).collect();
        match self.answer {
            Answer::HasInstance | Answer::NoInstance => format!("The point has {}.", own[0]),
            Answer::OneInstance => {
                format!("Yes, A and B are one: {}. Why: {}.", own[0], self.why_one())
            }
            Answer::Apart => {
                let why = self.why_apart();
                format!("No, A has {} and B has {}. Why: {why}.", own[0], own[1])
            }
        }
    }

    fn why_one(&self) -> String {
        if let Some(cut) = self.cut() {
            return format!("the cut of the tree of merges {}", cut::outcome(cut));
        }
        match self.decided_by {
            DecidedBy::OneComponent => "both grew from one seed".to_owned(),
            DecidedBy::VotesInFavour => {
                format!("the votes joined them ({})", merges(self.votes.as_ref()))
            }
            _ => format!("the votes left them apart, {} joined them", self.joining_stage()),
        }
    }

    fn why_apart(&self) -> String {
        match (self.decided_by, &self.votes) {
            (DecidedBy::NoInstance, _) => without_instance(&self.points),
            (DecidedBy::Cut, _) => {
                self.cut().map_or_else(|| "the cut separated them".into(), cut::outcome)
            }
            (DecidedBy::VotesAgainst, Some(VoteEvidence::Failed { links, weakest, .. })) => {
                failed_link(&links[*weakest], self.merge_ratio)
            }
            (DecidedBy::DifferentClasses, _) => {
                "their classes differ, and only pixels of one class are neighbours".into()
            }
            (DecidedBy::NoTrueCondition, _) => {
                "no chain of neighbouring pixels that pass the condition connects them".into()
            }
            _ => "a later stage separated them".into(),
        }
    }

    /// The stage after the votes that merges instances.
    fn joining_stage(&self) -> &'static str {
        let is_merge =
            |stage: &&PostMergeStage| !matches!(stage, PostMergeStage::BackProjection { .. });
        match self.post_merge.iter().find(is_merge) {
            Some(PostMergeStage::Fragments { .. }) => "the merge of fragments by size",
            Some(PostMergeStage::BirdsEye { .. }) => "the bird's-eye merge",
            _ => "a later stage",
        }
    }
}

/// The merges between two points, with the votes of the weakest.
fn merges(votes: Option<&VoteEvidence>) -> String {
    let Some(VoteEvidence::Chain { links }) = votes else {
        return String::new();
    };
    let weakest = links.iter().min_by(|a, b| a.share().total_cmp(&b.share()));
    let weakest = weakest.map_or(String::new(), |link| {
        let which = if links.len() == 1 { "with" } else { "the weakest with" };
        format!(", {which} V+ {} to V- {}", link.positive, link.negative)
    });
    format!("{}{weakest}", counted(links.len(), "merge"))
}
