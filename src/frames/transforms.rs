//! The transforms of a recording: `tf2_msgs/msg/TFMessage`, or `foxglove.FrameTransform` in
//! protocol buffers, on `/tf_static` and `/tf`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use super::encoded::EncodedCloud;
use super::selection::Selection;
use super::topics::{CloudTopic, message_count, type_name};
use super::walk::Walk;
use crate::error::Result;
use crate::messages::poses::{PoseMessage, RecordedPose};
use divmerge_core::ParameterError;
use divmerge_core::cloud::sensor_frame::SensorFrame;
use divmerge_core::cloud::transforms::{Pair, Transforms};
use divmerge_recording::{Channel, Overview, Record, is_remote, is_stream};

/// How far into a recording it is looked for which transforms there are, bytes: static ones are
/// published when a drive begins, and a recorder that joins later gets them first.
const FAR_ENOUGH: u64 = 64 << 20;

/// The transforms that a sensor frame needs of a recording. Of a remote object `/tf` is read only
/// for [`SensorFrame::Recorded`].
///
/// # Errors
/// For [`SensorFrame::Recorded`]: [`Error::Parameter`](crate::error::Error::Parameter) if the
/// recording is a stream, and those of [`transforms`]. For the others a file that cannot be read
/// has no transforms; whoever reads its clouds reports the error.
pub fn recorded_transforms(frame: &SensorFrame, recording: &Path) -> Result<Transforms> {
    match (frame, is_stream(recording)) {
        // The transforms of a stream are known only at its end.
        (SensorFrame::Recorded, true) => {
            let problem = "the transforms of a stream cannot be had; axes or angles can be given";
            Err(ParameterError::new("sensor_frame", problem).into())
        }
        (_, true) => Ok(Transforms::default()),
        (SensorFrame::Recorded, false) => transforms(recording),
        // What moves is asked of a remote object only if it is wanted: the clouds that say whether
        // it is needed would be fetched for that alone.
        (_, false) if is_remote(recording) => {
            Ok(read_transforms(recording, false).unwrap_or_default())
        }
        (_, false) => Ok(transforms(recording).unwrap_or_default()),
    }
}

/// The transforms of a recording: those of `/tf_static` among its first 64 MiB, and of `/tf` those
/// that lead from the frame of a topic's first cloud to a sensor, if `/tf_static` alone does not.
/// Only then the whole recording is read. Messages that cannot be read are passed over.
///
/// # Errors
/// Those of [`Overview::read`] and [`RecordingReader`](divmerge_recording::RecordingReader).
pub fn transforms(recording: &Path) -> Result<Transforms> {
    read_transforms(recording, true)
}

/// How the frames of a recording stand that do not move; of a file that cannot be read nothing,
/// and whoever reads its clouds reports the error.
pub(crate) fn transforms_at_rest(recording: &Path) -> Transforms {
    read_transforms(recording, false).unwrap_or_default()
}

/// The [`transforms`] of a recording, those of `/tf` only if they are wanted.
fn read_transforms(recording: &Path, with_moving: bool) -> Result<Transforms> {
    let overview = Overview::read(recording)?;
    let channels = TransformChannels::of(&overview, with_moving);
    let mut beginning = Beginning::default();
    beginning.read(&overview, &channels)?;
    let mut transforms = beginning.transforms;
    let frames = beginning.cloud_frames.iter();
    let moving: BTreeSet<Pair> =
        frames.flat_map(|frame| transforms.moving_pairs_to_sensors(frame)).collect();
    transforms.forget_moving();
    if !moving.is_empty() {
        read_moving(&overview, &channels, &moving, &mut transforms)?;
    }
    Ok(transforms)
}

/// The channels of a recording that carry transforms.
struct TransformChannels {
    channels: BTreeMap<u16, TransformChannel>,
}

#[derive(Clone, Copy)]
struct TransformChannel {
    is_static: bool,
    messages: PoseMessage,
}

impl TransformChannels {
    fn of(overview: &Overview, with_moving: bool) -> Self {
        let of = |channel: &Channel| {
            let is_static = match channel.topic.trim_start_matches('/') {
                "tf_static" => true,
                "tf" => false,
                _ => return None,
            };
            let is_wanted = is_static || with_moving;
            let messages =
                PoseMessage::named(type_name(overview, channel), &channel.message_encoding)?;
            let is_read = is_wanted && messages.is_of_transforms();
            is_read.then_some((channel.id, TransformChannel { is_static, messages }))
        };
        TransformChannels { channels: overview.channels.values().filter_map(of).collect() }
    }

    /// Messages on those that are static.
    fn static_count(&self, overview: &Overview) -> u64 {
        let channels = self.channels.iter().filter(|(_, channel)| channel.is_static);
        channels.map(|(&id, _)| message_count(overview, id)).sum()
    }

    /// Their topics and those of clouds, by channel.
    fn with(
        &self,
        overview: &Overview,
        clouds: &BTreeMap<u16, CloudTopic>,
    ) -> BTreeMap<u16, Arc<str>> {
        let topic = |&id: &u16| (id, overview.channels[&id].topic.as_str().into());
        self.channels.keys().chain(clouds.keys()).map(topic).collect()
    }

    fn has_moving(&self) -> bool {
        self.channels.values().any(|channel| !channel.is_static)
    }
}

/// What the beginning of a recording says of frames.
#[derive(Default)]
struct Beginning {
    /// Static transforms, and the first one of each pair of frames that moves.
    transforms: Transforms,
    moving: BTreeSet<Pair>,
    /// Frames of the first clouds of all topics, where something moves.
    cloud_frames: BTreeSet<String>,
}

impl Beginning {
    /// Reads until all static transforms have come and, where something moves, the first cloud of
    /// each topic; on to `FAR_ENOUGH` where these do not lead from a cloud to a sensor.
    fn read(&mut self, overview: &Overview, channels: &TransformChannels) -> Result<()> {
        let mut left = channels.static_count(overview);
        let mut clouds = match channels.has_moving() {
            true => clouds_with_messages(overview),
            false => BTreeMap::new(),
        };
        // Opening alone reads ahead.
        if left == 0 && clouds.is_empty() {
            return Ok(());
        }
        let mut walk =
            Walk::open(overview, channels.with(overview, &clouds), &Selection::default())?;
        let mut lacks_sensor = false;
        while (left > 0 || !clouds.is_empty() || lacks_sensor) && walk.progress().0 < FAR_ENOUGH {
            let Ok(Some(step)) = walk.next() else { break };
            let Record::Message { header, .. } = &step.record else { continue };
            let id = header.channel_id;
            match channels.channels.get(&id) {
                Some(channel) => {
                    left -= u64::from(channel.is_static);
                    self.take(&step.record, *channel);
                    if !channel.is_static {
                        continue;
                    }
                }
                None => {
                    let cloud = EncodedCloud::of_step(step, &clouds);
                    clouds.remove(&id);
                    let frame = cloud.and_then(|cloud| Some(cloud.decode().ok()?.frame_id));
                    self.cloud_frames.extend(frame);
                }
            }
            lacks_sensor =
                self.cloud_frames.iter().any(|frame| self.transforms.lacks_sensor_at_rest(frame));
        }
        Ok(())
    }

    /// Takes a message of transforms.
    fn take(&mut self, record: &Record, channel: TransformChannel) {
        let Record::Message { data, .. } = record else { return };
        let Beginning { transforms, moving, .. } = self;
        // One that is cut off still says what came before.
        let _ = channel.messages.read(data, |RecordedPose { stamp_ns, parent, child, pose }| {
            let child = child.unwrap_or_default();
            if channel.is_static {
                transforms.insert(parent, child, pose);
            } else if moving.insert(Transforms::pair((parent, child))) {
                transforms.insert_at(stamp_ns, (parent, child), pose);
            }
        });
    }
}

/// The channels of clouds that have messages.
fn clouds_with_messages(overview: &Overview) -> BTreeMap<u16, CloudTopic> {
    let channels = overview.channels.values();
    let channels = channels.filter(|channel| message_count(overview, channel.id) > 0);
    channels.filter_map(|of| Some((of.id, CloudTopic::of(overview, of)?))).collect()
}

/// Reads how some pairs of frames stand to each other in all of a recording.
fn read_moving(
    overview: &Overview,
    channels: &TransformChannels,
    pairs: &BTreeSet<Pair>,
    transforms: &mut Transforms,
) -> Result<()> {
    let topics = channels.with(overview, &BTreeMap::new());
    let mut walk = Walk::open(overview, topics, &Selection::default())?;
    while let Ok(Some(step)) = walk.next() {
        let Record::Message { header, data, .. } = &step.record else { continue };
        let Some(channel) = channels.channels.get(&header.channel_id) else { continue };
        if !channel.is_static {
            let _ = channel.messages.read(data, |at| {
                let pair = (at.parent, at.child.unwrap_or_default());
                if pairs.contains(&Transforms::pair(pair)) {
                    transforms.insert_at(at.stamp_ns, pair, at.pose);
                }
            });
        }
    }
    Ok(())
}
