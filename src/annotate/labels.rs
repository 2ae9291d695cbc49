//! The labels of the points of a clustered cloud, as they are written.

use super::clustered::Clustered;
use crate::messages::annotation::{Certainty, OwnedAnnotation, PointAnnotation};

/// The labels of a clustered cloud that are written in another form than it has them.
pub(super) struct LabelBytes {
    reason: Vec<u8>,
    ground: Option<Vec<u8>>,
    /// Confidence and entropy.
    certainty: Option<(Vec<u8>, Vec<u8>)>,
}

impl LabelBytes {
    /// Those of all points.
    pub(super) fn new(clustered: &Clustered) -> Self {
        let Clustered { cloud, stages, .. } = clustered;
        let certain = cloud.confidence.as_deref().zip(cloud.entropy.as_deref());
        LabelBytes {
            reason: stages.labels.reason.iter().map(|&reason| reason as u8).collect(),
            ground: stages.mask.ground.as_deref().map(bytes),
            certainty: certain.map(|(confidence, entropy)| (bytes(confidence), bytes(entropy))),
        }
    }

    /// All labels of the same cloud.
    pub(super) fn annotation<'a>(&'a self, clustered: &'a Clustered) -> PointAnnotation<'a> {
        let labels = &clustered.stages.labels;
        let certainty = self.certainty.as_ref();
        PointAnnotation {
            instance: &labels.instance,
            track: None,
            component: &labels.component,
            semantic: &labels.semantic,
            reason: &self.reason,
            ground: self.ground.as_deref(),
            certainty: certainty.map(|(confidence, entropy)| Certainty { confidence, entropy }),
        }
    }

    /// All labels of the same cloud, owned.
    pub(super) fn owned(self, clustered: &Clustered) -> OwnedAnnotation {
        let labels = &clustered.stages.labels;
        OwnedAnnotation {
            instance: labels.instance.clone(),
            component: labels.component.clone(),
            semantic: labels.semantic.clone(),
            reason: self.reason,
            ground: self.ground,
            certainty: self.certainty,
        }
    }
}

/// Shares of 0 to 1 as 0 to 255.
fn bytes(shares: &[f32]) -> Vec<u8> {
    shares.iter().map(|share| (share * 255.0).round() as u8).collect()
}
