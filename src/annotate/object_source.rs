//! What is an object, as people say it: `ground`, `field:label`, `onnx:model.onnx`.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use super::config::{AnnotateConfig, Semantics};
use crate::error::Result;
use crate::error::spelling::did_you_mean;
use crate::frames::{ClassSource, FrameClasses, TOLERANCE_NS};
use crate::network::{Network, NetworkOptions};
use divmerge_core::ParameterError;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_recording::is_stream;

/// Where objects come from, before anything is opened.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum ObjectSource {
    /// [`Semantics::Auto`].
    #[default]
    Auto,
    /// Ground removal.
    Ground,
    /// Every return is an object.
    All,
    /// The field of that name.
    Field(String),
    /// A network: its ONNX file.
    Onnx(PathBuf),
    /// A folder of label files.
    Labels(PathBuf),
    /// A topic beside the clouds.
    Topic(String),
}

/// As [`FromStr`] reads it.
impl fmt::Display for ObjectSource {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ObjectSource::Auto => write!(out, "auto"),
            ObjectSource::Ground => write!(out, "ground"),
            ObjectSource::All => write!(out, "all"),
            ObjectSource::Field(name) => write!(out, "field:{name}"),
            ObjectSource::Onnx(path) => write!(out, "onnx:{}", path.display()),
            ObjectSource::Labels(path) => write!(out, "labels:{}", path.display()),
            ObjectSource::Topic(topic) => write!(out, "topic:{topic}"),
        }
    }
}

/// Reads `auto`, `field:NAME`, `onnx:MODEL.onnx`, `labels:DIR`, `topic:T`, `ground` or `all`.
impl FromStr for ObjectSource {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "auto" => return Ok(ObjectSource::Auto),
            "ground" => return Ok(ObjectSource::Ground),
            "all" => return Ok(ObjectSource::All),
            _ => {}
        }
        match text.split_once(':') {
            Some(("field", name)) if !name.is_empty() => Ok(ObjectSource::Field(name.to_owned())),
            Some(("onnx", path)) if !path.is_empty() => Ok(ObjectSource::Onnx(path.into())),
            Some(("labels", path)) if !path.is_empty() => Ok(ObjectSource::Labels(path.into())),
            Some(("topic", topic)) if !topic.is_empty() => {
                Ok(ObjectSource::Topic(topic.to_owned()))
            }
            _ => {
                let word = text.split(':').next().unwrap_or_default();
                let words = ["auto", "field", "onnx", "labels", "topic", "ground", "all"];
                Err(format!(
                    "use auto, field:NAME, onnx:MODEL.onnx, labels:DIR, topic:T, ground or all{}",
                    did_you_mean(word, &words)
                ))
            }
        }
    }
}

/// Where objects come from, with what is needed to open that.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectOptions {
    /// Where they come from.
    pub source: ObjectSource,
    /// What the ids of classes mean. Default: as the network's own configuration says, else
    /// SemanticKITTI's.
    pub taxonomy: Option<Taxonomy>,
    /// How far the stamps of label files and messages may be from that of their cloud, nanoseconds.
    pub tolerance_ns: u64,
    /// How a network is run; its `model` is that of the source.
    pub network: NetworkOptions,
}

impl Default for ObjectOptions {
    fn default() -> Self {
        ObjectOptions {
            source: ObjectSource::Auto,
            taxonomy: None,
            tolerance_ns: TOLERANCE_NS,
            network: NetworkOptions::default(),
        }
    }
}

impl ObjectOptions {
    /// Preset `best` on these objects, for the clouds of a recording or a folder.
    ///
    /// # Errors
    /// Those of [`Network::open`] and [`FrameClasses::open`];
    /// [`Error::Parameter`](crate::error::Error::Parameter) if classes of a topic are asked for of
    /// a stream.
    pub fn config(&self, recording: &Path) -> Result<AnnotateConfig> {
        let named = self.taxonomy.clone();
        let is_named = named.is_some();
        let mut method = AnnotateConfig {
            taxonomy: named.unwrap_or_default(),
            is_taxonomy_given: is_named,
            ..AnnotateConfig::default()
        };
        method.semantics = match &self.source {
            ObjectSource::Auto => Semantics::Auto,
            ObjectSource::Ground => Semantics::Ground,
            ObjectSource::All => Semantics::All,
            ObjectSource::Field(name) => Semantics::Field(name.clone()),
            ObjectSource::Onnx(model) => {
                let options = NetworkOptions { model: model.clone(), ..self.network.clone() };
                let network = Network::open(options)?;
                if let (false, Some(own)) = (is_named, network.taxonomy()) {
                    method.taxonomy = own.clone();
                }
                Semantics::Network(Arc::new(network))
            }
            ObjectSource::Labels(folder) => {
                self.given(ClassSource::Files(folder.clone()), recording, &method.taxonomy)?
            }
            ObjectSource::Topic(topic) => {
                self.given(ClassSource::Topic(topic.clone()), recording, &method.taxonomy)?
            }
        };
        Ok(method)
    }

    fn given(
        &self,
        source: ClassSource,
        recording: &Path,
        taxonomy: &Taxonomy,
    ) -> Result<Semantics> {
        if matches!(source, ClassSource::Topic(_)) && is_stream(recording) {
            let problem = "classes of a topic are read from a file, not from a stream";
            let problem = format!("{}: {problem}", self.source);
            return Err(ParameterError::new("semantics", problem).into());
        }
        let classes = FrameClasses::open(&source, recording, taxonomy, self.tolerance_ns)?;
        Ok(Semantics::Given(Arc::new(classes)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources() {
        for text in
            ["auto", "ground", "all", "field:label", "onnx:a b.onnx", "labels:dir", "topic:/p"]
        {
            let source = text.parse::<ObjectSource>();
            assert_eq!(source.map(|source| source.to_string()), Ok(text.to_owned()));
        }
        for text in ["", "field:", "onnx", "topic:", "networks:x"] {
            assert!(text.parse::<ObjectSource>().is_err(), "{text}");
        }
    }
}
