//! Classes on a topic beside the clouds, and which of them are of which cloud.
//!
//! A cloud gets the message in its coordinate frame whose stamp is nearest, if that is within the
//! tolerance; of two that are equally near the earlier. Messages are read when a cloud needs them,
//! and only some around the last cloud are kept, so the stamps on the topic have to ascend. A cloud
//! far before the last one makes the reading begin again.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use super::key::CloudKey;
use super::selection::Selection;
use super::topics::{TopicWords, channels_beside, schema_name};
use super::walk::Walk;
use crate::error::{Error, FrameError, MissingClasses, NearestClasses, Result};
use crate::messages::classes::{ClassFormat, ClassMessage};
use crate::text::seconds;
use divmerge_core::cloud::PointClasses;
use divmerge_recording::{Channel, Overview, Record};

/// Default of the largest difference between the stamps of classes and of their cloud, nanoseconds.
/// Both are of the same points, so only clocks and rounding differ, and 10 ms are less than half
/// the period of any sensor.
pub const TOLERANCE_NS: u64 = 10_000_000;

/// Messages that are kept behind the last cloud: several threads cluster clouds, so not quite in
/// their order.
const KEPT: usize = 32;

/// Messages that may lie within the tolerance of one stamp.
const MOST: usize = 256;

/// The classes of a topic.
#[derive(Debug)]
pub struct ClassTopic {
    overview: Overview,
    topic: String,
    tolerance_ns: u64,
    formats: BTreeMap<u16, ClassFormat>,
    window: Mutex<Window>,
}

impl PartialEq for ClassTopic {
    fn eq(&self, other: &Self) -> bool {
        (&self.overview.path, &self.topic, self.tolerance_ns)
            == (&other.overview.path, &other.topic, other.tolerance_ns)
    }
}

/// What has been read of the topic.
#[derive(Default)]
struct Window {
    walk: Option<Walk>,
    /// In the topic's order.
    found: VecDeque<ClassMessage>,
    /// The latest stamp that was dropped again.
    dropped_ns: Option<i64>,
    is_over: bool,
}

impl std::fmt::Debug for Window {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("Window").field("found", &self.found.len()).finish_non_exhaustive()
    }
}

impl ClassTopic {
    /// Looks for the topic; nothing of it is read yet.
    ///
    /// # Errors
    /// [`Error::Classes`] if there is no such topic or it carries something else; those of
    /// [`Overview::read`].
    pub fn open(recording: &Path, topic: &str, tolerance_ns: u64) -> Result<Self> {
        let overview = Overview::read(recording)?;
        let formats = formats(&overview, topic)?;
        Ok(ClassTopic {
            overview,
            topic: topic.to_owned(),
            tolerance_ns,
            formats,
            window: Mutex::default(),
        })
    }

    /// The topic.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// How far the stamp of a message may be from that of its cloud, nanoseconds.
    pub(super) fn tolerance_ns(&self) -> u64 {
        self.tolerance_ns
    }

    pub(super) fn source(&self) -> String {
        format!("{}, within {} ns", self.topic, self.tolerance_ns)
    }

    /// The classes of a cloud of so many rows and columns.
    ///
    /// # Errors
    /// Those of [`FrameClasses::of`](super::FrameClasses::of), and of
    /// [`RecordingReader`](divmerge_recording::RecordingReader).
    pub fn of(&self, cloud: &CloudKey, shape: [usize; 2]) -> Result<PointClasses> {
        let mut window = self.window.lock().unwrap_or_else(PoisonError::into_inner);
        let latest = cloud.stamp_ns.saturating_add_unsigned(self.tolerance_ns);
        let earliest = cloud.stamp_ns.saturating_sub_unsigned(self.tolerance_ns);
        if window.dropped_ns.is_some_and(|dropped| dropped >= earliest) {
            *window = Window::default();
        }
        self.read_on(&mut window, earliest, latest)?;
        let away = |message: &&ClassMessage| message.stamp_ns.abs_diff(cloud.stamp_ns);
        let is_of_frame = |message: &&ClassMessage| {
            message.frame_id.trim_start_matches('/') == cloud.frame_id.trim_start_matches('/')
        };
        let nearest = window.found.iter().filter(is_of_frame).min_by_key(away);
        match nearest.filter(|message| away(message) <= self.tolerance_ns) {
            Some(message) => self.fitting(message, cloud, shape),
            None => {
                let problem = self.missing(cloud, &window, nearest);
                Err(FrameError::NoClasses { number: cloud.number, problem }.into())
            }
        }
    }

    /// Reads until a message lies behind a stamp, and drops what lies far before another.
    fn read_on(&self, window: &mut Window, earliest: i64, latest: i64) -> Result<()> {
        while !window.is_over && window.found.back().is_none_or(|last| last.stamp_ns <= latest) {
            match self.next(window)? {
                Some(_) if window.found.len() == MOST => {
                    let problem = format!(
                        "{MOST} messages and more within the tolerance of one stamp ({}): stamps \
                         do not tell which is of which cloud",
                        seconds(latest)
                    );
                    return Err(self.problem(problem));
                }
                Some(message) => window.found.push_back(message),
                None => window.is_over = true,
            }
            while window.found.len() > KEPT
                && window.found.front().is_some_and(|first| first.stamp_ns < earliest)
            {
                let dropped = window.found.pop_front().map(|first| first.stamp_ns);
                window.dropped_ns = window.dropped_ns.max(dropped);
            }
        }
        Ok(())
    }

    fn next(&self, window: &mut Window) -> Result<Option<ClassMessage>> {
        let walk = match &mut window.walk {
            Some(walk) => walk,
            none => none.insert(self.walk()?),
        };
        while let Some(step) = walk.next()? {
            if let Record::Message { header, data, .. } = step.record
                && let Some(format) = self.formats.get(&header.channel_id)
            {
                return format.read(&data).map(Some).map_err(|error| {
                    let at = seconds(header.log_time as i64);
                    self.problem(format!("the message logged at {at} s: {error}"))
                });
            }
        }
        Ok(None)
    }

    fn walk(&self) -> Result<Walk> {
        let topic: Arc<str> = self.topic.as_str().into();
        let topics = self.formats.keys().map(|&id| (id, Arc::clone(&topic))).collect();
        Walk::open(&self.overview, topics, &Selection::default())
    }

    /// The classes of a message if they are as many as the cloud has points.
    fn fitting(
        &self,
        message: &ClassMessage,
        cloud: &CloudKey,
        shape: [usize; 2],
    ) -> Result<PointClasses> {
        let points = shape[0] * shape[1];
        let is_alike = message.shape == shape || message.shape[0] == 1 || shape[0] == 1;
        if is_alike && message.classes.class.len() == points {
            return Ok(message.classes.clone());
        }
        let size = |[rows, columns]: [usize; 2]| match rows {
            1 => format!("{columns} points"),
            _ => format!("{rows} x {columns}"),
        };
        Err(self.problem(format!(
            "the message of stamp {} has classes of {}, and cloud {} on {} is {}",
            seconds(message.stamp_ns),
            size(message.shape),
            cloud.number,
            cloud.topic,
            size(shape)
        )))
    }

    fn missing(
        &self,
        cloud: &CloudKey,
        window: &Window,
        nearest: Option<&ClassMessage>,
    ) -> MissingClasses {
        MissingClasses::Message {
            topic: self.topic.clone(),
            stamp_ns: cloud.stamp_ns,
            tolerance_ns: self.tolerance_ns as i64,
            nearest: match (nearest, window.found.back()) {
                (Some(message), _) => NearestClasses::TooFar {
                    away_ns: message.stamp_ns.abs_diff(cloud.stamp_ns) as i64,
                },
                (None, Some(other)) => NearestClasses::OtherFrame {
                    messages: other.frame_id.clone(),
                    cloud: cloud.frame_id.to_owned(),
                },
                (None, None) => NearestClasses::Nothing,
            },
        }
    }

    fn problem(&self, problem: String) -> Error {
        of_topic(&self.topic, problem)
    }
}

fn of_topic(topic: &str, problem: String) -> Error {
    Error::Classes { source_name: format!("topic {topic}"), problem }
}

/// The channels of the topic; all must carry classes.
fn formats(overview: &Overview, topic: &str) -> Result<BTreeMap<u16, ClassFormat>> {
    let words = TopicWords {
        readable: "classes are read from clouds and from images (sensor_msgs/Image)",
        on: "clouds and images are on",
        none: "none of its topics could carry classes",
    };
    let format = |overview: &Overview, channel: &Channel| {
        ClassFormat::named(schema_name(overview, channel), &channel.message_encoding)
    };
    channels_beside(overview, topic, format, &words).map_err(|words| of_topic(topic, words))
}
