//! Files and messages.
pub mod semantic_kitti;
