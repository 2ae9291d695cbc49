//! The library's warnings as Python's.

use std::ffi::CString;

use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;

use crate::keywords::as_keywords;

/// `UserWarning: TEXT`, in which options of the command line are named as keywords.
pub fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    let text = CString::new(as_keywords(text).replace('\0', " ")).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)
}
