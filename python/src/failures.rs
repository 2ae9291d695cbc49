//! The objects that the clustering gets wrong, each with its cause.

use std::path::{Path, PathBuf};

use divmerge::annotate::{AnnotateConfig, ObjectOptions};
use divmerge::diagnose::explain::ClusteredCloud;
use divmerge::diagnose::failures::{
    Failure, FailureSummary, LabelledRun, check_classes, failures as failures_of,
};
use divmerge::diagnose::triage::ranking::recorded_positions;
use divmerge::evaluate::panoptic::MIN_POINTS;
use divmerge::frames::LabelledFrame;
use divmerge::pipeline;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;

use crate::annotate::plain;
use crate::asked::{assembly, method};
use crate::labelled::{LABELLED, LabelledClouds};
use crate::objects::{OBJECTS, set_objects};
use crate::parameters::{ALL, COORDINATES, Parameters, recording, whole};

/// Names of the arguments of `failures` beside those about clouds, method and objects.
const OWN: &[&str] = &["small", "assemble"];

/// A failure and where it is: a line of the command's JSON without the commands.
#[derive(Serialize)]
struct Row {
    topic: String,
    frame: u64,
    log_time_ns: Option<u64>,
    #[serde(flatten)]
    failure: Failure,
    cause_in_words: String,
    at: Vec<[f32; 3]>,
}

/// The command's JSON.
#[derive(Serialize)]
struct Found<'a> {
    input: &'a Path,
    method: &'a str,
    preset: &'a str,
    taxonomy: &'a str,
    min_points: u64,
    #[serde(flatten)]
    summary: FailureSummary,
    failures: Vec<Row>,
}

#[pyfunction]
#[pyo3(
    signature = (path, **parameters),
    text_signature = "(path, *, topic=None, sequences=(), start=0, stop=None, labels=None, \
        true_class_field='label', true_instance_field='true_instance', small=50, assemble=None, \
        semantics='auto', taxonomy=None, preset='best', voxel=None, angle=None, gap_columns=None, \
        gap_rows=None, min_points=None, bev=None, method=None, set=None, rows=None, columns=None, \
        fov=None, sensor_frame='auto', units=None, sensor_origin=(), min_range=None, \
        max_range=None, crop=None, ego=None, tolerance=0.01, model_config=None, \
        model_image='auto', remission_scale=None, batch=None, runtime='auto', onnxruntime=None, \
        device='auto', **parameters)"
)]
/// Lists the objects that the clustering gets wrong, with the cause of each: the dict that
/// `divmerge failures --json FILE` writes, without the commands in it.
///
/// path: a recording whose clouds have fields of truth or label files, or a folder in
/// SemanticKITTI's form. topic: of a recording; the first with clouds if not said. sequences: only
/// these of a folder, one or several. start, stop: numbers of the first cloud and of the one behind
/// the last, from 0. labels: a folder of the truth, NNNNNN.label; or true_class_field,
/// true_instance_field: names of its fields. small: unmatched objects of fewer points are no
/// failures. assemble: as for `annotate`. All else is as for `annotate`.
///
/// Of the dict: `frames`, `verdicts` and `causes` (counts), and `failures`, those of the most
/// points first. Of each: `topic`, `frame`, `log_time_ns`, `verdict`, `iou`, `points`, `centre` in
/// metres, `cause` (whose `step` is "mask", "projection", "divide", "merge", "post", "method" or
/// "unexplained"), `cause_in_words`, and `at`, one or two points in metres in the recording's
/// frame, which `explain(path, *failure["at"], ...)` takes.
///
/// Raises `divmerge.Error` where there is no truth, or the taxonomy does not know a class of it.
pub fn failures<'py>(
    py: Python<'py>,
    path: PathBuf,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let path = recording(path);
    let (mut clouds, mut objects) = (LabelledClouds::default(), ObjectOptions::default());
    let (mut small, mut assemble) = (MIN_POINTS, None);
    let known = [LABELLED, OWN, ALL, COORDINATES, OBJECTS];
    let parameters = Parameters::take("failures", &known, parameters, |name, value| {
        match name {
            "small" => small = whole(name, value)? as u64,
            "assemble" => assemble = Some(assembly(name, value)?),
            _ if LABELLED.contains(&name) => clouds.set(name, value)?,
            _ => set_objects(&mut objects, name, value)?,
        }
        Ok(())
    })?;
    let method = method(py, &parameters, objects, (&path, &clouds.topics(), assemble))?;
    let (mut summary, mut rows) = (FailureSummary::default(), Vec::new());
    let mut frames = clouds.open(py, &path, &method)?;
    while let Some(frame) = py.detach(|| frames.next()) {
        py.check_signals()?;
        let found = frame
            .and_then(|frame| py.detach(|| of_frame(&path, &method, (frame, small), &mut summary)));
        rows.extend(found.map_err(LabelledClouds::raised)?);
    }
    rows.sort_by_key(|row: &Row| std::cmp::Reverse(row.failure.judged.points));
    let found = Found {
        input: &path,
        method: method.pipeline.method_name(),
        preset: method.pipeline.preset,
        taxonomy: &method.taxonomy.name,
        min_points: small,
        summary,
        failures: rows,
    };
    plain(py, &found)
}

/// The failures of a frame, which is added to the summary.
fn of_frame(
    path: &Path,
    method: &AnnotateConfig,
    (mut frame, min_points): (LabelledFrame, u64),
    summary: &mut FailureSummary,
) -> divmerge::Result<Vec<Row>> {
    method.prepare(&mut frame)?;
    let LabelledFrame { source, number, log_time_ns, cloud, truth, .. } = &frame;
    let at = format!("{}: cloud {number} of {source}", path.display());
    check_classes(&truth.class, &method.taxonomy, &at)?;
    let (mask, config) = (method.mask(cloud), &method.pipeline);
    let stages = pipeline::run(cloud, mask, config);
    let found = failures_of(&LabelledRun {
        frame: ClusteredCloud { cloud, mask, config, stages: &stages },
        detections: &[],
        true_class: &truth.class,
        true_id: &truth.id,
        taxonomy: &method.taxonomy,
        min_points,
    });
    summary.add(&found);
    let row = |failure: Failure| {
        let at = recorded_positions(cloud, &failure.show);
        Row {
            topic: source.clone(),
            frame: *number,
            log_time_ns: (*log_time_ns != 0).then_some(*log_time_ns),
            cause_in_words: failure.cause.describe(),
            at: at.iter().map(|at| at.map(|along| along as f32)).collect(),
            failure,
        }
    };
    Ok(found.failures.into_iter().map(row).collect())
}
