//! The runtimes of networks: ONNX Runtime, whose shared library is loaded when a network is opened,
//! or tract, which is built in with the feature `tract`.

mod interface;
mod library;
mod onnx_runtime;
#[cfg(feature = "tract")]
mod tract;

use std::path::Path;

pub use interface::{Device, RuntimeKind, RuntimeOptions};
pub(super) use interface::{Runtime, Tensor};

/// Opens an ONNX file.
///
/// # Errors
/// What is wrong with it or with the runtime, in words.
pub(super) fn open(model: &Path, options: &RuntimeOptions) -> Result<Box<dyn Runtime>, String> {
    let library = library::find(options.library.as_deref());
    match (options.kind, library) {
        (RuntimeKind::Auto | RuntimeKind::OnnxRuntime, Some(library)) => {
            Ok(Box::new(onnx_runtime::OnnxRuntime::open(model, &library, options)?))
        }
        (RuntimeKind::OnnxRuntime, None) => Err(NO_LIBRARY.to_owned()),
        (RuntimeKind::Auto, None) if !HAS_TRACT => Err(NO_LIBRARY.to_owned()),
        (RuntimeKind::Tract | RuntimeKind::Auto, _) => open_tract(model),
    }
}

/// Whether tract is built in.
pub const HAS_TRACT: bool = cfg!(feature = "tract");

/// Whether the library of ONNX Runtime is found.
pub fn has_onnx_runtime() -> bool {
    library::find(None).is_some()
}

const NO_LIBRARY: &str = "nothing to run it: the shared library of ONNX Runtime is not found. \
                          `pip install onnxruntime` in the active environment, or name the library \
                          with --onnxruntime or ORT_DYLIB_PATH; or build divmerge with \
                          `--features tract`";

#[cfg(feature = "tract")]
fn open_tract(model: &Path) -> Result<Box<dyn Runtime>, String> {
    Ok(Box::new(tract::Tract::open(model)?))
}

#[cfg(not(feature = "tract"))]
fn open_tract(_: &Path) -> Result<Box<dyn Runtime>, String> {
    Err("this divmerge was built without tract; build it with `--features tract`".to_owned())
}
