//! What is installed beside the package, which `divmerge/_environment.py` finds.

use std::path::PathBuf;

use pyo3::prelude::*;

/// The folder with the shared library of ONNX Runtime, unless a variable names another.
pub fn onnxruntime(py: Python<'_>) -> PyResult<Option<PathBuf>> {
    py.import("divmerge._environment")?.call_method0("onnxruntime")?.extract()
}
