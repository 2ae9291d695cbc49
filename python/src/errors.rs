//! The library's errors as Python's.

use std::path::Path;

use divmerge::Error as LibraryError;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyFileExistsError, PyOSError, PyTypeError, PyValueError};
use pyo3::prelude::*;

create_exception!(
    divmerge,
    Error,
    PyException,
    "What goes wrong in the library: a damaged recording, a field or a topic that is not there, an \
     output that is there \
     already. What the operating system refuses is an OSError, a wrong argument a ValueError or a \
     TypeError."
);

/// A library error: what the system refused as `OSError`, a parameter as `ValueError`, else
/// `divmerge.Error`.
pub fn raised(error: impl Into<LibraryError>) -> PyErr {
    let error = error.into();
    match &error {
        LibraryError::Io { path, source } => match source.raw_os_error() {
            // Python finds the class (FileNotFoundError, ...) by the number, and says it itself.
            Some(number) => {
                let words = source.to_string();
                let words = words.split(" (os error").next().unwrap_or_default().to_owned();
                PyOSError::new_err((number, words, path.display().to_string()))
            }
            None => std::io::Error::new(source.kind(), error.to_string()).into(),
        },
        LibraryError::Parameter(parameter) => wrong(parameter.name, parameter),
        LibraryError::Setting(problem) => wrong("set", problem),
        _ => Error::new_err(error.to_string()),
    }
}

/// `ValueError: NAME: PROBLEM`.
pub fn wrong(name: &str, problem: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(format!("{name}: {problem}"))
}

/// `TypeError: NAME: PROBLEM`.
pub fn wrong_type(name: &str, problem: impl std::fmt::Display) -> PyErr {
    PyTypeError::new_err(format!("{name}: {problem}"))
}

/// An output that may not be replaced.
pub fn exists_already(output: &Path) -> PyErr {
    let problem = format!("{} exists already; force=True replaces it", output.display());
    PyFileExistsError::new_err(problem)
}

/// Type of an object, for messages.
pub fn type_of(object: &Bound<'_, PyAny>) -> String {
    object.get_type().name().map_or_else(|_| "an object".to_owned(), |name| name.to_string())
}
