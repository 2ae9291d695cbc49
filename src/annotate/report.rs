//! What was done to a recording: for people, as JSON, and in the output's own metadata record.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::message::{Clustered, Method, Semantics};
use super::profile::Profile;
use crate::instances::Reason;
use crate::io::{CloudFormat, Fetched};
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
    /// Bytes of the input.
    pub input_bytes: u64,
    /// Bytes that were read of it; fewer than it has if a window was asked for and its index says where that lies.
    pub input_bytes_read: u64,
    /// What came over the network of an input at an address, looks at it beforehand included.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fetched: Option<Fetched>,
    /// SHA-256 of the input, if all of it was read.
    pub input_sha256: Option<String>,
    /// What the output holds, in words.
    pub form: &'static str,
    /// Earliest log time in nanoseconds, if that was asked for.
    pub from_ns: Option<u64>,
    /// Log time in nanoseconds from which on messages were left out, if that was asked for.
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
    /// Classes that do not stand in the cloud itself: a network, files, another topic.
    pub semantics_ms: f64,
    /// Cloud to labels.
    #[serde(flatten)]
    pub stages: StageTimes,
    /// Labels to messages.
    pub encode_ms: f64,
}

impl FrameTimes {
    /// All of it.
    pub fn total_ms(&self) -> f64 {
        self.decode_ms + self.semantics_ms + self.stages.total_ms() + self.encode_ms
    }

    fn each(&mut self) -> [&mut f64; 8] {
        let stages = &mut self.stages;
        [
            &mut self.decode_ms,
            &mut self.semantics_ms,
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
    pub(super) fn new(clustered: &Clustered, frame_id: &str, taxonomy: &Taxonomy) -> Self {
        let stages = &clustered.stages;
        let remarks = remarks(clustered, taxonomy).into_iter();
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
    if let Some(name) = &clustered.repeated_field {
        let problem = format!("several fields are named `{name}`: the first of them is read");
        remarks.push(("with a field name that comes again", problem));
    }
    if clustered.lacks_remission {
        let problem = "no field `intensity`, `remission` or `reflectivity`: the network is given the mean of its training";
        remarks.push(("without remission", problem.to_owned()));
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

/// What stands for the hash of an input that was not read whole.
fn input_read(report: &Report) -> String {
    let (read, all) = (report.input_bytes_read, report.input_bytes);
    format!("{read} of {all} bytes, found by the index of the input; no hash of all of it")
}

/// The part of the metadata record that is known beforehand: version and parameters.
pub(super) fn parameters(method: &Method) -> BTreeMap<String, String> {
    let json = |value: serde_json::Value| value.to_string();
    let mut parameters = BTreeMap::from([
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("method".to_owned(), method.config.method_name().to_owned()),
        ("preset".to_owned(), method.config.preset.to_owned()),
        ("taxonomy".to_owned(), method.taxonomy.name.clone()),
        ("parameters".to_owned(), json(serde_json::json!(method.config))),
        ("ground".to_owned(), json(serde_json::json!(method.ground))),
    ]);
    if method.sensor_frame != SensorFrame::Auto {
        parameters.insert("sensor_frame".to_owned(), method.sensor_frame.to_string());
    }
    if let Semantics::Network(network) = &method.semantics {
        parameters.insert("network".to_owned(), network.describe());
    }
    parameters.extend(method.boxes.describe().map(|boxes| ("boxes".to_owned(), boxes)));
    parameters
}

/// The metadata record: version, parameters, the input's hash, counts per reason.
pub(super) fn metadata(
    report: &Report,
    parameters: &BTreeMap<String, String>,
) -> BTreeMap<String, String> {
    let mut metadata = parameters.clone();
    let mut say = |key: &str, value: Option<String>| {
        metadata.extend(value.map(|value| (key.to_owned(), value)));
    };
    match &report.input_sha256 {
        Some(hash) => say("input_sha256", Some(hash.clone())),
        None => say("input_read", Some(input_read(report))),
    }
    let name = report.input.file_name().unwrap_or(report.input.as_os_str());
    say("input", Some(name.to_string_lossy().into_owned()));
    say("form", Some(report.form.to_owned()));
    say("from_ns", report.from_ns.map(|ns| ns.to_string()));
    say("to_ns", report.to_ns.map(|ns| ns.to_string()));
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
        metadata.insert(format!("topic {topic}"), value.to_string());
    }
    metadata
}
