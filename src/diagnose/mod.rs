//! Where a run went wrong: [`failures`] with the truth at hand, [`triage`] without it.

pub mod failures;
pub mod triage;
