//! How a network is run.

use std::path::PathBuf;

use super::runtime::RuntimeOptions;

/// Which image a network is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NetworkImage {
    /// The one it was trained on, if its configuration says which; else the clustering's.
    #[default]
    Auto,
    /// The one that is clustered: it needs no second projection, and gives each return a pixel of
    /// its own even if the network was trained on another sensor. The network has to take images of
    /// any size.
    Clustering,
}

/// A network and how to run it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NetworkOptions {
    /// The ONNX file.
    pub model: PathBuf,
    /// Files with its configuration, or folders that hold an `arch_cfg.yaml` and a `data_cfg.yaml`;
    /// none: `MODEL.yaml` beside `MODEL.onnx`, or the two files in its folder.
    pub config: Vec<PathBuf>,
    /// The image that it is given.
    pub image: NetworkImage,
    /// Factor that makes the remission of a cloud that of its training. Default: found for each
    /// cloud from its values.
    pub remission_scale: Option<f32>,
    /// Images that it is given at once. Default 0: as many as it takes, one if it takes any number.
    pub batch: usize,
    /// The runtime.
    pub runtime: RuntimeOptions,
}
