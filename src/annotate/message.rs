//! One cloud message: decoded, clustered, and written as the two messages that annotate it.

use std::time::Instant;

use super::clustered::{Clustered, cluster_decoded};
use super::config::{AnnotateConfig, Decoded};
use super::labels::LabelBytes;
use super::times::FrameTimes;
use super::tracking::{Untracked, observe_cloud};
use super::types::{MessageTypes, Objects, Placement};
use super::writing::{Annotated, Writing};
use crate::error::Result;
use crate::frames::{CloudKey, EncodedCloud, Remark};
use crate::messages::annotation::annotated_cloud;
use crate::messages::clouds::CloudMessage;
use crate::network::Network;
use divmerge_core::cloud::PointCloud;
use divmerge_recording::stopwatch::ms_since;

/// A clustered cloud: annotated, or where its objects are followed what is needed to do so later.
pub(super) enum Written {
    Annotated(Annotated),
    Untracked(Box<Untracked>),
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
    let wire_and_decoded = decode(encoded, method)?;
    let writing = Writing { config: method, types, tracks: None, keeps: false };
    let (clustered, written) =
        write(encoded, wire_and_decoded, writing, std::mem::take(annotated))?;
    if let Written::Annotated(made) = written {
        *annotated = made;
    }
    Ok(clustered)
}

/// Clusters the cloud in a message, and writes what annotates it unless its objects are followed.
///
/// # Errors
/// Those of [`annotate_message`].
pub(super) fn cluster_message(
    encoded: &EncodedCloud,
    writing: Writing,
) -> Result<(Clustered, Written)> {
    write(encoded, decode(encoded, writing.config)?, writing, Annotated::default())
}

/// The message of a cloud, and the cloud in it.
fn decode<'a>(
    encoded: &'a EncodedCloud,
    config: &'a AnnotateConfig,
) -> Result<(CloudMessage<'a>, Decoded<'a>)> {
    let started = Instant::now();
    let wire = encoded.decode()?;
    let parse_ms = ms_since(started);
    let decoded = config.decode(&wire, &encoded.key(&wire))?;
    let decoded = Decoded { decode_ms: parse_ms + decoded.decode_ms, ..decoded };
    Ok((wire, decoded))
}

/// Clusters several messages whose clouds go through a network together, and of some of which the
/// objects are followed; each has a result of its own.
///
/// # Errors
/// Those of [`Network::classes_of`], which concern all of them.
pub(super) fn cluster_messages(
    messages: &[(EncodedCloud, bool)],
    network: &Network,
    writing: Writing,
) -> Result<Vec<Result<(Clustered, Written)>>> {
    let method = writing.config;
    let started = Instant::now();
    let opened = messages.iter().map(|(encoded, _)| {
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

    let annotate = |((encoded, is_followed), opened): (&(EncodedCloud, bool), Result<_>)| {
        let tracks = writing.tracks.filter(|_| *is_followed);
        let writing = Writing { tracks, ..writing };
        let (wire, cloud, remarks): (CloudMessage, PointCloud, _) = opened?;
        let cloud = cloud.with_classes(classes.next().unwrap_or_default())?;
        let semantics = method.semantics.describe(None);
        let mask = method.mask(&cloud);
        let odd_field = None;
        let decoded =
            Decoded { mask, cloud, semantics, odd_field, remarks, decode_ms, semantics_ms };
        write(encoded, (wire, decoded), writing, Annotated::default())
    };
    Ok(messages.iter().zip(opened).map(annotate).collect())
}

fn write(
    encoded: &EncodedCloud,
    (wire, decoded): (CloudMessage, Decoded),
    writing: Writing,
    mut annotated: Annotated,
) -> Result<(Clustered, Written)> {
    let Writing { config, types, tracks, keeps } = writing;
    let key: CloudKey = encoded.key(&wire);
    let started = Instant::now();
    let written = wire.reformatted(types.format(wire.format))?;
    let reformat_ms = ms_since(started);
    let clustered = cluster_decoded(&wire, &key, config, decoded)?;

    let started = Instant::now();
    let labels = LabelBytes::new(&clustered);
    let placement = Placement::of(&written, &clustered.cloud);
    annotated.frame_id.clone_from(&wire.frame_id);
    annotated.stamp_ns = wire.stamp_ns();
    annotated.semantics.clone_from(&clustered.semantics);
    if let Some(options) = tracks {
        let observation = observe_cloud(encoded, (&wire, &placement), &clustered, options);
        annotated.times = times(&clustered, reformat_ms + ms_since(started));
        let instances = clustered.stages.instances.clone();
        let (labels, kept) = (labels.owned(&clustered), None);
        let mut untracked =
            Untracked { labels, instances, placement, observation, kept, annotated };
        if keeps {
            untracked.keep();
        }
        return Ok((clustered, Written::Untracked(Box::new(untracked))));
    }
    annotated_cloud(&written, &labels.annotation(&clustered), &mut annotated.cloud)?;
    let objects = Objects::of_cloud(&clustered.stages.instances);
    types.write_objects(&written, objects, &placement, &mut annotated.objects)?;
    annotated.times = times(&clustered, reformat_ms + ms_since(started));
    Ok((clustered, Written::Annotated(annotated)))
}

fn times(clustered: &Clustered, encode_ms: f64) -> FrameTimes {
    FrameTimes {
        decode_ms: clustered.decode_ms,
        semantics_ms: clustered.semantics_ms,
        stages: clustered.stages.times,
        encode_ms,
    }
}
