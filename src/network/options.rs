//! How a network is run.

use std::path::PathBuf;

use super::runtime::RuntimeOptions;

/// Which image a network is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NetworkImage {
    /// The one it was trained on, where its configuration says which; else the clustering's.
    #[default]
    Auto,
    /// The one that is clustered: no second projection, and each return its own pixel where the
    /// sensor is not the one that the network was trained on. The network must take images of any
    /// size.
    Clustering,
}

/// A network, and how it is run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NetworkOptions {
    /// The ONNX file.
    pub model: PathBuf,
    /// Files with its configuration ([`NetworkConfig::read`]); none: those beside it
    /// ([`NetworkConfig::beside`]).
    pub config: Vec<PathBuf>,
    /// Which image it is given.
    pub image: NetworkImage,
    /// By what remission is multiplied to be that of its training. Default: found in each cloud
    /// ([`remission_scale`]).
    pub remission_scale: Option<f32>,
    /// Images that go through it at once. 0, the default: as many as it takes, one where it takes
    /// any number.
    pub batch: usize,
    /// What it runs on.
    pub runtime: RuntimeOptions,
}
