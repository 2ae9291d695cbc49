//! LiDAR instance clustering by divide and merge, from a point cloud to an instance per point.
//!
//! No I/O: this crate neither opens files nor knows recordings, so that a robot can embed the
//! method.

pub mod cloud;
pub mod cluster;
pub mod error;
pub mod geometry;
pub mod over_time;
pub mod parameters;
pub mod pipeline;
pub mod range_image;
pub mod semantics;

pub use cloud::point_cloud::PointCloud;
pub use cloud::taxonomy::Taxonomy;
pub use error::{CloudError, ParameterError};
