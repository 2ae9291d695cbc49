//! Ego-motion: how the sensor moves from cloud to cloud, estimated from the clouds alone.
//!
//! ```text
//! cloud -> RegistrationScan -> alignment with the local map -> pose -> local map
//! ```
//!
//! As in KISS-ICP (Vizzo et al., RA-L 2023): constant velocity predicts the pose, a robust kernel
//! aligns the scan with a local map, and no pose is ever corrected later. Other than there the map
//! holds surfaces in place of points, and a point is held by the surface of its own voxel.
//!
//! The result is the same on any machine: sums are in the order of the points, no order of a hash
//! map matters, and only operations are used that IEEE 754 defines to the last bit. Sweeps are
//! taken as they are: what turned or moved the points within a sweep stays in them.

mod alignment;
mod drift;
mod estimator;
mod principal_axes;
mod scan;
mod surfels;
#[cfg(test)]
mod tests;

pub use alignment::Fit;
pub use drift::{Drift, drift};
pub use estimator::{EgoMotion, EgoMotionParams, LostReason, MotionEstimate};
pub use scan::{RegistrationScan, ScanParams};
