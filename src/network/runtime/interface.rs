//! What every runtime of networks takes and gives.

use std::fmt::Debug;
use std::path::PathBuf;

/// The runtime of a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RuntimeKind {
    /// ONNX Runtime if its library is found, else tract if it is built in.
    #[default]
    Auto,
    /// ONNX Runtime, whose shared library is loaded: quicker, and with graphics processors.
    OnnxRuntime,
    /// tract, in Rust alone, with the feature `tract`.
    Tract,
}

/// Where ONNX Runtime computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Device {
    /// CUDA if the library and the machine have it, else the processor.
    #[default]
    Auto,
    /// The processor.
    Cpu,
    /// An NVIDIA graphics processor.
    Cuda,
    /// The same through TensorRT, which compiles a network for minutes when it is first opened.
    TensorRt,
}

/// The runtime and how it runs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RuntimeOptions {
    /// Which runtime.
    pub kind: RuntimeKind,
    /// The shared library of ONNX Runtime. Default: what `ORT_DYLIB_PATH` names, else that of
    /// PyPI's `onnxruntime` in the active or a usual place, else the system's.
    pub library: Option<PathBuf>,
    /// Where ONNX Runtime computes.
    pub device: Device,
    /// Threads of one run of ONNX Runtime on the processor; 0: as many as there are cores. tract
    /// has one, and runs of several clouds beside each other.
    pub threads: usize,
}

/// A four-dimensional array, row-major.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::network) struct Tensor {
    /// Images, channels, rows, columns.
    pub shape: [usize; 4],
    /// The values.
    pub values: Vec<f32>,
}

/// A network that can be run.
pub(in crate::network) trait Runtime: Send + Sync + Debug {
    /// Shape of its input; `None` where it takes any size.
    fn input(&self) -> Vec<Option<usize>>;

    /// Its first output for an input.
    ///
    /// # Errors
    /// A description of the problem.
    fn run(&self, input: Tensor) -> Result<Tensor, String>;

    /// Name and version, and where it computes.
    fn describe(&self) -> String;
}

/// The shape of an output, which must have four dimensions.
pub(super) fn four(shape: &[usize]) -> Result<[usize; 4], String> {
    shape.try_into().map_err(|_| {
        format!(
            "it gives {shape:?}: {} dimensions; images, classes, rows and columns are expected",
            shape.len()
        )
    })
}
