//! Scores against truth.

pub mod panoptic;

pub use panoptic::{ClassQuality, Panoptic, PanopticQuality};
