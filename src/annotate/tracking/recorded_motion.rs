//! Where a recording says that the sensor is: on `/tf`, on topics of odometry and of poses, and by
//! satellites.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use nalgebra::Isometry3;

use super::driven_way::DrivenWay;
use super::options::EgoMotionSource;
use crate::error::{Conflict, Error, Result};
use crate::frames::Selection;
use crate::frames::topics::type_name;
use crate::frames::walk::Walk;
use crate::messages::fixes::FixMessage;
use crate::messages::poses::{PoseMessage, RecordedPose};
use divmerge_core::cloud::transforms::{Trajectory, Transforms};
use divmerge_recording::{Channel, Overview, Record};

/// How far back poses are kept, nanoseconds.
const KEPT_NS: i64 = 30_000_000_000;

/// After so much of the stamps older poses are forgotten again, nanoseconds.
const FORGET_EVERY_NS: i64 = 1_000_000_000;

/// What the messages read so far say of where the sensor is.
#[derive(Default)]
pub(in crate::annotate) struct RecordedMotion {
    channels: BTreeMap<u16, PoseChannel>,
    transforms: Transforms,
    odometry: BTreeMap<RecordedSource, Trajectory>,
    newest_ns: i64,
    forgotten_ns: i64,
}

struct PoseChannel {
    topic: String,
    messages: MotionMessages,
    is_static: bool,
}

/// What the messages of a channel say.
enum MotionMessages {
    Poses(PoseMessage),
    Fixes(FixMessage, DrivenWay),
}

impl MotionMessages {
    fn named(type_name: &str, encoding: &str) -> Option<Self> {
        let fixes = || FixMessage::named(type_name, encoding);
        let of_fixes = || fixes().map(|fixes| MotionMessages::Fixes(fixes, DrivenWay::default()));
        PoseMessage::named(type_name, encoding).map(MotionMessages::Poses).or_else(of_fixes)
    }

    /// Whether they are about any frames, as those of `/tf` are.
    fn are_of_transforms(&self) -> bool {
        matches!(self, MotionMessages::Poses(poses) if poses.is_of_transforms())
    }
}

/// Who says where the sensor is; in the order in which they are preferred.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::annotate) enum RecordedSource {
    /// Transforms, to a frame that stands still.
    Transforms { world: String },
    /// A topic of odometry or poses: its frame, and the frame whose pose it gives, if it says so.
    Topic { topic: String, parent: String, child: Option<String> },
    /// A topic of places on the earth: the frame of the antenna, x ahead.
    Fixes { topic: String, child: String },
}

impl RecordedSource {
    /// Whether its turns are those of the way driven.
    pub(super) fn heads_where_it_drives(&self) -> bool {
        matches!(self, RecordedSource::Fixes { .. })
    }

    /// The frame whose pose a topic gives, if it says so.
    fn child(&self) -> Option<&String> {
        match self {
            RecordedSource::Transforms { .. } => None,
            RecordedSource::Topic { child, .. } => child.as_ref(),
            RecordedSource::Fixes { child, .. } => Some(child),
        }
    }
}

impl fmt::Display for RecordedSource {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            RecordedSource::Transforms { world } => write!(f, "/tf (in {world})"),
            RecordedSource::Topic { topic, parent, child: Some(child) } => {
                write!(f, "{topic} ({child} in {parent})")
            }
            RecordedSource::Topic { topic, parent, child: None } => {
                write!(f, "{topic} (in {parent})")
            }
            RecordedSource::Fixes { topic, child } => {
                write!(f, "{topic} ({child} on the earth, heading where it drives)")
            }
        }
    }
}

impl RecordedMotion {
    /// The same with what is known beforehand of frames that do not move.
    pub(in crate::annotate) fn with_frames_at_rest(self, transforms: Transforms) -> Self {
        RecordedMotion { transforms, ..self }
    }

    /// Nothing yet, of the channels of a recording that are wanted.
    pub(in crate::annotate) fn of_channels(overview: &Overview, wanted: &EgoMotionSource) -> Self {
        let mut recorded = RecordedMotion::default();
        for channel in overview.channels.values() {
            recorded.add_channel(overview, channel, wanted);
        }
        recorded
    }

    /// All that a recording says.
    ///
    /// # Errors
    /// Those of [`refuse_missing`](Self::refuse_missing), `RecordingReader::open_filtered` and
    /// `next_record`.
    pub(in crate::annotate) fn read(overview: &Overview, wanted: &EgoMotionSource) -> Result<Self> {
        let mut recorded = RecordedMotion::of_channels(overview, wanted);
        recorded.refuse_missing(overview, wanted)?;
        if recorded.is_empty() {
            return Ok(RecordedMotion::default());
        }
        let topics = recorded.channels().map(|(id, topic)| (id, topic.as_str().into())).collect();
        let mut walk = Walk::open(overview, topics, &Selection::default())?;
        while let Some(step) = walk.next()? {
            if let Record::Message { header, data, .. } = &step.record {
                recorded.take(header.channel_id, data);
            }
        }
        Ok(recorded)
    }

    /// Refuses to take the motion of the sensor from where none is recorded.
    ///
    /// # Errors
    /// [`Error::Conflict`] if one source alone is wanted and the recording has none such.
    pub(in crate::annotate) fn refuse_missing(
        &self,
        overview: &Overview,
        wanted: &EgoMotionSource,
    ) -> Result<()> {
        let source_name = match wanted {
            EgoMotionSource::Transforms => "/tf".to_owned(),
            EgoMotionSource::Topic(topic) => topic.clone(),
            _ => return Ok(()),
        };
        if !self.is_empty() {
            return Ok(());
        }
        let others = RecordedMotion::of_channels(overview, &EgoMotionSource::Auto);
        let there: BTreeSet<String> = others.channels().map(|(_, topic)| topic).collect();
        let problem = Conflict::NoMotion { source_name, there: there.into_iter().collect() };
        Err(Error::Conflict { path: overview.path.clone(), problem })
    }

    /// Takes messages of a channel from now on, if they are wanted and say poses.
    pub(in crate::annotate) fn add_channel(
        &mut self,
        overview: &Overview,
        channel: &Channel,
        wanted: &EgoMotionSource,
    ) {
        let name = type_name(overview, channel);
        let found = MotionMessages::named(name, &channel.message_encoding);
        let Some(messages) = found else { return };
        let is_static = channel.topic.ends_with("tf_static");
        let is_wanted = match wanted {
            EgoMotionSource::Auto => true,
            EgoMotionSource::Transforms => messages.are_of_transforms(),
            EgoMotionSource::Topic(topic) => *topic == channel.topic || is_static,
            EgoMotionSource::Estimate | EgoMotionSource::None => false,
        };
        if is_wanted {
            let topic = channel.topic.clone();
            self.channels.insert(channel.id, PoseChannel { topic, messages, is_static });
        }
    }

    /// The channels whose messages are taken, each with its topic.
    pub(in crate::annotate) fn channels(&self) -> impl Iterator<Item = (u16, String)> {
        self.channels.iter().map(|(&id, channel)| (id, channel.topic.clone()))
    }

    /// Whether messages of a channel are taken.
    pub(in crate::annotate) fn takes(&self, channel: u16) -> bool {
        self.channels.contains_key(&channel)
    }

    /// Whether nothing of what is taken moves.
    pub(in crate::annotate) fn is_empty(&self) -> bool {
        self.channels.values().all(|channel| channel.is_static)
    }

    /// Takes a message; one that cannot be read says nothing.
    pub(in crate::annotate) fn take(&mut self, channel: u16, message: &[u8]) {
        let RecordedMotion { channels, transforms, odometry, newest_ns, .. } = self;
        let Some(PoseChannel { topic, messages, is_static }) = channels.get_mut(&channel) else {
            return;
        };
        let messages = match messages {
            MotionMessages::Poses(messages) => *messages,
            MotionMessages::Fixes(messages, way) => {
                let Ok(Some(fix)) = messages.read(message) else { return };
                *newest_ns = (*newest_ns).max(fix.stamp_ns);
                if let Some(pose) = way.push(&fix) {
                    let source =
                        RecordedSource::Fixes { topic: topic.clone(), child: fix.frame_id };
                    odometry.entry(source).or_default().insert(fix.stamp_ns, pose);
                }
                return;
            }
        };
        let is_of_transforms = messages.is_of_transforms();
        let _ = messages.read(message, |RecordedPose { stamp_ns, parent, child, pose }| {
            match (is_of_transforms, child) {
                (true, Some(child)) if *is_static => transforms.insert(parent, child, pose),
                (true, Some(child)) => transforms.insert_at(stamp_ns, (parent, child), pose),
                (true, None) => {}
                (false, child) => {
                    let (topic, parent) = (topic.clone(), parent.to_owned());
                    let child = child.map(str::to_owned);
                    let source = RecordedSource::Topic { topic, parent, child };
                    odometry.entry(source).or_default().insert(stamp_ns, pose);
                }
            }
            if !*is_static {
                *newest_ns = (*newest_ns).max(stamp_ns);
            }
        });
    }

    /// Forgets poses of long ago.
    pub(in crate::annotate) fn forget_what_is_past(&mut self) {
        if self.newest_ns.saturating_sub(self.forgotten_ns) > FORGET_EVERY_NS {
            self.forgotten_ns = self.newest_ns;
            let oldest = self.newest_ns.saturating_sub(KEPT_NS);
            self.transforms.forget_before(oldest);
            self.odometry.values_mut().for_each(|poses| poses.forget_before(oldest));
        }
    }

    /// The pose of a frame at a time, nanoseconds since 1970, as each of them says it.
    pub(in crate::annotate) fn poses(
        &self,
        frame_id: &str,
        stamp_ns: i64,
    ) -> BTreeMap<RecordedSource, Isometry3<f64>> {
        let has_transforms = self.channels.values().any(|of| of.messages.are_of_transforms());
        let of_transforms = match has_transforms {
            true => self.transforms.pose_in_world(frame_id, stamp_ns),
            false => None,
        };
        let of_transforms =
            of_transforms.map(|(world, pose)| (RecordedSource::Transforms { world }, pose));
        let of_topics = self.odometry.iter().filter_map(|(source, poses)| {
            let pose = poses.at(stamp_ns)?;
            // Where nothing says how the sensor stands to the frame whose pose it is, they are one.
            let at_rest = |child: &String| self.transforms.pose_at_rest(frame_id, child);
            let of_sensor = source.child().and_then(at_rest).unwrap_or_default();
            Some((source.clone(), pose * of_sensor))
        });
        of_transforms.into_iter().chain(of_topics).collect()
    }
}
