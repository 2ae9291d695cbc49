//! LiDAR instance clustering by divide and merge (Zhao, Zhang, Huang, arXiv 2109.08224).
//!
//! A sweep of a LiDAR becomes a [range image](range_image); a [mask](semantics) says which of its pixels
//! belong to objects; every half metre of object grows a local component from a seed, and pairs of pixels
//! on the borders of components vote on whether they belong together ([divide](cluster::divide())); the
//! votes alone [merge](cluster::merge()) components into instances; each point gets an instance or a
//! [reason](instances::Reason) why it has none.
//!
//! ```
//! use divmerge::pipeline::{self, Config};
//! use divmerge::semantics::MaskSource;
//! use divmerge::simulate::{Drive, Scene, Sensor};
//! use divmerge::Taxonomy;
//!
//! let frame = Drive::new(Sensor::Vlp16, Scene::Street, 1).frame(0);
//! let taxonomy = Taxonomy::semantic_kitti();
//! let stages = pipeline::run(&frame.cloud, MaskSource::Classes(&taxonomy), &Config::default());
//! let first = &stages.instances[0];
//! println!("{} at {:?} m, {} points", first.class_name, first.bounds.centre, first.points);
//! for step in &stages.merge.steps {
//!     let (ayes, noes) = (step.positive, step.negative);
//!     println!("component {} joined {}: {ayes} votes to {noes}", step.query, step.target);
//! }
//! ```
//!
//! [`annotate`](annotate::annotate) does that to every cloud of a recording and writes the recording again
//! with the results in it. `docs/architecture.md` shows the way through the code.

pub mod annotate;
pub mod comparison;
pub mod datasets;
pub mod diagnose;
pub mod error;
pub mod evaluate;
pub mod frames;
pub mod io;
pub mod messages;
pub mod network;
pub mod palette;
pub mod taxonomy_file;
pub mod text;
pub mod view;

/// Instances, as they were named before (interim).
pub mod instances {
    pub use divmerge_core::cloud::*;
}
pub use divmerge_core::cloud::{self, sensor_frame, taxonomy};
pub use divmerge_core::geometry::{disjoint_sets, footprint, grid, kd_tree, statistics};
pub use divmerge_core::{cluster, pipeline, range_image, semantics};
pub use divmerge_simulate as simulate;

pub use cloud::{PointCloud, PointColumns};
pub use diagnose::{explain, failures, triage};
pub use divmerge_recording::{stopwatch, workers};
pub use error::{Error, Result};
pub use grid::Grid;
pub use taxonomy::Taxonomy;
