//! Scores against truth, and classes spoiled on purpose.

pub mod corruption;
pub mod panoptic;

pub use corruption::{Corruption, Surroundings, corrupt};
pub use panoptic::{ClassQuality, Panoptic, PanopticQuality};
