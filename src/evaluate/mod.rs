//! Scores against truth, verdicts on objects, and classes spoiled on purpose.

pub mod corruption;
pub mod difference;
pub mod entropy;
pub mod over_time;
pub mod panoptic;
pub mod report;
pub mod sums;
pub mod verdict;

pub use corruption::{Corruption, Surroundings, corrupt};
pub use difference::{Change, Difference, differences};
pub use entropy::Entropies;
pub use over_time::{Lstq, OverTime};
pub use panoptic::{ClassQuality, Panoptic, PanopticQuality};
pub use report::Report;
pub use sums::{Figures, Labels, Sums, Wanted};
pub use verdict::{Judged, Verdict, Verdicts, verdicts};
