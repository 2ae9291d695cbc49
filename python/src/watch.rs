//! Looking on while the library works on a recording.

use std::ops::ControlFlow;

use divmerge::annotate::RunEvent;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyBool;

use crate::errors::{raised, wrong_type};
use crate::warnings::warn;

/// Whom the progress is told.
pub struct Progress {
    function: Py<PyAny>,
    /// Whether it is a bar of ours, which ends with the work.
    is_bar: bool,
}

/// A function of bytes read and bytes in all, or True for a bar.
pub fn progress(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Option<Progress>> {
    let py = value.py();
    match value.cast::<PyBool>() {
        Ok(wanted) if wanted.is_true() => {
            let module = py.import(intern!(py, "divmerge._progress"))?;
            let function = module.call_method1(intern!(py, "Bar"), ("divmerge",))?.unbind();
            Ok(Some(Progress { function, is_bar: true }))
        }
        Ok(_) => Ok(None),
        Err(_) if value.is_callable() => {
            Ok(Some(Progress { function: value.clone().unbind(), is_bar: false }))
        }
        Err(_) => {
            let problem = "expected True, or a function of bytes read and bytes in all";
            Err(wrong_type(name, problem))
        }
    }
}

/// What happens, told to whoever looks on.
pub type See<'a> = &'a mut dyn FnMut(RunEvent) -> ControlFlow<()>;

/// What some work of the library comes to, which Python looks on.
pub fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<Progress>,
    work: impl FnOnce(See) -> divmerge::Result<T> + Send,
) -> PyResult<T> {
    let mut watch = Watch { progress, failure: None };
    let made = py.detach(|| work(&mut |event| watch.see(event)));
    if let Some(progress) = watch.progress.filter(|progress| progress.is_bar) {
        progress.function.call_method0(py, intern!(py, "close"))?;
    }
    match watch.failure {
        Some(failure) => Err(failure),
        None => made.map_err(raised),
    }
}

/// Looks on while the library works; what Python raises ends the work.
struct Watch {
    progress: Option<Progress>,
    failure: Option<PyErr>,
}

impl Watch {
    fn see(&mut self, event: RunEvent) -> ControlFlow<()> {
        if self.failure.is_none() {
            self.failure = Python::attach(|py| self.tell(py, event)).err();
        }
        match self.failure {
            Some(_) => ControlFlow::Break(()),
            None => ControlFlow::Continue(()),
        }
    }

    fn tell(&self, py: Python<'_>, event: RunEvent) -> PyResult<()> {
        py.check_signals()?;
        match (event, &self.progress) {
            (RunEvent::Progress { bytes, total }, Some(progress)) => {
                progress.function.call1(py, (bytes, total)).map(drop)
            }
            (RunEvent::Warning(warning), _) => warn(py, warning),
            _ => Ok(()),
        }
    }
}
