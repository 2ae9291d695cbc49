//! LiDAR instance clustering by divide and merge.

pub mod annotate;
pub mod cloud;
pub mod cluster;
pub mod error;
pub mod evaluate;
pub mod footprint;
pub mod grid;
pub mod instances;
pub mod io;
pub mod palette;
pub mod pipeline;
pub mod range_image;
pub mod replay;
pub mod semantics;
pub mod simulate;
pub mod taxonomy;
pub mod view;

pub use cloud::PointCloud;
pub use error::{Error, Result};
pub use grid::Grid;
pub use taxonomy::Taxonomy;
