//! Boxes of a topic, and which of them belong to which cloud.
//!
//! To a cloud belong the boxes with its stamp, else those with the nearest stamp if that is no
//! farther away than half the median period of the cloud's topic, so that boxes of one cloud are
//! not taken for those of the next. Of two stamps that are equally near, the earlier.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::key::CloudKey;
use super::selection::Selection;
use super::topics::{CloudTopic, TopicWords, channels_beside, type_name};
use super::walk::Walk;
use crate::error::{Error, Result, frame};
use crate::messages::boxes::{
    BoxMessage, DETECTION_ARRAY, MARKER_ARRAY, detection_boxes, marker_boxes,
};
use divmerge_core::cloud::Detection;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::geometry::statistics::median_by;
use divmerge_recording::{Channel, Overview, Record};

/// The boxes of one cloud.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameDetections<'a> {
    /// The boxes, in the cloud's frame.
    pub detections: Cow<'a, [Detection]>,
    /// Why the source says nothing about the cloud, where that is so; a source may also say that
    /// there is nothing.
    pub missing: Option<String>,
}

/// The boxes of a topic.
#[derive(Debug, Clone, PartialEq)]
pub struct TopicBoxes {
    topic: String,
    /// By ascending stamp; no two of one stamp and frame.
    messages: Vec<BoxMessage>,
    /// Median time between the stamps of successive clouds by topic, nanoseconds. Not of topics
    /// with one cloud.
    cloud_period_ns: BTreeMap<String, i64>,
}

impl TopicBoxes {
    /// Reads all boxes of a topic: a cloud's boxes may lie before or behind it. Memory grows with
    /// the number of boxes, 72 bytes each.
    ///
    /// # Errors
    /// [`Error::Boxes`] if there is no such topic, it carries something else, or a message cannot
    /// be read; those of [`RecordingReader`](divmerge_recording::RecordingReader).
    pub fn read(recording: &Path, topic: &str, taxonomy: &Taxonomy) -> Result<Self> {
        let overview = Overview::read(recording)?;
        let layouts = layouts(&overview, topic)?;
        let mut messages = Vec::new();
        let mut stamps: BTreeMap<Arc<str>, Vec<i64>> = BTreeMap::new();
        let clouds: BTreeMap<u16, CloudTopic> = overview
            .channels
            .values()
            .filter_map(|channel| Some((channel.id, CloudTopic::of(&overview, channel)?)))
            .collect();
        let read = layouts.keys().chain(clouds.keys());
        let topics = read.map(|&id| (id, overview.channels[&id].topic.as_str().into())).collect();
        let mut walk = Walk::open(&overview, topics, &Selection::default())?;
        while let Some(step) = walk.next()? {
            let Record::Message { header, data, .. } = step.record else { continue };
            if let Some(&layout) = layouts.get(&header.channel_id) {
                let unreadable = |error| {
                    let at = header.log_time as f64 * 1e-9;
                    problem(topic, format!("the message logged at {at:.6} s: {error}"))
                };
                messages.extend(layout.read(&data, taxonomy).map_err(unreadable)?);
            } else if let Some(CloudTopic { topic, format }) = clouds.get(&header.channel_id)
                && let Ok(stamp) = format.stamp_ns(&data)
            {
                stamps.entry(Arc::clone(topic)).or_default().push(stamp);
            }
        }
        let periods = stamps.into_iter();
        let cloud_period_ns = periods
            .filter_map(|(topic, stamps)| Some((topic.to_string(), median_period(stamps)?)))
            .collect();
        Ok(TopicBoxes { topic: topic.to_owned(), messages: merged(messages), cloud_period_ns })
    }

    /// The topic.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// The boxes of a cloud.
    ///
    /// # Errors
    /// [`Error::Boxes`] if they are of another coordinate frame.
    pub fn of(&self, cloud: &CloudKey) -> Result<FrameDetections<'_>> {
        let reach = self.cloud_period_ns.get(cloud.topic).copied().unwrap_or(0) / 2;
        let away = |message: &&BoxMessage| message.stamp_ns.abs_diff(cloud.stamp_ns);
        let behind = self.messages.partition_point(|message| message.stamp_ns < cloud.stamp_ns);
        let before = behind.checked_sub(1).map(|last| &self.messages[last]);
        let nearest = before.into_iter().chain(self.messages.get(behind)).min_by_key(away);
        let Some(message) = nearest.filter(|message| away(message) <= reach.unsigned_abs()) else {
            let missing = Some(self.missing(cloud, reach, nearest.as_ref().map(away)));
            return Ok(FrameDetections { missing, ..FrameDetections::default() });
        };
        let frame = |name: &str| name.trim_start_matches('/').to_owned();
        if !message.detections.is_empty() && frame(&message.frame_id) != frame(cloud.frame_id) {
            return Err(problem(
                &self.topic,
                format!(
                    "they are in frame `{}`, the clouds of {} in `{}`; boxes are not transformed",
                    message.frame_id, cloud.topic, cloud.frame_id
                ),
            ));
        }
        Ok(FrameDetections { detections: Cow::Borrowed(&message.detections), missing: None })
    }

    fn missing(&self, cloud: &CloudKey, reach: i64, nearest: Option<u64>) -> String {
        let seconds = |nanoseconds: u64| nanoseconds as f64 * 1e-9;
        let nearest = match nearest {
            None => "it has none at all".to_owned(),
            Some(away) => format!("the nearest are {:.6} s away", seconds(away)),
        };
        format!(
            "no boxes on {} within {:.6} s (half a cloud period) of cloud {}: {nearest}",
            self.topic,
            seconds(reach.unsigned_abs()),
            cloud.number
        )
    }
}

/// How the messages of a channel are laid out.
#[derive(Debug, Clone, Copy)]
enum Layout {
    Markers { has_textures: bool },
    Detections,
}

impl Layout {
    /// `None` of messages that are no boxes.
    fn of(overview: &Overview, channel: &Channel) -> Option<Self> {
        if channel.message_encoding != "cdr" {
            return None;
        }
        match type_name(overview, channel) {
            MARKER_ARRAY => {
                let schema = overview.schema_of(channel.id)?;
                let text = String::from_utf8_lossy(&schema.data);
                // Without a definition: as it is today.
                let has_textures = text.is_empty() || text.contains("texture_resource");
                Some(Layout::Markers { has_textures })
            }
            DETECTION_ARRAY => Some(Layout::Detections),
            _ => None,
        }
    }

    fn read(self, message: &[u8], taxonomy: &Taxonomy) -> frame::Result<Option<BoxMessage>> {
        match self {
            Layout::Markers { has_textures } => marker_boxes(message, has_textures, taxonomy),
            Layout::Detections => detection_boxes(message, taxonomy).map(Some),
        }
    }
}

/// The channels of the topic; all must carry boxes.
fn layouts(overview: &Overview, topic: &str) -> Result<BTreeMap<u16, Layout>> {
    let words = TopicWords {
        readable: "boxes are read from MarkerArray and Detection3DArray in `cdr`",
        on: "boxes are on",
        none: "none of its topics carries boxes",
    };
    channels_beside(overview, topic, Layout::of, &words).map_err(|words| problem(topic, words))
}

/// Messages by stamp; those of one stamp and frame become one.
fn merged(mut messages: Vec<BoxMessage>) -> Vec<BoxMessage> {
    messages.sort_by(|a, b| (a.stamp_ns, &a.frame_id).cmp(&(b.stamp_ns, &b.frame_id)));
    messages.dedup_by(|later, kept| {
        let is_same = later.stamp_ns == kept.stamp_ns && later.frame_id == kept.frame_id;
        if is_same {
            kept.detections.append(&mut later.detections);
        }
        is_same
    });
    messages
}

/// The median difference of successive stamps that differ.
fn median_period(mut stamps: Vec<i64>) -> Option<i64> {
    stamps.sort_unstable();
    stamps.dedup();
    let mut periods: Vec<i64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
    median_by(&mut periods, i64::cmp)
}

fn problem(topic: &str, problem: String) -> Error {
    Error::Boxes { source_name: format!("topic {topic}"), problem }
}

#[cfg(test)]
mod tests {
    use super::*;
    use divmerge_core::cloud::UprightBox;

    const MS: i64 = 1_000_000;

    fn message(stamp_ms: i64, frame_id: &str, count: usize) -> BoxMessage {
        let bounds = UprightBox::new([stamp_ms as f64, 0.0, 0.0], [1.0; 3], 0.0);
        let detections = vec![Detection { bounds, class: None, score: 1.0 }; count];
        BoxMessage { stamp_ns: stamp_ms * MS, frame_id: frame_id.to_owned(), detections }
    }

    fn boxes(messages: Vec<BoxMessage>) -> TopicBoxes {
        let cloud_period_ns = BTreeMap::from([("/points".to_owned(), 100 * MS)]);
        TopicBoxes { topic: "/boxes".to_owned(), messages: merged(messages), cloud_period_ns }
    }

    fn at(stamp_ms: i64) -> CloudKey<'static> {
        CloudKey { topic: "/points", number: 7, stamp_ns: stamp_ms * MS, frame_id: "lidar" }
    }

    #[test]
    fn same_stamp_else_nearest_within_half_a_period() {
        let boxes = boxes(vec![message(260, "lidar", 1), message(100, "/lidar", 1)]);
        let found = |stamp_ms| {
            let found = boxes.of(&at(stamp_ms)).unwrap();
            (found.detections.first().map(|found| found.bounds.centre[0]), found.missing)
        };
        assert_eq!(found(100), (Some(100.0), None));
        assert_eq!(found(150), (Some(100.0), None));
        assert_eq!(found(210), (Some(260.0), None));
        assert_eq!(found(310), (Some(260.0), None));
        let (none, missing) = found(205);
        let missing = missing.unwrap();
        assert!(none.is_none() && missing.contains("0.055000 s away"), "{missing}");
        assert!(missing.contains("/boxes") && missing.contains("cloud 7"), "{missing}");
        let single =
            |ms| boxes.of(&CloudKey { topic: "/single", number: 0, ..at(ms) }).unwrap().missing;
        assert!(single(100).is_none() && single(101).is_some());
    }

    #[test]
    fn another_frame_is_an_error_that_names_both() {
        let boxes = boxes(vec![message(100, "base_link", 1), message(200, "", 0)]);
        let error = boxes.of(&at(100)).unwrap_err().to_string();
        assert!(error.contains("`base_link`") && error.contains("`lidar`"), "{error}");
        // An array of nothing says that there is nothing, in any frame.
        assert_eq!(boxes.of(&at(200)).unwrap(), FrameDetections::default());
    }

    #[test]
    fn arrays_of_one_stamp_are_one() {
        let boxes = boxes(vec![message(100, "lidar", 1), message(100, "lidar", 2)]);
        assert_eq!(boxes.of(&at(100)).unwrap().detections.len(), 3);
    }

    #[test]
    fn median_of_the_periods() {
        assert_eq!(median_period(vec![5, 300, 100, 200, 200]), Some(100));
        assert_eq!(median_period(vec![7]), None);
    }
}
