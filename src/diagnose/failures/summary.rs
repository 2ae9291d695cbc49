//! The verdicts and failures of all frames, counted.

use std::collections::BTreeMap;

use serde::Serialize;

use super::find::Failures;
use crate::evaluate::JudgedObject;

/// Objects with one verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct VerdictCount {
    /// True objects.
    pub r#true: u64,
    /// Found instances.
    pub found: u64,
}

/// The verdicts and failures of all frames, counted.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct FailureSummary {
    /// Number of frames.
    pub frames: u64,
    /// By name of the verdict; small unmatched objects are left out.
    pub verdicts: BTreeMap<&'static str, VerdictCount>,
    /// Small unmatched objects.
    pub small: VerdictCount,
    /// Found instances outside true things, if classes are not compared.
    pub elsewhere: u64,
    /// Failures by step and verdict.
    pub causes: BTreeMap<&'static str, BTreeMap<&'static str, u64>>,
}

impl FailureSummary {
    /// Adds a frame.
    pub fn add(&mut self, frame: &Failures) {
        self.frames += 1;
        self.elsewhere += frame.verdicts.elsewhere;
        self.count(&frame.verdicts.truth, |count| &mut count.r#true);
        self.count(&frame.verdicts.found, |count| &mut count.found);
        for failure in &frame.failures {
            let by_verdict = self.causes.entry(failure.cause.step()).or_default();
            *by_verdict.entry(failure.judged.verdict.name()).or_default() += 1;
        }
    }

    /// Number of failures.
    pub fn failures(&self) -> u64 {
        self.causes.values().flat_map(BTreeMap::values).sum()
    }

    fn count(&mut self, judged: &[JudgedObject], side: impl Fn(&mut VerdictCount) -> &mut u64) {
        for one in judged {
            let count = match one.is_small {
                true => &mut self.small,
                false => self.verdicts.entry(one.verdict.name()).or_default(),
            };
            *side(count) += 1;
        }
    }
}
