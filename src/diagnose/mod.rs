//! Where a run went wrong: [`failures`] with the truth at hand, [`triage`] without it; [`explain`]
//! says why two points are one instance or are not.

pub mod explain;
pub mod failures;
pub mod frame_links;
pub mod track;
pub mod triage;
