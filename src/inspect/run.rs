//! A cloud of the recording, clustered.

use std::sync::Arc;

use super::cloud::InspectedCloud;
use super::setting::Setting;
use crate::annotate::AnnotateConfig;
use crate::diagnose::explain::ClusteredCloud;
use crate::view::{FrameScene, Theme, describe_run};
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::pipeline::{self, Stages};

/// A cloud, clustered by a setting.
#[derive(Debug)]
pub(super) struct Run {
    /// The cloud.
    pub cloud: Arc<InspectedCloud>,
    /// What was changed of the parameters.
    pub setting: Setting,
    /// All parameters.
    pub config: AnnotateConfig,
    /// Every intermediate.
    pub stages: Stages,
}

impl Run {
    /// Clusters a cloud.
    pub fn new(cloud: Arc<InspectedCloud>, setting: Setting, config: AnnotateConfig) -> Self {
        let mask = cloud.mask(&config);
        let stages = pipeline::run_with(&cloud.cloud, mask, &cloud.detections, &config.pipeline);
        Run { cloud, setting, config, stages }
    }

    /// The run for those who explain it.
    pub fn clustered(&self) -> ClusteredCloud<'_> {
        ClusteredCloud {
            cloud: &self.cloud.cloud,
            mask: self.cloud.mask(&self.config),
            config: &self.config.pipeline,
            stages: &self.stages,
        }
    }

    /// The run for those who draw it, its instances in these colours. The recording starts at
    /// `start_ns`.
    pub fn scene(&self, start_ns: u64, colour_numbers: Vec<u32>) -> FrameScene<'_> {
        let InspectedCloud { message, semantics, intensity, cloud, .. } = &*self.cloud;
        let classes = self.cloud.mask(&self.config).taxonomy().map_or(&[][..], Taxonomy::classes);
        let seconds = message.log_time_ns().saturating_sub(start_ns) as f64 * 1e-9;
        FrameScene {
            cloud,
            stages: &self.stages,
            classes,
            intensity: intensity.as_deref(),
            merge_ratio: self.config.pipeline.cluster.merge_ratio,
            colour_numbers,
            heading: format!("{}  ·  {seconds:.3} s", message.frames()),
            remark: format!(
                "{}  ·  {}{}",
                message.topic,
                describe_run(&self.stages, semantics, &self.config.pipeline),
                self.setting.in_words(),
            ),
            theme: Theme::default(),
        }
    }
}
