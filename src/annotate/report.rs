//! What was done to a recording: for people, as JSON, and in the output's own metadata record.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::clustered::{Clustered, remarks};
use super::profile::Profile;
use super::times::FrameTimes;
use super::tracking::{MotionReport, TrackSummary};
use crate::messages::clouds::CloudFormat;
use divmerge_core::cloud::Reason;
use divmerge_core::pipeline::Stages;
use divmerge_recording::Fetched;

/// What was done.
#[derive(Debug, Clone, Default, Serialize)]
pub struct AnnotationReport {
    /// The input.
    pub input: PathBuf,
    /// The output.
    pub output: PathBuf,
    /// Bytes of the output.
    pub output_bytes: u64,
    /// Bytes of the input.
    pub input_bytes: u64,
    /// Bytes that were read of it; fewer than it has if there is a window and its index says
    /// where that lies.
    pub input_bytes_read: u64,
    /// What came over the network of an input at an address, looks at it beforehand included.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fetched: Option<Fetched>,
    /// SHA-256 of the input, if all of it was read.
    pub input_sha256: Option<String>,
    /// What the output holds, in words.
    pub form: &'static str,
    /// Earliest log time in nanoseconds, if there is one.
    pub from_ns: Option<u64>,
    /// Log time in nanoseconds from which on messages were left out, if there is one.
    pub to_ns: Option<u64>,
    /// Messages copied.
    pub messages: u64,
    /// Messages added.
    pub annotations: u64,
    /// Per cloud topic.
    pub topics: BTreeMap<String, TopicReport>,
    /// Where and how the input is cut off.
    pub truncated: Option<String>,
    /// Everything that was warned of.
    pub warnings: Vec<String>,
    /// What took how long.
    pub profile: Profile,
}

impl AnnotationReport {
    /// Whether every cloud was annotated and the input was whole.
    pub fn is_complete(&self) -> bool {
        self.truncated.is_none() && self.topics.values().all(|topic| topic.unreadable == 0)
    }
}

/// What was done to one topic.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct TopicReport {
    /// Clouds annotated.
    pub frames: u64,
    /// Format of the annotated clouds.
    #[serde(skip)]
    pub format: CloudFormat,
    /// Coordinate frame of the clouds, of the last where it changes.
    pub frame_id: String,
    /// How many of these were annotated before: by a run that was cut off, or in slices.
    pub resumed: u64,
    /// Clouds passed through without annotation because they cannot be read.
    pub unreadable: u64,
    /// Points of the annotated clouds.
    pub points: u64,
    /// Instances found, all frames together.
    pub instances: u64,
    /// Where objects came from, and in how many frames.
    pub semantics: BTreeMap<String, u64>,
    /// How the range image was made, and in how many frames.
    pub projection: BTreeMap<String, u64>,
    /// Where the motion of the sensor came from, where objects are followed over time.
    #[serde(skip_serializing_if = "MotionReport::is_empty")]
    pub ego_motion: MotionReport,
    /// The objects that were followed, by the number of their track; background is none.
    #[serde(skip)]
    pub tracks: Vec<TrackSummary>,
    /// Points per reason; `instance` counts those that have one.
    pub reasons: BTreeMap<&'static str, u64>,
    /// Milliseconds per frame.
    #[serde(flatten)]
    pub times: FrameTimes,
}

/// What the report takes of a cloud.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct FrameReport {
    frame_id: String,
    points: u64,
    instances: u64,
    semantics: String,
    projection: String,
    /// In the order of [`Reason::ALL`].
    reasons: Vec<u64>,
    /// What is odd about it: a word for the kind, and a sentence.
    pub(super) remarks: Vec<(String, String)>,
}

impl FrameReport {
    pub(super) fn new(clustered: &Clustered, frame_id: &str) -> Self {
        let stages = &clustered.stages;
        let remarks = remarks(clustered).into_iter();
        FrameReport {
            frame_id: frame_id.to_owned(),
            points: stages.labels.reason.len() as u64,
            instances: stages.instances.len() as u64,
            semantics: clustered.semantics.clone(),
            projection: describe_image(stages),
            reasons: stages.labels.counts().to_vec(),
            remarks: remarks.map(|(kind, problem)| (kind.to_owned(), problem)).collect(),
        }
    }
}

impl TopicReport {
    /// Takes a cloud, and what it took unless that was done before.
    pub(super) fn take(&mut self, frame: &FrameReport, times: Option<FrameTimes>) {
        self.frames += 1;
        self.frame_id.clone_from(&frame.frame_id);
        self.points += frame.points;
        self.instances += frame.instances;
        *self.semantics.entry(frame.semantics.clone()).or_default() += 1;
        *self.projection.entry(frame.projection.clone()).or_default() += 1;
        for (reason, count) in Reason::ALL.into_iter().zip(&frame.reasons) {
            *self.reasons.entry(reason.describe()).or_default() += count;
        }
        match times {
            Some(times) => self.times.take(times, self.frames - self.resumed),
            None => self.resumed += 1,
        }
    }
}

fn describe_image(stages: &Stages) -> String {
    let image = &stages.image;
    format!("{}, {} x {}", image.projection.describe(), image.rows(), image.columns())
}
