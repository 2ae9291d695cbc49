//! ONNX Runtime, through its shared library.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use ort::environment::Environment;
use ort::ep;
use ort::logging::LogLevel;
use ort::session::Session;
use ort::value::{TensorRef, ValueType};

use super::interface::{Device, Runtime, RuntimeOptions, Tensor, four};

/// A network for ONNX Runtime. One run at a time, on several threads.
#[derive(Debug)]
pub(super) struct OnnxRuntime {
    session: Mutex<Session>,
    input: Vec<Option<usize>>,
    device: &'static str,
    version: String,
}

impl OnnxRuntime {
    pub(super) fn open(
        model: &Path,
        library: &Path,
        options: &RuntimeOptions,
    ) -> Result<Self, String> {
        let loading = |problem: String| format!("ONNX Runtime in {}: {problem}", library.display());
        let environment = environment(library).map_err(loading)?;
        let (providers, device) = providers(options.device);
        let open = || {
            let builder = Session::builder(&environment)?;
            let builder = builder.with_execution_providers(providers)?;
            let builder = builder.with_intra_threads(options.threads)?;
            // Problems are returned; they are not logged too.
            let builder = builder.with_log_level(LogLevel::Fatal)?;
            let mut builder = builder.with_deterministic_compute(true)?;
            builder.commit_from_file(model)
        };
        let session: Session =
            open().map_err(|error: ort::Error| format!("ONNX Runtime cannot open it: {error}"))?;
        let input = session.inputs().first().ok_or("it takes no input")?;
        let ValueType::Tensor { shape, .. } = input.dtype() else {
            return Err(format!("its input is {:?} and no tensor", input.dtype()));
        };
        let input = shape.iter().map(|&size| usize::try_from(size).ok()).collect();
        let version = version(library);
        Ok(OnnxRuntime { session: Mutex::new(session), input, device, version })
    }
}

/// The environment of this process, of which ONNX Runtime allows one; and so one library.
fn environment(library: &Path) -> Result<Environment, String> {
    static KNOWN: Mutex<Option<(PathBuf, Environment)>> = Mutex::new(None);
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    match &*known {
        Some((loaded, environment)) if loaded == library => Ok(environment.clone()),
        Some((loaded, _)) => Err(format!("{} is in use already", loaded.display())),
        None => {
            let builder = ort::init_from(library).map_err(|error| error.to_string())?;
            let made = builder.build().map_err(|error| error.to_string())?;
            *known = Some((library.to_owned(), made.clone()));
            Ok(made)
        }
    }
}

/// What is tried in turn, and its name.
fn providers(device: Device) -> (Vec<ep::ExecutionProviderDispatch>, &'static str) {
    let cuda = || ep::CUDA::default().build();
    match device {
        Device::Cpu => (vec![], "the processor"),
        Device::Auto => (vec![cuda()], "CUDA where there is one"),
        Device::Cuda => (vec![cuda().error_on_failure()], "CUDA"),
        Device::TensorRt => {
            let tensor_rt = ep::TensorRT::default().build().error_on_failure();
            (vec![tensor_rt, cuda()], "TensorRT")
        }
    }
}

/// The version by the name of the library, `libonnxruntime.so.1.22.0` or
/// `libonnxruntime.1.22.0.dylib`; else what it says of its build.
fn version(library: &Path) -> String {
    let real = library.canonicalize().unwrap_or_else(|_| library.to_owned());
    let name = real.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let parts: Vec<&str> = name.split('.').filter(|part| part.parse::<u32>().is_ok()).collect();
    match parts.is_empty() {
        true => ort::info().to_owned(),
        false => parts.join("."),
    }
}

impl Runtime for OnnxRuntime {
    fn input(&self) -> Vec<Option<usize>> {
        self.input.clone()
    }

    fn run(&self, input: Tensor) -> Result<Tensor, String> {
        let mut session = self.session.lock().unwrap_or_else(PoisonError::into_inner);
        let mut run = || {
            let view = TensorRef::from_array_view((input.shape, input.values.as_slice()))?;
            let output = session.run(ort::inputs![view])?;
            let (shape, values) = output[0].try_extract_tensor::<f32>()?;
            let shape: Vec<usize> = shape.iter().map(|&size| size as usize).collect();
            Ok((shape, values.to_vec()))
        };
        let (shape, values) =
            run().map_err(|error: ort::Error| format!("ONNX Runtime cannot run it: {error}"))?;
        Ok(Tensor { shape: four(&shape)?, values })
    }

    fn describe(&self) -> String {
        format!("ONNX Runtime {} on {}", self.version, self.device)
    }
}
