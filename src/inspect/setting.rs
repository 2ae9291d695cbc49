//! What a page changes of the parameters of a run.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::annotate::AnnotateConfig;
use crate::comparison::methods;
use crate::diagnose::explain::in_force::{OVER_TIME, is_part_of};
use crate::error::Result;
use crate::frames::FrameBoxes;
use divmerge_core::ParameterError;
use divmerge_core::parameters::{Parameter, ParameterSet, registry};
use divmerge_core::pipeline::Preset;

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
    /// A configuration with these changes.
    ///
    /// # Errors
    /// [`Error::Parameter`](crate::Error::Parameter) if there is no such preset or method,
    /// [`Error::Setting`](crate::Error::Setting) if a parameter cannot be set.
    pub(super) fn config(&self, started: &AnnotateConfig) -> Result<AnnotateConfig> {
        if *self == Setting::default() {
            return Ok(started.clone());
        }
        let mut parameters = started.parameters();
        if let Some(name) = &self.preset {
            let preset = name.parse::<Preset>();
            let preset = preset.map_err(|problem| ParameterError::new("preset", problem))?;
            parameters = of_preset(&parameters, preset);
        }
        if let Some(name) = &self.method {
            parameters.other_method = match name.as_str() {
                OWN_METHOD => None,
                name => Some(methods::named(name, &started.taxonomy).ok_or_else(|| {
                    ParameterError::new("method", format!("there is no method `{name}`"))
                })?),
            };
        }
        parameters.set_all(self.set.iter().map(|(path, value)| (path.as_str(), value)))?;
        let config = started.clone().with_parameters(&parameters);
        if config.pipeline.method_name() == "boxes" && config.boxes == FrameBoxes::Nothing {
            let problem = "the method `boxes` needs boxes: start the inspector with --boxes";
            return Err(ParameterError::new("method", problem).into());
        }
        Ok(config)
    }

    /// The changes in words, to follow a heading; empty if there are none.
    pub(super) fn in_words(&self) -> String {
        let set = self.set.iter().map(|(path, value)| format!("{path} {}", plain(value)));
        match set.collect::<Vec<_>>().join(", ") {
            words if words.is_empty() => words,
            words => format!("  ·  {words}"),
        }
    }

    /// The options that were given with these changes, as words of a command line.
    pub(super) fn words(&self, given: &[String]) -> Vec<String> {
        let mut changed: Vec<[String; 2]> = Vec::new();
        changed.extend(self.preset.iter().map(|name| ["--preset".to_owned(), name.clone()]));
        changed.extend(self.method.iter().map(|name| ["--method".to_owned(), name.clone()]));
        let mut words = Vec::new();
        let mut given = given.iter().peekable();
        while let Some(word) = given.next() {
            let option = word.split_once('=').map_or(word.as_str(), |(option, _)| option);
            let value = given.next_if(|_| !word.contains('='));
            if !changed.iter().any(|[name, _]| name == option) {
                words.push(word.clone());
                words.extend(value.cloned());
            }
        }
        let set = self.set.iter();
        changed.extend(
            set.map(|(path, value)| ["--set".to_owned(), format!("{path}={}", plain(value))]),
        );
        words.extend(changed.into_iter().flatten());
        words
    }
}

/// A preset with what is not as usual in the parameters of another, where the preset has that part.
fn of_preset(started: &ParameterSet, preset: Preset) -> ParameterSet {
    let usual = ParameterSet::of_preset(started.preset.parse().unwrap_or_default());
    let mut parameters = ParameterSet {
        other_method: started.other_method.clone(),
        ..ParameterSet::of_preset(preset)
    };
    for Parameter { path, .. } in registry() {
        let [own, before] = [started, &usual].map(|set| set.get(path).ok().flatten());
        if let Some(own) = own.filter(|own| Some(own) != before.as_ref()) {
            // One of a part that this preset does not have has no effect in it.
            let _ = parameters.set(path, &own);
        }
    }
    parameters
}

/// A value as on the command line.
fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// The names of all methods, ours first.
pub(super) fn method_names() -> Vec<&'static str> {
    [OWN_METHOD].into_iter().chain(methods::NAMES).collect()
}

/// Whether a parameter changes what is found in a single frame.
fn is_of_frame(parameter: &Parameter) -> bool {
    !is_part_of(&parameter.path, &OVER_TIME)
}

/// The parameters of a frame: path, meaning, unit, source, kind and limits.
pub(super) fn parameters() -> Vec<&'static Parameter> {
    registry().iter().filter(|parameter| is_of_frame(parameter)).collect()
}

/// For each part of the parameters over time its name and how many it has: none of them changes
/// what is found in a single frame.
pub(super) fn parameters_over_time() -> Vec<(&'static str, usize)> {
    let is_of = |part: &str| {
        registry().iter().filter(move |parameter| is_part_of(&parameter.path, &[part])).count()
    };
    let counts = OVER_TIME.map(|part| (part, is_of(part)));
    counts.into_iter().filter(|(_, count)| *count > 0).collect()
}

/// The parameters of another method.
pub(super) fn method_parameters(config: &AnnotateConfig) -> Vec<Parameter> {
    let mut all = config.parameters().parameters();
    all.retain(|parameter| parameter.path.starts_with("method."));
    all
}

/// The values of the parameters of a frame, by path; null of a part that is off.
pub(super) fn values(config: &AnnotateConfig) -> Map<String, Value> {
    let set = config.parameters();
    let all = set.parameters().into_iter().filter(is_of_frame);
    all.map(|Parameter { path, .. }| {
        let value = set.get(&path).ok().flatten();
        (path, json!(value))
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn setting(set: &[(&str, Value)]) -> Setting {
        let set = set.iter().map(|(path, value)| ((*path).to_owned(), value.clone())).collect();
        Setting { set, ..Setting::default() }
    }

    #[test]
    fn parameters_are_set_by_path_and_wrong_ones_are_named() {
        let started = AnnotateConfig::default();
        let changed = setting(&[
            ("cluster.voxel", json!(0.3)),
            ("cluster.condition.angle", json!("8 deg")),
            ("cluster.birds_eye", json!(true)),
            ("cluster.birds_eye.region", json!("hull")),
        ]);
        let config = changed.config(&started).unwrap();
        assert_eq!(config.pipeline.cluster.voxel, 0.3);
        assert_eq!(config.pipeline.cluster.condition.angle, 8_f64.to_radians());
        assert!(config.pipeline.cluster.birds_eye.is_some());
        let wrong = setting(&[("cluster.voxle", json!(1))]).config(&started).unwrap_err();
        assert!(wrong.to_string().contains("cluster.voxel"), "{wrong}");
        for method in ["magic", "boxes"] {
            let other = Setting { method: Some(method.into()), ..Setting::default() };
            assert!(other.config(&started).is_err(), "{method}");
        }
    }

    #[test]
    fn another_preset_keeps_what_was_said_beside_the_first() {
        let started = setting(&[("cluster.voxel", json!(0.3)), ("projection.columns", json!(900))]);
        let started = started.config(&AnnotateConfig::default()).unwrap();
        let paper = Setting { preset: Some("paper".into()), ..Setting::default() };
        let config = paper.config(&started).unwrap().pipeline;
        assert_eq!((config.preset, config.cluster.voxel), ("paper", 0.3));
        assert_eq!(config.projection.columns, Some(900));
        assert!(config.cluster.fragments.is_none());
    }

    #[test]
    fn words_repeat_what_was_given_and_what_was_changed() {
        let given = ["--preset", "paper", "--voxel", "0.4", "--semantics=ground", "--set", "a.b=1"];
        let given = given.map(String::from);
        let changed = Setting { preset: Some("best".into()), ..setting(&[("a.c", json!(2.5))]) };
        let words = changed.words(&given).join(" ");
        let expected = "--voxel 0.4 --semantics=ground --set a.b=1 --preset best --set a.c=2.5";
        assert_eq!(words, expected);
        assert_eq!(Setting::default().words(&given), given);
    }

    #[test]
    fn every_parameter_of_a_frame_has_a_value_or_is_off() {
        let config = AnnotateConfig::default();
        let values = values(&config);
        assert_eq!(values.len(), parameters().len());
        assert_eq!(values["cluster.voxel"], json!(0.5));
        assert!(values["cluster.birds_eye.margin"].is_null());
        // What is not shown is counted.
        let over_time: usize = parameters_over_time().iter().map(|(_, count)| count).sum();
        assert!(over_time > 0);
        assert_eq!(parameters().len() + over_time, registry().len());
    }
}
