//! Scores against truth, and classes spoiled on purpose.

pub mod corruption;
pub mod entropy;
pub mod panoptic;
pub mod report;

pub use corruption::{Corruption, Surroundings, corrupt};
pub use entropy::Entropies;
pub use panoptic::{ClassQuality, Panoptic, PanopticQuality};
pub use report::Report;
