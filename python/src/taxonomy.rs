//! What the ids of classes mean.

use std::path::PathBuf;

use divmerge::Taxonomy;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

use crate::errors::{raised, type_of, wrong_type};

/// What the ids of classes mean: which are things, which are one class, what they are called.
///
/// ``Taxonomy()`` is SemanticKITTI's; ``Taxonomy("semantic-kitti")``, ``"nuscenes"``, ``"waymo"``,
/// ``"carla"`` and ``"carla-0.9.13"`` are those data sets'; ``Taxonomy(path)`` reads a YAML file in
/// semantic-kitti-api's form, with an optional map ``thing_class`` (class: true).
#[pyclass(frozen, name = "Taxonomy", module = "divmerge")]
pub struct PyTaxonomy {
    pub inner: Taxonomy,
}

static SEMANTIC_KITTI: PyOnceLock<Py<PyTaxonomy>> = PyOnceLock::new();

impl PyTaxonomy {
    /// SemanticKITTI's.
    pub fn usual(py: Python<'_>) -> PyResult<Py<PyTaxonomy>> {
        let make = || Py::new(py, PyTaxonomy { inner: Taxonomy::semantic_kitti() });
        SEMANTIC_KITTI.get_or_try_init(py, make).map(|usual| usual.clone_ref(py))
    }

    /// Of an argument: a taxonomy, or the path of its file.
    pub fn of(value: &Bound<'_, PyAny>) -> PyResult<Py<PyTaxonomy>> {
        if let Ok(taxonomy) = value.cast::<PyTaxonomy>() {
            return Ok(taxonomy.clone().unbind());
        }
        let problem = |_| {
            wrong_type("taxonomy", format!("expected a Taxonomy or a path, got {}", type_of(value)))
        };
        let path: PathBuf = value.extract().map_err(problem)?;
        Py::new(
            value.py(),
            PyTaxonomy { inner: divmerge::taxonomy_file::read_taxonomy(&path).map_err(raised)? },
        )
    }
}

#[pymethods]
impl PyTaxonomy {
    #[new]
    #[pyo3(signature = (path=None))]
    fn new(path: Option<PathBuf>) -> PyResult<Self> {
        let inner = match path {
            Some(path) => divmerge::taxonomy_file::read_taxonomy(&path).map_err(raised)?,
            None => Taxonomy::semantic_kitti(),
        };
        Ok(PyTaxonomy { inner })
    }

    /// Its name, such as `semantic-kitti`.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }

    /// Names of the classes by class number; 0 is "no class".
    #[getter]
    fn classes(&self) -> Vec<&str> {
        self.inner.classes().iter().map(|class| class.name.as_str()).collect()
    }

    /// Class numbers of the things: the classes whose objects are cut into instances.
    #[getter]
    fn things(&self) -> Vec<usize> {
        let classes = self.inner.classes().iter().enumerate();
        classes.filter(|(_, class)| class.is_thing).map(|(number, _)| number).collect()
    }

    /// The raw ids that are known, each with its class number.
    #[getter]
    fn ids(&self) -> std::collections::BTreeMap<u16, u16> {
        self.inner.known_ids().collect()
    }

    fn __repr__(&self) -> String {
        format!("Taxonomy({}: {} classes)", self.inner.name, self.inner.classes().len())
    }
}
