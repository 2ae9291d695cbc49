//! Which points are objects, and where their classes come from.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Result, anyhow};
use clap::Args;

use super::values::{NamedValue, not_negative, one_of, positive};
use crate::annotate::{AnnotateConfig, ObjectOptions, ObjectSource};
use crate::cli::exit::contradict;
use crate::error::spelling::did_you_mean;
use crate::frames::TOLERANCE_NS;
use crate::network::runtime::{Device, RuntimeKind, RuntimeOptions};
use crate::network::{NetworkImage, NetworkOptions};
use crate::taxonomy_file::read_taxonomy;
use crate::{Error, Taxonomy};

/// Which points are objects, and where their classes come from.
#[derive(Args)]
pub struct ObjectArguments {
    /// Where objects come from: `field:NAME` a semantic class per point; `onnx:MODEL.onnx` a
    /// range-view network; `labels:DIR` a .label or .npy file per cloud, named by its number
    /// (000012.label) or its stamp in nanoseconds; `topic:T` a topic with a class per point, cloud
    /// or image; `ground` everything but the ground; `all` every return; `auto` the first field of
    /// label, semantic, class_id and class_ids unless its ids mean nothing or contradict the
    /// geometry, else ground
    #[arg(long, value_name = "SOURCE", default_value = "auto")]
    #[arg(value_parser = ObjectSource::from_str)]
    semantics: ObjectSource,

    /// What the ids of the classes mean: `semantic-kitti`, `nuscenes` (lidarseg's raw ids), `waymo`
    /// (3D segmentation), `carla` (tags since 0.9.14), `carla-0.9.13` (tags before), or a YAML file
    /// in semantic-kitti-api's form, with an optional map `thing_class` (class: true) [default: the
    /// network's own configuration, else semantic-kitti, or the one of these that ids and geometry
    /// agree with]
    #[arg(long, value_name = "NAME|FILE")]
    taxonomy: Option<PathBuf>,

    /// Maximum difference in seconds between the stamps of `topic:` or `labels:` and of their cloud
    #[arg(long, value_name = "S", value_parser = not_negative)]
    #[arg(default_value_t = TOLERANCE_NS as f64 * 1e-9)]
    tolerance: f64,

    #[command(flatten)]
    network: NetworkArguments,
}

/// Heading of these options in `--help`.
const NETWORKS: &str = "Networks (--semantics onnx:)";

/// How a network is run.
#[derive(Args)]
struct NetworkArguments {
    /// Inputs and outputs of the network: arch_cfg.yaml and data_cfg.yaml of its project, one after
    /// the other, or the folder with both [default: MODEL.yaml, or those two beside the model]
    #[arg(long, help_heading = NETWORKS, value_name = "FILE")]
    model_config: Vec<PathBuf>,

    /// Range image that the network gets
    #[arg(long, help_heading = NETWORKS, value_name = "IMAGE", default_value = "auto")]
    #[arg(value_parser = one_of(IMAGES))]
    model_image: NetworkImage,

    /// Factor from the clouds' intensities to those of the training [default: found in each cloud:
    /// 1, or if they reach 255 or 65535 and the network expects 0 to 1, 1/255 or 1/65535]
    #[arg(long, help_heading = NETWORKS, value_name = "X", value_parser = positive)]
    remission_scale: Option<f64>,

    /// Clouds in one run of the network; more than one pays off on GPUs [default: 1, or the batch
    /// size of the model]
    #[arg(long, help_heading = NETWORKS, value_name = "N")]
    #[arg(value_parser = clap::value_parser!(u16).range(1..=256))]
    batch: Option<u16>,

    /// Inference library
    #[arg(long, help_heading = NETWORKS, default_value = "auto")]
    #[arg(value_parser = one_of(RUNTIMES))]
    runtime: RuntimeKind,

    /// Shared library of ONNX Runtime, or its folder [default: ORT_DYLIB_PATH, then PyPI's
    /// onnxruntime, then the system's]
    #[arg(long, help_heading = NETWORKS, value_name = "FILE")]
    onnxruntime: Option<PathBuf>,

    /// Device of ONNX Runtime
    #[arg(long, help_heading = NETWORKS, default_value = "auto")]
    #[arg(value_parser = one_of(DEVICES))]
    device: Device,
}

const IMAGES: &[NamedValue<NetworkImage>] = &[
    (
        "auto",
        "The image of its configuration; without one, that of the clustering",
        NetworkImage::Auto,
    ),
    (
        "clustering",
        "The image of the clustering, whatever its size; the network must accept any size",
        NetworkImage::Clustering,
    ),
];

const RUNTIMES: &[NamedValue<RuntimeKind>] = &[
    ("auto", "ONNX Runtime if found, else tract if built in", RuntimeKind::Auto),
    (
        "onnxruntime",
        "ONNX Runtime from its shared library (pip install onnxruntime)",
        RuntimeKind::OnnxRuntime,
    ),
    ("tract", "tract, in a divmerge built with the feature `tract`", RuntimeKind::Tract),
];

const DEVICES: &[NamedValue<Device>] = &[
    ("auto", "CUDA if available, else CPU", Device::Auto),
    ("cpu", "CPU", Device::Cpu),
    ("cuda", "NVIDIA GPU", Device::Cuda),
    ("tensorrt", "NVIDIA GPU with TensorRT; compiles for minutes at the start", Device::TensorRt),
];

impl ObjectArguments {
    /// The files and folders that are read.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let source = match &self.semantics {
            ObjectSource::Onnx(path) | ObjectSource::Labels(path) => Some(path),
            _ => None,
        };
        let NetworkArguments { model_config, onnxruntime, .. } = &self.network;
        let files = source.into_iter().chain(&self.taxonomy).chain(model_config).chain(onnxruntime);
        files.map(PathBuf::as_path)
    }

    /// Preset `best` on these objects, for the clouds of a recording or a folder.
    pub fn config(&self, recording: &Path) -> Result<AnnotateConfig> {
        let objects = ObjectOptions {
            source: self.semantics.clone(),
            taxonomy: self.taxonomy.as_deref().map(named_or_file).transpose()?,
            tolerance_ns: (self.tolerance * 1e9).round() as u64,
            network: self.network.options(),
        };
        objects.config(recording).map_err(|error| match error {
            Error::Parameter(wrong) => anyhow!("--{} {wrong}", wrong.name),
            other => other.into(),
        })
    }
}

/// The taxonomy of a name or a file, or SemanticKITTI's.
pub fn taxonomy(file: Option<&Path>) -> Result<Taxonomy> {
    Ok(file.map(named_or_file).transpose()?.unwrap_or_else(Taxonomy::semantic_kitti))
}

/// The taxonomy of a name or a file. A word without a dot is no file that is missing, but a name.
fn named_or_file(name: &Path) -> Result<Taxonomy> {
    let word = name.to_str().filter(|word| !word.contains(['.', '/', '\\']) && !name.exists());
    match word.filter(|word| Taxonomy::named(word).is_none()) {
        None => Ok(read_taxonomy(name)?),
        Some(word) => {
            let names = Taxonomy::known().iter().map(|known| known.name.as_str());
            let names: Vec<&str> = names.collect();
            contradict!(
                "--taxonomy {word}: use {} or a YAML file{}",
                names.join(", "),
                did_you_mean(word, &names)
            )
        }
    }
}

impl NetworkArguments {
    fn options(&self) -> NetworkOptions {
        NetworkOptions {
            model: PathBuf::new(),
            config: self.model_config.clone(),
            image: self.model_image,
            remission_scale: self.remission_scale.map(|scale| scale as f32),
            batch: self.batch.map_or(0, usize::from),
            runtime: RuntimeOptions {
                kind: self.runtime,
                library: self.onnxruntime.clone(),
                device: self.device,
                threads: 0,
            },
        }
    }
}
