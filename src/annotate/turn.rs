//! A turn of several messages, clustered as one cloud, with the messages that annotate its parts.

use std::time::Instant;

use crate::annotate::clustered::{Clustered, cluster_decoded};
use crate::annotate::config::{AnnotateConfig, Decoded};
use crate::annotate::labels::LabelBytes;
use crate::annotate::times::FrameTimes;
use crate::annotate::types::{MessageTypes, Objects, Placement};
use crate::annotate::writing::Annotated;
use crate::error::{FrameError, Result};
use crate::frames::EncodedCloud;
use crate::frames::assemble::joined_messages;
use crate::messages::annotation::annotated_cloud;
use crate::messages::clouds::CloudMessage;
use divmerge_recording::stopwatch::ms_since;

/// A turn that was clustered, and the messages that annotate its parts. The boxes of all instances
/// stand with the last part.
pub(in crate::annotate) type AnnotatedTurn = (Clustered, Vec<Annotated>);

/// Clusters the parts of a turn as one cloud, and annotates each.
///
/// # Errors
/// Those of [`annotate_message`](crate::annotate::annotate_message), about all parts.
pub(in crate::annotate) fn annotate_turn(
    parts: &[EncodedCloud],
    method: &AnnotateConfig,
    types: &MessageTypes,
) -> Result<AnnotatedTurn> {
    let started = Instant::now();
    let messages: Vec<CloudMessage> =
        parts.iter().map(EncodedCloud::decode).collect::<std::result::Result<_, FrameError>>()?;
    let (last, last_message) = (&parts[parts.len() - 1], &messages[messages.len() - 1]);
    let whole = joined_messages(&messages);
    let parse_ms = ms_since(started);
    let key = last.key(last_message);
    let decoded = method.decode(&whole, &key)?;
    let decoded = Decoded { decode_ms: parse_ms + decoded.decode_ms, ..decoded };
    let clustered = cluster_decoded(&whole, &key, method, decoded)?;

    let started = Instant::now();
    let labels = LabelBytes::new(&clustered);
    let (mut annotated, mut column) = (Vec::with_capacity(parts.len()), 0);
    for message in &messages {
        let written = message.reformatted(types.format(message.format))?;
        let points = places(message, column, whole.width as usize);
        column += message.width as usize;
        let mut made = Annotated {
            frame_id: message.frame_id.clone(),
            stamp_ns: message.stamp_ns(),
            semantics: clustered.semantics.clone(),
            ..Annotated::default()
        };
        let labels = labels.at(&points, &clustered);
        annotated_cloud(&written, &labels.with_tracks(None), &mut made.cloud)?;
        annotated.push(made);
    }
    if let Some(made) = annotated.last_mut() {
        let written = last_message.reformatted(types.format(last_message.format))?;
        let placement = Placement::of(&written, &clustered.cloud);
        types.write_objects(
            &written,
            Objects::of_cloud(&clustered.stages.instances),
            &placement,
            &mut made.objects,
        )?;
        made.times = FrameTimes {
            decode_ms: clustered.decode_ms,
            semantics_ms: clustered.semantics_ms,
            stages: clustered.stages.times,
            encode_ms: ms_since(started),
        };
    }
    Ok((clustered, annotated))
}

/// Where the points of a message lie in the joined cloud, of which its rows begin at a column.
fn places(message: &CloudMessage, column: usize, width: usize) -> Vec<usize> {
    let (height, own) = (message.height as usize, message.width as usize);
    (0..height).flat_map(|row| (0..own).map(move |at| row * width + column + at)).collect()
}
