//! divmerge for Python: a thin layer over the library. Arrays become clouds, results become arrays;
//! what is done to them is the library's.

mod annotate;
mod arrays;
mod asked;
mod by_name;
mod cloud_run;
mod cluster;
mod clustering;
mod command;
mod compare;
mod drawing;
mod environment;
mod errors;
mod evaluate;
mod explain;
mod failures;
mod figure;
mod following;
mod frame;
mod frames;
mod keywords;
mod labelled;
mod notebook;
mod objects;
mod parameters;
mod registry;
mod result;
mod simulate;
mod slices;
mod taxonomy;
mod triage;
mod warnings;
mod watch;

use pyo3::prelude::*;

#[pymodule]
mod _divmerge {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::annotate::annotate;
    #[pymodule_export]
    use super::cluster::{cluster, cluster_image};
    #[pymodule_export]
    use super::compare::compare;
    #[pymodule_export]
    use super::errors::Error;
    #[pymodule_export]
    use super::evaluate::evaluate;
    #[pymodule_export]
    use super::explain::explain;
    #[pymodule_export]
    use super::failures::failures;
    #[pymodule_export]
    use super::figure::figure;
    #[pymodule_export]
    use super::frame::Frame;
    #[pymodule_export]
    use super::frames::{Frames, frames, topics};
    #[pymodule_export]
    use super::registry::parameters;
    #[pymodule_export]
    use super::result::ClusterResult;
    #[pymodule_export]
    use super::simulate::simulate;
    #[pymodule_export]
    use super::slices::{annotate_slice, join, plan};
    #[pymodule_export]
    use super::taxonomy::PyTaxonomy;
    #[pymodule_export]
    use super::triage::triage;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("REASONS", super::result::reasons())?;
        // For divmerge/__main__.py alone, so not among the names of `__all__`.
        module.setattr("_main", wrap_pyfunction!(super::command::main, module)?)
    }
}
