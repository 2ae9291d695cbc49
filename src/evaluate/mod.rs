//! Scores against truth, and verdicts on single objects.

pub mod difference;
pub mod entropy;
pub mod evaluation;
pub mod identity;
pub mod over_time;
pub mod panoptic;
pub mod report;
pub mod things;
pub mod verdict;

pub use difference::{Change, Difference, differences};
pub use entropy::Entropies;
pub use evaluation::{Evaluation, MetricSet, ScanLabels, Scores};
pub use identity::{IdChanges, Identity};
pub use over_time::{Lstq, OverTime};
pub use panoptic::{ClassQuality, Panoptic, PanopticQuality};
pub use report::PanopticReport;
pub use things::{ThingScore, thing_scores};
pub use verdict::{JudgedObject, Verdict, Verdicts, verdicts};
