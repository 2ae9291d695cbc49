//! The labels of the points of a clustered cloud, as they are written.

use super::clustered::Clustered;
use crate::messages::annotation::OwnedAnnotation;

/// Those of all points.
pub(super) fn all_labels(clustered: &Clustered) -> OwnedAnnotation {
    let (labels, cloud) = (&clustered.stages.labels, &clustered.cloud);
    let certain = cloud.confidence.as_deref().zip(cloud.entropy.as_deref());
    OwnedAnnotation {
        instance: labels.instance.clone(),
        component: labels.component.clone(),
        semantic: labels.semantic.clone(),
        reason: labels.reason.iter().map(|&reason| reason as u8).collect(),
        ground: clustered.stages.mask.ground.as_deref().map(bytes),
        certainty: certain.map(|(confidence, entropy)| (bytes(confidence), bytes(entropy))),
    }
}

/// Those of some points.
pub(super) fn labels_at(points: &[usize], clustered: &Clustered) -> OwnedAnnotation {
    fn pick<T: Copy>(column: &[T], points: &[usize]) -> Vec<T> {
        points.iter().map(|&point| column[point]).collect()
    }
    let (labels, cloud) = (&clustered.stages.labels, &clustered.cloud);
    let shares = |column: &[f32]| bytes(&pick(column, points));
    let certain = cloud.confidence.as_deref().zip(cloud.entropy.as_deref());
    OwnedAnnotation {
        instance: pick(&labels.instance, points),
        component: pick(&labels.component, points),
        semantic: pick(&labels.semantic, points),
        reason: points.iter().map(|&point| labels.reason[point] as u8).collect(),
        ground: clustered.stages.mask.ground.as_deref().map(shares),
        certainty: certain.map(|(confidence, entropy)| (shares(confidence), shares(entropy))),
    }
}

/// Shares of 0 to 1 as 0 to 255.
fn bytes(shares: &[f32]) -> Vec<u8> {
    shares.iter().map(|share| (share * 255.0).round() as u8).collect()
}
