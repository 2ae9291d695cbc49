//! Scores against truth, verdicts on objects, and classes spoiled on purpose.

pub mod corruption;
pub mod entropy;
pub mod panoptic;
pub mod report;
pub mod verdict;

pub use corruption::{Corruption, Surroundings, corrupt};
pub use entropy::Entropies;
pub use panoptic::{ClassQuality, Panoptic, PanopticQuality};
pub use report::Report;
pub use verdict::{Judged, Verdict, Verdicts, verdicts};
