//! Scores against truth, and verdicts on single objects.

pub mod difference;
pub mod entropy;
pub mod evaluation;
pub mod hota;
pub mod identity;
pub mod objects;
pub mod occlusion;
pub mod over_time;
pub mod overlaps;
pub mod panoptic;
pub mod report;
pub mod things;
pub mod tracking;
pub mod verdict;

pub use difference::{Change, Difference, differences};
pub use entropy::Entropies;
pub use evaluation::{Evaluation, MetricSet, SCAN_STEP_NS, ScanLabels, Scores};
pub use hota::Hota;
pub use identity::IdChanges;
pub use objects::ObjectScores;
pub use occlusion::OcclusionCases;
pub use over_time::{Lstq, OverTime, TubeAssociation};
pub use panoptic::{ClassQuality, Panoptic, PanopticQuality};
pub use report::{PanopticReport, PresentMeans};
pub use things::{ThingScore, thing_scores};
pub use tracking::{Tracking, TrackingScores};
pub use verdict::{JudgedObject, Verdict, Verdicts, verdicts};
