//! One cloud message: decoded, clustered, and written as the two messages that annotate it.

use std::time::Instant;

use super::clustered::{Clustered, cluster_decoded};
use super::config::{AnnotateConfig, Decoded};
use super::times::FrameTimes;
use super::types::MessageTypes;
use crate::error::Result;
use crate::frames::{CloudKey, EncodedCloud, Remark};
use crate::messages::annotation::{Certainty, PointAnnotation, annotated_cloud};
use crate::messages::clouds::CloudMessage;
use crate::network::Network;
use divmerge_core::cloud::PointCloud;
use divmerge_recording::stopwatch::ms_since;

/// One annotated cloud.
#[derive(Debug, Clone, Default)]
pub struct Annotated {
    /// The message of `T/instances`.
    pub cloud: Vec<u8>,
    /// The message of `T/objects`; empty where the format has none.
    pub objects: Vec<u8>,
    /// Coordinate frame of the cloud.
    pub frame_id: String,
    /// Stamp of the cloud's header, nanoseconds since 1970.
    pub stamp_ns: i64,
    /// Where objects came from, as in `field:label`.
    pub semantics: String,
    /// Milliseconds.
    pub times: FrameTimes,
}

/// Clusters the cloud in a message of a format and writes the messages that annotate it into
/// `annotated`, whose memory is used again.
///
/// # Errors
/// Those of `CloudFormat::decode`, [`CloudMessage::reformatted`], [`MessageTypes::objects`] and
/// `cluster`.
pub fn annotate_message(
    encoded: &EncodedCloud,
    method: &AnnotateConfig,
    types: &MessageTypes,
    annotated: &mut Annotated,
) -> Result<Clustered> {
    let started = Instant::now();
    let wire = encoded.decode()?;
    let parse_ms = ms_since(started);
    let key = encoded.key(&wire);
    let decoded = method.decode(&wire, &key)?;
    let decoded = Decoded { decode_ms: parse_ms + decoded.decode_ms, ..decoded };
    annotate_decoded((&wire, &key), method, types, decoded, annotated)
}

/// Annotates several messages whose clouds go through a network together; each has a result of its
/// own.
///
/// # Errors
/// Those of [`Network::classes_of`], which concern all of them.
pub(super) fn annotate_messages(
    messages: &[EncodedCloud],
    network: &Network,
    method: &AnnotateConfig,
    types: &MessageTypes,
) -> Result<Vec<Result<(Clustered, Annotated)>>> {
    let started = Instant::now();
    let opened = messages.iter().map(|encoded| {
        let wire = encoded.decode()?;
        let (cloud, _, remarks) = method.unclassified(&wire, &encoded.key(&wire))?;
        Ok((wire, cloud, remarks))
    });
    let opened: Vec<Result<(CloudMessage, PointCloud, Vec<Remark>)>> = opened.collect();
    let decode_ms = ms_since(started) / messages.len() as f64;

    let started = Instant::now();
    let readable: Vec<&PointCloud> = opened.iter().flatten().map(|(_, cloud, _)| cloud).collect();
    let mut classes = network.classes_of(&readable, &method.pipeline.projection)?.into_iter();
    let semantics_ms = ms_since(started) / messages.len() as f64;

    let annotate = |(encoded, opened): (&EncodedCloud, Result<(_, PointCloud, _)>)| {
        let (wire, cloud, remarks) = opened?;
        let cloud = cloud.with_classes(classes.next().unwrap_or_default())?;
        let mut annotated = Annotated::default();
        let semantics = method.semantics.describe(None);
        let mask = method.mask(&cloud);
        let odd_field = None;
        let decoded =
            Decoded { mask, cloud, semantics, odd_field, remarks, decode_ms, semantics_ms };
        let clustered =
            annotate_decoded((&wire, &encoded.key(&wire)), method, types, decoded, &mut annotated)?;
        Ok((clustered, annotated))
    };
    Ok(messages.iter().zip(opened).map(annotate).collect())
}

fn annotate_decoded(
    (wire, key): (&CloudMessage, &CloudKey),
    method: &AnnotateConfig,
    types: &MessageTypes,
    decoded: Decoded,
    annotated: &mut Annotated,
) -> Result<Clustered> {
    let started = Instant::now();
    let written = wire.reformatted(types.format(wire.format))?;
    let reformat_ms = ms_since(started);
    let clustered = cluster_decoded(wire, key, method, decoded)?;

    let started = Instant::now();
    let stages = &clustered.stages;
    let reason: Vec<u8> = stages.labels.reason.iter().map(|&reason| reason as u8).collect();
    let ground = stages.mask.ground.as_deref().map(bytes);
    let cloud = &clustered.cloud;
    let certain = cloud.confidence.as_deref().zip(cloud.entropy.as_deref());
    let certain = certain.map(|(confidence, entropy)| (bytes(confidence), bytes(entropy)));
    let annotation = PointAnnotation {
        instance: &stages.labels.instance,
        component: &stages.labels.component,
        semantic: &stages.labels.semantic,
        reason: &reason,
        ground: ground.as_deref(),
        certainty: certain.as_ref().map(|(confidence, entropy)| Certainty { confidence, entropy }),
    };
    annotated_cloud(&written, &annotation, &mut annotated.cloud)?;
    types.write_objects(&written, (&stages.instances, cloud), &mut annotated.objects)?;
    annotated.frame_id.clone_from(&wire.frame_id);
    annotated.stamp_ns = wire.stamp_ns();
    annotated.semantics.clone_from(&clustered.semantics);
    annotated.times = FrameTimes {
        decode_ms: clustered.decode_ms,
        semantics_ms: clustered.semantics_ms,
        stages: stages.times,
        encode_ms: reformat_ms + ms_since(started),
    };
    Ok(clustered)
}

/// Shares of 0 to 1 as 0 to 255.
pub(super) fn bytes(shares: &[f32]) -> Vec<u8> {
    shares.iter().map(|share| (share * 255.0).round() as u8).collect()
}
