//! The metadata record that says how a recording was annotated.

use std::collections::BTreeMap;

use super::config::{AnnotateConfig, Semantics};
use super::report::AnnotationReport;
use super::tracking::TrackSummary;
use divmerge_core::cloud::sensor_frame::SensorFrame;
use divmerge_core::cloud::{CloudFrames, Crop};

/// Name of the metadata record that says how a recording was annotated.
pub const METADATA_NAME: &str = "divmerge";

/// Name of the metadata records that say which objects were followed, one for each topic.
pub const TRACKS_METADATA_NAME: &str = "divmerge tracks";

/// The objects of a topic that were followed: its name, and a JSON list of [`TrackSummary`].
pub(super) fn track_metadata(topic: &str, tracks: &[TrackSummary]) -> BTreeMap<String, String> {
    BTreeMap::from([
        ("topic".to_owned(), topic.to_owned()),
        ("tracks".to_owned(), serde_json::json!(tracks).to_string()),
    ])
}

/// What stands for the hash of an input that was not read whole.
fn input_read(report: &AnnotationReport) -> String {
    let (read, all) = (report.input_bytes_read, report.input_bytes);
    format!("{read} of {all} bytes, found by the index of the input; no hash of all of it")
}

/// The part of the metadata record that is known beforehand: version and parameters.
pub(super) fn method_metadata(method: &AnnotateConfig) -> BTreeMap<String, String> {
    let json = |value: serde_json::Value| value.to_string();
    let mut parameters = BTreeMap::from([
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("method".to_owned(), method.pipeline.method_name().to_owned()),
        ("preset".to_owned(), method.pipeline.preset.to_owned()),
        ("taxonomy".to_owned(), method.taxonomy.name.clone()),
        ("parameters".to_owned(), json(serde_json::json!(method.pipeline))),
        ("ground".to_owned(), json(serde_json::json!(method.ground))),
    ]);
    let CloudFrames { sensor_frame, sensor_origins, .. } = &method.frames;
    if *sensor_frame != SensorFrame::Auto {
        parameters.insert("sensor_frame".to_owned(), sensor_frame.to_string());
    }
    if !sensor_origins.is_empty() {
        let each: Vec<String> = sensor_origins.iter().map(ToString::to_string).collect();
        parameters.insert("sensor_origin".to_owned(), each.join(" "));
    }
    if let Some(unit) = method.unit {
        parameters.insert("units".to_owned(), unit.to_string());
    }
    if method.crop != Crop::default() {
        parameters.insert("crop".to_owned(), json(serde_json::json!(method.crop)));
    }
    if !method.ego.is_empty() {
        parameters.insert("ego".to_owned(), method.ego.describe());
    }
    if let Semantics::Network(network) = &method.semantics {
        parameters.insert("network".to_owned(), network.describe());
    }
    parameters.extend(method.boxes.describe().map(|boxes| ("boxes".to_owned(), boxes)));
    parameters
}

/// The metadata record: version, parameters, the input's hash, counts per reason.
pub(super) fn metadata(
    report: &AnnotationReport,
    parameters: BTreeMap<String, String>,
) -> BTreeMap<String, String> {
    let mut metadata = parameters;
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
        let mut value = serde_json::json!({
            "frames": report.frames,
            "unreadable": report.unreadable,
            "points": report.points,
            "instances": report.instances,
            "semantics": report.semantics,
            "projection": report.projection,
            "reasons": report.reasons,
        });
        if !report.ego_motion.is_empty() {
            value["ego_motion"] = serde_json::json!(report.ego_motion);
        }
        metadata.insert(format!("topic {topic}"), value.to_string());
    }
    metadata
}
