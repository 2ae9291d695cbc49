//! Every parameter as a keyword argument: its path without `cluster.`, and with `_` for `.`.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use divmerge::error::spelling::did_you_mean;
use divmerge::parameters::registry;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

/// The keyword of a parameter: `tree_gap` of `cluster.tree.gap`.
pub fn keyword(path: &str) -> String {
    path.strip_prefix("cluster.").unwrap_or(path).replace('.', "_")
}

/// The path of the parameter with a keyword.
pub fn path_of(keyword: &str) -> Option<&'static str> {
    static PATHS: LazyLock<BTreeMap<String, &str>> = LazyLock::new(|| {
        let paths = registry().iter().map(|parameter| parameter.path.as_str());
        paths.map(|path| (self::keyword(path), path)).collect()
    });
    PATHS.get(keyword).copied()
}

/// Whether a function with these arguments takes parameters by path, and so each as a keyword.
pub fn takes_settings(names: &[&[&str]]) -> bool {
    names.iter().any(|names| names.contains(&"set"))
}

/// `TypeError`: the function has no such argument, but perhaps one that is spelt nearly so.
pub fn unexpected(function: &str, name: &str, names: &[&[&str]]) -> PyErr {
    let parameters = registry().iter().filter(|_| takes_settings(names));
    let mut all: Vec<String> = parameters.map(|parameter| keyword(&parameter.path)).collect();
    all.extend(names.iter().copied().flatten().map(|name| (*name).to_owned()));
    let near = did_you_mean(name, all.iter());
    PyTypeError::new_err(format!("{function}() got an unexpected keyword argument '{name}'{near}"))
}
