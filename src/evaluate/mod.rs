//! Scores against truth.

pub mod entropy;
pub mod panoptic;

pub use entropy::Entropies;
pub use panoptic::{ClassQuality, Panoptic, PanopticQuality};
