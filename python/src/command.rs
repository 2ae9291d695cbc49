//! The command line, for `divmerge/__main__.py`.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the command line in this process, whose signals, panics and end it takes over, and returns
/// the exit code. `program` starts it again: the interpreter and the script.
#[pyfunction]
#[pyo3(name = "_main", signature = (program, words), text_signature = None)]
pub fn main(py: Python<'_>, program: Vec<OsString>, words: Vec<OsString>) -> u8 {
    py.detach(|| divmerge::cli::main(program, words))
}
