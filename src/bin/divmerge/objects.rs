//! What is an object: the arguments, and where classes come from.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Result, anyhow};
use clap::{Args, ValueEnum};
use divmerge::Error;
use divmerge::annotate::{Method, ObjectSource, Objects};
use divmerge::io::classes::TOLERANCE_NS;
use divmerge::network::runtime::{Device, RuntimeKind, RuntimeOptions};
use divmerge::network::{NetworkImage, NetworkOptions};

use crate::arguments::{not_negative, positive, say, written};

/// What is an object.
#[derive(Args)]
pub struct ObjectArguments {
    /// Where objects come from: `field:NAME` a semantic class per point; `onnx:MODEL.onnx` a range-view network;
    /// `labels:DIR` a .label or .npy file per cloud, named by its number (000012.label) or its stamp in nanoseconds;
    /// `topic:T` a topic with a class per point, cloud or image; `ground` everything that ground removal leaves; `all` every
    /// return; `auto` a field label, semantic, class_id or class_ids if the cloud has one, else ground
    #[arg(long, value_name = "SOURCE", default_value = "auto", value_parser = ObjectSource::from_str)]
    semantics: ObjectSource,

    /// What the ids of classes mean: a YAML file in semantic-kitti-api's form, with an optional map `thing_class`
    /// (class: true) [default: the network's own configuration, else SemanticKITTI's ids]
    #[arg(long, value_name = "FILE")]
    taxonomy: Option<PathBuf>,

    /// How far in seconds the stamp of `topic:` or `labels:` may be from that of their cloud
    #[arg(long, value_name = "S", value_parser = not_negative, default_value_t = TOLERANCE_NS as f64 * 1e-9)]
    tolerance: f64,

    #[command(flatten)]
    network: NetworkArguments,
}

/// Where `--help` lists what is about networks.
const NETWORKS: &str = "Networks (--semantics onnx:)";

/// How a network is run.
#[derive(Args)]
struct NetworkArguments {
    /// What the network takes and gives: arch_cfg.yaml and data_cfg.yaml of its project, one after the other, or the folder
    /// with both [default: MODEL.yaml, or those two beside the model]
    #[arg(long, help_heading = NETWORKS, value_name = "FILE")]
    model_config: Vec<PathBuf>,

    /// Which range image it is given
    #[arg(long, help_heading = NETWORKS, value_enum, value_name = "IMAGE", default_value_t = Image::Auto)]
    model_image: Image,

    /// Multiply intensities by this to be those of its training [default: found in each cloud: 1, or where they go to 255 or
    /// 65535 and the network knows 0 to 1, 1/255 or 1/65535]
    #[arg(long, help_heading = NETWORKS, value_name = "X", value_parser = positive)]
    remission_scale: Option<f64>,

    /// Clouds that go through it at once, which pays off on graphics processors [default: 1, or as many as it must have]
    #[arg(long, help_heading = NETWORKS, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    batch: Option<u16>,

    /// What runs it
    #[arg(long, help_heading = NETWORKS, value_enum, default_value_t = Runtime::Auto)]
    runtime: Runtime,

    /// The shared library of ONNX Runtime, or the folder it is in [default: ORT_DYLIB_PATH, then that of PyPI's
    /// onnxruntime, then the system's]
    #[arg(long, help_heading = NETWORKS, value_name = "FILE")]
    onnxruntime: Option<PathBuf>,

    /// Where ONNX Runtime computes
    #[arg(long, help_heading = NETWORKS, value_enum, default_value_t = On::Auto)]
    device: On,
}

/// Which image a network is given.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Image {
    /// The one of its configuration, or the clustering's where that says none
    Auto,
    /// The one that is clustered, whatever its size; the network must take images of any
    Clustering,
}

/// What runs a network.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Runtime {
    /// ONNX Runtime where it is found, else tract where it is built in
    Auto,
    /// ONNX Runtime, from its shared library (pip install onnxruntime)
    Onnxruntime,
    /// tract, if this divmerge was built with the feature `tract`
    Tract,
}

/// Where ONNX Runtime computes.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum On {
    /// CUDA where library and machine have it, else the processor
    Auto,
    /// The processor
    Cpu,
    /// An NVIDIA graphics processor
    Cuda,
    /// The same through TensorRT, which compiles for minutes at the start
    Tensorrt,
}

impl ObjectArguments {
    /// Preset `best` on these objects, for the clouds of a recording or a folder.
    pub fn method(&self, recording: &Path) -> Result<Method> {
        let objects = Objects {
            source: self.semantics.clone(),
            taxonomy: self
                .taxonomy
                .as_deref()
                .map(divmerge::taxonomy_file::read_taxonomy)
                .transpose()?,
            tolerance_ns: (self.tolerance * 1e9).round() as u64,
            network: self.network.options(),
        };
        objects.method(recording).map_err(|error| match error {
            Error::Parameter { name, problem } => anyhow!("--{name} {problem}"),
            other => other.into(),
        })
    }

    /// The same arguments as words of a command line; nothing for those that were left out.
    pub fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        let mut say = |name: &str, value| say(&mut words, name, value);
        say(
            "semantics",
            (self.semantics != ObjectSource::Auto).then(|| self.semantics.to_string()),
        );
        say("taxonomy", self.taxonomy.as_ref().map(|path| path.display().to_string()));
        let usual = TOLERANCE_NS as f64 * 1e-9;
        say("tolerance", (self.tolerance != usual).then(|| self.tolerance.to_string()));
        let network = &self.network;
        for path in &network.model_config {
            say("model-config", Some(path.display().to_string()));
        }
        say(
            "model-image",
            (network.model_image != Image::Auto).then(|| written(network.model_image)),
        );
        say("remission-scale", network.remission_scale.map(|scale| scale.to_string()));
        say("runtime", (network.runtime != Runtime::Auto).then(|| written(network.runtime)));
        say("onnxruntime", network.onnxruntime.as_ref().map(|path| path.display().to_string()));
        say("device", (network.device != On::Auto).then(|| written(network.device)));
        words
    }
}

impl NetworkArguments {
    fn options(&self) -> NetworkOptions {
        NetworkOptions {
            model: PathBuf::new(),
            config: self.model_config.clone(),
            image: match self.model_image {
                Image::Auto => NetworkImage::Auto,
                Image::Clustering => NetworkImage::Clustering,
            },
            remission_scale: self.remission_scale.map(|scale| scale as f32),
            batch: self.batch.map_or(0, usize::from),
            runtime: RuntimeOptions {
                kind: match self.runtime {
                    Runtime::Auto => RuntimeKind::Auto,
                    Runtime::Onnxruntime => RuntimeKind::OnnxRuntime,
                    Runtime::Tract => RuntimeKind::Tract,
                },
                library: self.onnxruntime.clone(),
                device: match self.device {
                    On::Auto => Device::Auto,
                    On::Cpu => Device::Cpu,
                    On::Cuda => Device::Cuda,
                    On::Tensorrt => Device::TensorRt,
                },
                threads: 0,
            },
        }
    }
}
