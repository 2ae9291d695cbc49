//! LiDAR instance clustering by divide and merge.

pub mod cloud;
pub mod error;
pub mod grid;
pub mod simulate;
pub mod taxonomy;

pub use cloud::PointCloud;
pub use error::{Error, Result};
pub use grid::Grid;
pub use taxonomy::Taxonomy;
