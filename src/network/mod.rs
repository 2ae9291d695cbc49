//! Classes from a network: the first half of the paper's pipeline (section III, where Cylinder3D
//! gives every point a class), for range-view networks of the RangeNet++ family in ONNX.
//!
//! A cloud becomes the network's input image (`image`), the network gives a distribution over its
//! classes for every pixel (`scores`), and points take theirs from the pixels around them (`knn`):
//! class, confidence and entropy of each.

mod config;
mod image;
mod inference;
mod knn;
mod knn_params;
mod model;
mod options;
pub mod runtime;
mod scores;

pub use config::NetworkConfig;
pub use inference::Network;
pub use options::{NetworkImage, NetworkOptions};
pub(crate) use scores::distributions;
