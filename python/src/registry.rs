//! The list of parameters.

use divmerge::parameters::ParameterSet;
use divmerge::pipeline::Preset;
use pyo3::prelude::*;
use pyo3::types::PyString;
use serde_json::{Value, json};

use crate::annotate::from_json;
use crate::by_name::keyword;
use crate::errors::Error;
use crate::parameters::preset as named_preset;

#[pyfunction]
#[pyo3(signature = (preset = None), text_signature = "(preset='best')")]
/// Every parameter that `set` takes, as a list of dicts: path, doc, unit (None for shares and
/// counts), source (None: ours), kind ("number", "whole", "flag", "switch", "choice" or "list"),
/// limits (min, max, above, below), slider (what is usual), choices, value: that of the preset,
/// None where its part of the method is off, and keyword: its name as an argument of `cluster`,
/// `annotate` and all other functions that take `set`.
pub fn parameters<'py>(
    py: Python<'py>,
    preset: Option<&Bound<'py, PyString>>,
) -> PyResult<Bound<'py, PyAny>> {
    let preset = preset.map_or(Ok(Preset::default()), |name| named_preset("preset", name))?;
    let set = ParameterSet::of_preset(preset);
    let rows = set.parameters().into_iter().map(|parameter| {
        let value = set.get(&parameter.path).ok().flatten();
        let mut row = json!(&parameter);
        row["value"] = value.unwrap_or_default();
        row["keyword"] = keyword(&parameter.path).into();
        row
    });
    let rows: Vec<Value> = rows.collect();
    let text = serde_json::to_string(&rows).map_err(|error| Error::new_err(error.to_string()))?;
    from_json(py, &text)
}
