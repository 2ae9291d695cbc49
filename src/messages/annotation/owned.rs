//! The labels of an annotated cloud, owned: to be read back, and written once more.

use super::{CLASH_PREFIX, Certainty, GROUND, LABELS, PointAnnotation, TRACK};
use crate::messages::clouds::{CloudMessage, PointField};

/// Labels of every point of a cloud but its track, owned.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct OwnedAnnotation {
    pub instance: Vec<u32>,
    pub component: Vec<u32>,
    pub semantic: Vec<u16>,
    pub reason: Vec<u8>,
    pub ground: Option<Vec<u8>>,
    /// Confidence and entropy.
    pub certainty: Option<(Vec<u8>, Vec<u8>)>,
}

impl OwnedAnnotation {
    /// The same as it is written, with the tracks of the points if they have some.
    pub fn with_tracks<'a>(&'a self, track: Option<&'a [u32]>) -> PointAnnotation<'a> {
        let certainty = self.certainty.as_ref();
        PointAnnotation {
            instance: &self.instance,
            track,
            component: &self.component,
            semantic: &self.semantic,
            reason: &self.reason,
            ground: self.ground.as_deref(),
            certainty: certainty.map(|(confidence, entropy)| Certainty { confidence, entropy }),
        }
    }
}

/// The field of an annotated cloud that identifies objects: the track where they are followed over
/// time, else the instance.
pub fn object_field(cloud: &CloudMessage) -> &'static str {
    let has_tracks = cloud.fields.iter().any(|field| field.name == TRACK);
    if has_tracks { TRACK } else { LABELS[0].0 }
}

/// The labels that [`annotated_cloud`] appended; `None` of a cloud that is not annotated.
pub(crate) fn annotation_of(cloud: &CloudMessage) -> Option<OwnedAnnotation> {
    // The appended fields are the last, from `instance` on, some with a prefix.
    let name = |field: &PointField| field.name.replace(CLASH_PREFIX, "");
    let first = cloud.fields.iter().rposition(|field| name(field) == LABELS[0].0)?;
    let appended = &cloud.fields[first..];
    let column = |wanted: &str| {
        let field = appended.iter().find(|field| name(field) == wanted)?;
        cloud.column_u32(&field.name).ok()
    };
    let bytes = |wanted: &str| {
        let column = column(wanted)?;
        Some(column.into_iter().map(|value| value as u8).collect::<Vec<u8>>())
    };
    Some(OwnedAnnotation {
        instance: column("instance")?,
        component: column("component")?,
        semantic: column("semantic")?.into_iter().map(|value| value as u16).collect(),
        reason: bytes("reason")?,
        ground: bytes(GROUND),
        certainty: bytes("confidence").zip(bytes("entropy")),
    })
}
