//! What the bytes of an output depend on besides those of the clouds.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::config::{AnnotateConfig, Semantics};
use super::form::Form;
use super::metadata::method_metadata;
use super::options::AnnotateOptions;
use super::recorded_run::{CONFIG_KEY, recorded_run};
use super::tracking::TrackOptions;
use super::types::MessageTypes;
use divmerge_recording::{Compression, Overview};

/// The parameters of a run. A journal and a slice begin with them, and are of use only to a run
/// with the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct RunParameters {
    /// Name of the input.
    input: String,
    #[serde(rename = "length of the input")]
    input_bytes: u64,
    /// Version and parameters, as in the output's metadata.
    pub(super) method: BTreeMap<String, String>,
    /// Parameters and options as TOML, as in the output's metadata. All of it stands elsewhere,
    /// too.
    config: String,
    semantics: String,
    /// Where the classes come from that others found.
    classes: Option<String>,
    /// The topic that those are on.
    #[serde(rename = "topic of classes")]
    pub(super) class_topic: Option<String>,
    #[serde(rename = "topic")]
    pub(super) topics: Vec<String>,
    #[serde(rename = "from")]
    pub(super) from_ns: Option<u64>,
    #[serde(rename = "to")]
    pub(super) to_ns: Option<u64>,
    pub(super) form: Form,
    pub(super) types: MessageTypes,
    pub(super) tracks: TrackOptions,
    /// Whether objects are followed over time.
    pub(super) follows: bool,
    pub(super) compression: Compression,
    #[serde(rename = "check of chunks")]
    is_checked: bool,
}

impl RunParameters {
    pub(super) fn new(overview: &Overview, options: &AnnotateOptions) -> Self {
        let method = &options.config;
        let AnnotateConfig { semantics, .. } = method;
        // A slice may be read from a copy of the recording.
        let input = options.slice.as_ref().map_or(&overview.path, |slice| &slice.input);
        let name = input.file_name().unwrap_or_default().to_string_lossy();
        let usual = || overview.usual_compression().unwrap_or_default();
        let mut parameters = method_metadata(method);
        let follows = options.tracks.applies_to(method) && options.assemble.is_none();
        if follows {
            parameters.insert("tracks".to_owned(), serde_json::json!(options.tracks).to_string());
        }
        parameters.extend(options.assemble.map(|how| ("assemble".to_owned(), how.to_string())));
        RunParameters {
            input: name.into_owned(),
            input_bytes: overview.file_size,
            method: parameters,
            config: recorded_run(options),
            semantics: match semantics {
                Semantics::Auto if method.is_taxonomy_given => "auto by ids".to_owned(),
                Semantics::Auto => "auto".to_owned(),
                others => others.describe(None),
            },
            classes: match semantics {
                Semantics::Given(given) => Some(given.source()),
                _ => None,
            },
            class_topic: method.class_topic().map(str::to_owned),
            topics: options.topics.clone(),
            from_ns: options.from_ns,
            to_ns: options.to_ns,
            form: options.form,
            types: options.types,
            tracks: options.tracks.clone(),
            follows,
            compression: options.compression.unwrap_or_else(usual),
            is_checked: !options.unchecked,
        }
    }

    /// The same as options; of the method nothing is known but how it is described.
    pub(super) fn options(&self) -> AnnotateOptions {
        AnnotateOptions {
            types: self.types,
            tracks: self.tracks.clone(),
            topics: self.topics.clone(),
            from_ns: self.from_ns,
            to_ns: self.to_ns,
            form: self.form,
            compression: Some(self.compression),
            unchecked: !self.is_checked,
            ..AnnotateOptions::default()
        }
    }

    /// The part of the output's metadata that is known beforehand.
    pub(super) fn metadata(&self) -> BTreeMap<String, String> {
        let mut metadata = self.method.clone();
        metadata.insert(CONFIG_KEY.to_owned(), self.config.clone());
        metadata
    }

    /// In what it differs from another, by name.
    pub(super) fn differences(&self, other: &RunParameters) -> Vec<String> {
        let fields = |parameters: &RunParameters| match serde_json::json!(parameters) {
            serde_json::Value::Object(fields) => fields,
            _ => unreachable!("a structure is an object"),
        };
        let others = fields(other);
        fields(self)
            .into_iter()
            .filter(|(name, value)| name != CONFIG_KEY && others.get(name) != Some(value))
            .map(|(name, _)| name)
            .collect()
    }
}
