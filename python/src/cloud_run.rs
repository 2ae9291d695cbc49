//! A cloud with all that its clustering depends on: what is clustered, explained and drawn.

use std::path::PathBuf;
use std::sync::Arc;

use divmerge::diagnose::explain::ClusteredCloud;
use divmerge::frames::EncodedCloud;
use divmerge::messages::clouds::CloudFormat;
use divmerge::parameters::ParameterSet;
use divmerge::pipeline;
use divmerge::semantics::MaskSource;
use divmerge::{GroundParams, PointCloud, Taxonomy};
use pyo3::prelude::*;

use crate::taxonomy::PyTaxonomy;

/// Which points are objects.
#[derive(Clone)]
pub enum Objects {
    /// Those that ground removal leaves.
    NotGround,
    /// All returns.
    All,
    /// Things by the cloud's classes.
    Classes,
    /// The same, where a network found the classes.
    NetworkClasses,
    /// Those that are marked.
    Marked(Vec<bool>),
}

impl Objects {
    /// Where the object mask comes from.
    pub fn mask<'a>(&'a self, taxonomy: &'a Taxonomy, ground: &'a GroundParams) -> MaskSource<'a> {
        match self {
            Objects::NotGround => MaskSource::NotGround(ground),
            Objects::All => MaskSource::All,
            Objects::Classes => MaskSource::Classes(taxonomy),
            Objects::NetworkClasses => MaskSource::NetworkClasses(taxonomy, ground),
            Objects::Marked(marks) => MaskSource::Marked(marks),
        }
    }

    /// The same in words.
    pub fn describe(&self) -> &'static str {
        match self {
            Objects::NotGround => "ground",
            Objects::All => "all",
            Objects::Classes | Objects::NetworkClasses => "classes",
            Objects::Marked(_) => "mask",
        }
    }
}

/// Where a cloud is from.
pub struct Origin {
    /// The recording; empty of a cloud in arrays.
    pub file: PathBuf,
    /// Which message of it, without its bytes.
    pub message: EncodedCloud,
    /// Log time of the recording's first message, nanoseconds.
    pub start_ns: u64,
    /// Where objects come from, in words.
    pub semantics: String,
    /// N: how much light came back, where that is known.
    pub intensity: Option<Vec<f32>>,
}

impl Origin {
    /// That of a cloud in arrays.
    pub fn arrays(objects: &Objects) -> Self {
        Origin {
            file: PathBuf::new(),
            message: EncodedCloud::of_message(CloudFormat::Ros2, Vec::new()),
            start_ns: 0,
            semantics: objects.describe().to_owned(),
            intensity: None,
        }
    }
}

/// A cloud with all that its clustering depends on.
pub struct CloudRun {
    /// The cloud, upright.
    pub cloud: Arc<PointCloud>,
    /// Which points are objects.
    pub objects: Objects,
    /// What its classes mean.
    pub taxonomy: Py<PyTaxonomy>,
    /// Every parameter.
    pub parameters: ParameterSet,
    /// Where it is from.
    pub origin: Arc<Origin>,
}

impl CloudRun {
    /// The same for another owner.
    pub fn clone_ref(&self, py: Python<'_>) -> Self {
        CloudRun {
            cloud: Arc::clone(&self.cloud),
            objects: self.objects.clone(),
            taxonomy: self.taxonomy.clone_ref(py),
            parameters: self.parameters.clone(),
            origin: Arc::clone(&self.origin),
        }
    }

    /// Clusters the cloud and looks at what comes of it, while other threads of Python run.
    pub fn look<T: Send>(
        &self,
        py: Python<'_>,
        look: impl FnOnce(&ClusteredCloud) -> T + Send,
    ) -> T {
        let config = &self.parameters.config();
        let mask = self.objects.mask(&self.taxonomy.get().inner, &self.parameters.ground);
        let cloud = &*self.cloud;
        py.detach(|| {
            let stages = &pipeline::run(cloud, mask, config);
            look(&ClusteredCloud { cloud, mask, config, stages })
        })
    }
}
