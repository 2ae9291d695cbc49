//! What was done to a recording: for people, as JSON, and in the output's own metadata record.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use super::message::{Annotated, Clustered, Method};
use super::profile::Profile;
use crate::instances::Reason;
use crate::pipeline::{StageTimes, Stages};
use crate::sensor_frame::SensorFrame;
use crate::taxonomy::Taxonomy;

/// Name of the metadata record that says how a recording was annotated.
pub const METADATA_NAME: &str = "divmerge";

/// What was done.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    /// The input.
    pub input: PathBuf,
    /// The output.
    pub output: PathBuf,
    /// Bytes of the output.
    pub output_bytes: u64,
    /// SHA-256 of the input.
    pub input_sha256: String,
    /// Messages copied.
    pub messages: u64,
    /// Per cloud topic.
    pub topics: BTreeMap<String, TopicReport>,
    /// Where and how the input is cut off.
    pub truncated: Option<String>,
    /// Everything that was warned of.
    pub warnings: Vec<String>,
    /// What took how long.
    pub profile: Profile,
}

impl Report {
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
    /// Points per reason; `instance` counts those that have one.
    pub reasons: BTreeMap<&'static str, u64>,
    /// Milliseconds per frame.
    #[serde(flatten)]
    pub times: FrameTimes,
}

/// Mean milliseconds per frame, message bytes to message bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct FrameTimes {
    /// Message to cloud.
    pub decode_ms: f64,
    /// Cloud to labels.
    #[serde(flatten)]
    pub stages: StageTimes,
    /// Labels to messages.
    pub encode_ms: f64,
}

impl FrameTimes {
    /// All of it.
    pub fn total_ms(&self) -> f64 {
        self.decode_ms + self.stages.total_ms() + self.encode_ms
    }

    fn each(&mut self) -> [&mut f64; 7] {
        let stages = &mut self.stages;
        [
            &mut self.decode_ms,
            &mut stages.projection_ms,
            &mut stages.mask_ms,
            &mut stages.divide_ms,
            &mut stages.merge_ms,
            &mut stages.labels_ms,
            &mut self.encode_ms,
        ]
    }

    /// Takes one more frame into the mean over `frames` frames.
    pub(super) fn take(&mut self, mut frame: FrameTimes, frames: u64) {
        for (mean, value) in self.each().into_iter().zip(frame.each()) {
            *mean += (*value - *mean) / frames as f64;
        }
    }
}

impl TopicReport {
    pub(super) fn take(&mut self, annotated: &Annotated, stages: &Stages) {
        self.frames += 1;
        self.points += stages.labels.reason.len() as u64;
        self.instances += stages.instances.len() as u64;
        *self.semantics.entry(annotated.semantics.clone()).or_default() += 1;
        *self.projection.entry(describe_image(stages)).or_default() += 1;
        for (reason, count) in Reason::ALL.into_iter().zip(stages.labels.counts()) {
            *self.reasons.entry(reason.describe()).or_default() += count;
        }
        self.times.take(annotated.times, self.frames);
    }
}

fn describe_image(stages: &Stages) -> String {
    let image = &stages.image;
    format!("{}, {} x {}", image.projection.describe(), image.rows(), image.columns())
}

/// What is odd about a cloud that could be read: a word for the kind, and a sentence.
pub fn remarks(clustered: &Clustered, taxonomy: &Taxonomy) -> Vec<(&'static str, String)> {
    let stages = &clustered.stages;
    let counts = stages.labels.counts();
    let points = stages.labels.reason.len() as u64;
    let returns = points - counts[Reason::NoReturn as usize];
    let shadowed = stages.image.shadowed_count() as u64;
    let mut remarks = Vec::new();
    if points == 0 {
        remarks.push(("without points", "a cloud without points".to_owned()));
    } else if returns == 0 {
        let problem = format!("none of {points} points is a return: all NaN or at the origin");
        remarks.push(("without returns", problem));
    } else if shadowed * 5 > returns * 4 {
        let problem = format!(
            "{shadowed} of {returns} returns lie behind a nearer one in the same pixel of the {} x {} \
             range image ({})",
            stages.image.rows(),
            stages.image.columns(),
            stages.image.projection.describe()
        );
        remarks.push(("with most returns shadowed", problem));
    }
    if stages.mask.unknown_ids > 0 {
        let problem = format!(
            "{} points have a class that the taxonomy `{}` does not know",
            stages.mask.unknown_ids, taxonomy.name
        );
        remarks.push(("with unknown classes", problem));
    }
    if stages.mask.ground_is_overhead {
        let problem = "the largest level surface lies above the sensor. If that is the ground, z points down in the \
                       cloud's frame: `--sensor-frame frd` turns a frame whose y is to the right and z down, \
                       `--sensor-frame 180,0,0` a sensor that hangs upside down";
        remarks.push(("with the ground overhead", problem.to_owned()));
    }
    remarks.extend(clustered.missing_boxes.clone().map(|problem| ("without boxes", problem)));
    remarks
}

/// The metadata record: version, parameters, the input's hash, counts per reason.
pub(super) fn metadata(report: &Report, method: &Method) -> BTreeMap<String, String> {
    let json = |value: serde_json::Value| value.to_string();
    let mut metadata = BTreeMap::from([
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("input_sha256".to_owned(), report.input_sha256.clone()),
        ("method".to_owned(), method.config.method_name().to_owned()),
        ("preset".to_owned(), method.config.preset.to_owned()),
        ("taxonomy".to_owned(), method.taxonomy.name.clone()),
        ("parameters".to_owned(), json(serde_json::json!(method.config))),
        ("ground".to_owned(), json(serde_json::json!(method.ground))),
    ]);
    if method.sensor_frame != SensorFrame::Auto {
        metadata.insert("sensor_frame".to_owned(), method.sensor_frame.to_string());
    }
    if let Some(boxes) = method.boxes.describe() {
        metadata.insert("boxes".to_owned(), boxes);
    }
    if let Some(cut) = &report.truncated {
        metadata.insert("truncated".to_owned(), cut.clone());
    }
    for (topic, report) in &report.topics {
        let value = serde_json::json!({
            "frames": report.frames,
            "unreadable": report.unreadable,
            "points": report.points,
            "instances": report.instances,
            "semantics": report.semantics,
            "projection": report.projection,
            "reasons": report.reasons,
        });
        metadata.insert(format!("topic {topic}"), json(value));
    }
    metadata
}
