//! What a page changes of the parameters of a run.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::session::SessionOptions;
use crate::annotate::AnnotateConfig;
use crate::comparison::methods;
use crate::error::Result;
use crate::frames::FrameBoxes;
use divmerge_core::ParameterError;
use divmerge_core::pipeline::{Overrides, Preset};

/// The name of our own method.
const OWN_METHOD: &str = "divide-and-merge";

/// What a page changes of the parameters that the inspector was started with.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Setting {
    /// Another preset.
    pub preset: Option<String>,
    /// Another method.
    pub method: Option<String>,
    /// Single parameters, by their path.
    pub set: BTreeMap<String, Value>,
}

impl Setting {
    /// The configuration with these changes.
    ///
    /// # Errors
    /// [`Error::Parameter`](crate::Error::Parameter) if there is no such preset, method or
    /// parameter, or a value is out of its limits.
    pub(super) fn config(&self, options: &SessionOptions) -> Result<AnnotateConfig> {
        let mut config = options.config.clone();
        let overrides = self.overrides(&options.overrides)?;
        if overrides != options.overrides {
            let other_method = config.pipeline.other_method.take();
            config.pipeline = overrides.config()?;
            config.pipeline.other_method = other_method;
        }
        if let Some(name) = &self.method {
            config.pipeline.other_method = match name.as_str() {
                OWN_METHOD => None,
                name => Some(methods::named(name, &config.taxonomy).ok_or_else(|| {
                    ParameterError::new("method", format!("there is no method `{name}`"))
                })?),
            };
        }
        if config.pipeline.method_name() == "boxes" && config.boxes == FrameBoxes::Nothing {
            let problem = "the method `boxes` needs boxes: start the inspector with --boxes";
            return Err(ParameterError::new("method", problem).into());
        }
        Ok(config)
    }

    fn overrides(&self, given: &Overrides) -> Result<Overrides> {
        let mut overrides = *given;
        if let Some(preset) = &self.preset {
            overrides.preset = preset
                .parse::<Preset>()
                .map_err(|problem| ParameterError::new("preset", problem))?;
        }
        for (name, value) in &self.set {
            set(&mut overrides, name, value)?;
        }
        Ok(overrides)
    }

    /// The changes in words, to follow a heading; empty if there are none.
    pub(super) fn in_words(&self) -> String {
        let set = self.set.iter().map(|(name, value)| format!("{name} {}", plain(value)));
        match set.collect::<Vec<_>>().join(", ") {
            words if words.is_empty() => words,
            words => format!("  ·  {words}"),
        }
    }

    /// The options that were given with these changes, as words of a command line.
    pub(super) fn words(&self, given: &[String]) -> Vec<String> {
        let mut changes: Vec<(String, String)> = Vec::new();
        changes.extend(self.preset.iter().map(|preset| ("--preset".to_owned(), preset.clone())));
        changes.extend(self.method.iter().map(|method| ("--method".to_owned(), method.clone())));
        let set = self.set.iter();
        changes.extend(set.map(|(name, value)| (format!("--{name}"), plain(value))));
        let mut words = Vec::new();
        let mut given = given.iter().peekable();
        while let Some(word) = given.next() {
            let option = word.split_once('=').map_or(word.as_str(), |(option, _)| option);
            let has_value = !word.contains('=') && given.peek().is_some();
            let value = given.next_if(|_| has_value);
            if !changes.iter().any(|(changed, _)| changed == option) {
                words.push(word.clone());
                words.extend(value.cloned());
            }
        }
        words.extend(changes.into_iter().flat_map(|(option, value)| [option, value]));
        words
    }
}

/// A value as on the command line.
fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// Sets what an option of the command line sets.
fn set(overrides: &mut Overrides, name: &str, value: &Value) -> Result<()> {
    let wrong = |known: &'static str| {
        ParameterError::new(known, format!("`{}` is no value of {known}", plain(value)))
    };
    let number = |known| value.as_f64().ok_or_else(|| wrong(known));
    let whole = |known| value.as_u64().map(|n| n as usize).ok_or_else(|| wrong(known));
    match name {
        "voxel" => overrides.voxel = Some(number("voxel")?),
        "angle" => overrides.angle = Some(number("angle")?),
        "gap-columns" => overrides.gap_columns = Some(whole("gap-columns")?),
        "gap-rows" => overrides.gap_rows = Some(whole("gap-rows")?),
        "min-points" => overrides.min_points = Some(whole("min-points")?),
        "bev" => {
            let parsed = plain(value).parse();
            overrides.bev = Some(parsed.map_err(|problem| ParameterError::new("bev", problem))?);
        }
        other => {
            let problem = format!("there is no parameter `{other}`");
            return Err(ParameterError::new("set", problem).into());
        }
    }
    Ok(())
}

/// The names of all methods, ours first.
pub(super) fn method_names() -> Vec<&'static str> {
    [OWN_METHOD].into_iter().chain(methods::NAMES).collect()
}

/// The parameters that a page can change.
pub(super) fn parameters(options: &SessionOptions) -> Value {
    let cluster = &options.config.pipeline.cluster;
    serde_json::json!([
        {"path": "voxel", "doc": "Side of a voxel of the divide step", "unit": "m",
         "kind": "number", "range": [0.05, 5.0], "default": cluster.voxel},
        {"path": "angle", "doc": "Least angle beta between neighbours of one object",
         "unit": "degrees", "kind": "number", "range": [0.0, 60.0],
         "default": cluster.condition.angle.to_degrees()},
        {"path": "gap-columns", "doc": "Most columns to a neighbour", "unit": "pixels",
         "kind": "whole", "range": [1, 16], "default": cluster.gap_columns},
        {"path": "gap-rows", "doc": "Most rows to a neighbour", "unit": "pixels",
         "kind": "whole", "range": [1, 16], "default": cluster.gap_rows},
        {"path": "min-points", "doc": "Instances with fewer pixels are dropped",
         "unit": "pixels", "kind": "whole", "range": [0, 300], "default": cluster.min_pixels},
    ])
}
