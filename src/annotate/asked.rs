//! What the bytes of an output depend on besides those of the clouds.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::message::{Method, Semantics};
use super::report::parameters;
use super::types::MessageTypes;
use super::{Form, Options};
use crate::io::{Compression, Overview};

/// What was asked for: a journal and a slice begin with it, and are of use only where the same is asked for again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Asked {
    /// Name of the input.
    input: String,
    #[serde(rename = "length of the input")]
    input_bytes: u64,
    /// Version and parameters, as in the output's metadata.
    pub(super) method: BTreeMap<String, String>,
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
    pub(super) compression: Compression,
    #[serde(rename = "check of chunks")]
    is_checked: bool,
}

impl Asked {
    pub(super) fn of(overview: &Overview, options: &Options) -> Self {
        let Options { method, .. } = options;
        let Method { semantics, .. } = method;
        // A slice may be read from a copy of the recording.
        let input = options.slice.as_ref().map_or(&overview.path, |slice| &slice.input);
        let name = input.file_name().unwrap_or_default().to_string_lossy();
        let usual = || overview.usual_compression().unwrap_or_default();
        Asked {
            input: name.into_owned(),
            input_bytes: overview.file_size,
            method: parameters(method),
            semantics: match semantics {
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
            compression: options.compression.unwrap_or_else(usual),
            is_checked: !options.unchecked,
        }
    }

    /// The same as options; of the method nothing is known but how it is described.
    pub(super) fn options(&self) -> Options {
        Options {
            types: self.types,
            topics: self.topics.clone(),
            from_ns: self.from_ns,
            to_ns: self.to_ns,
            form: self.form,
            compression: Some(self.compression),
            unchecked: !self.is_checked,
            ..Options::default()
        }
    }

    /// In what it differs from another, by name.
    pub(super) fn differences(&self, other: &Asked) -> Vec<String> {
        let fields = |asked: &Asked| match serde_json::json!(asked) {
            serde_json::Value::Object(fields) => fields,
            _ => unreachable!("a structure is an object"),
        };
        let others = fields(other);
        fields(self)
            .into_iter()
            .filter(|(name, value)| others.get(name) != Some(value))
            .map(|(name, _)| name)
            .collect()
    }
}
