//! The objects that the clustering gets wrong, each with its cause.

use std::path::PathBuf;

use divmerge::annotate::ObjectOptions;
use divmerge::diagnose::failures::{
    FailureInFrame, FailureReport, FailureSummary, failures_in_frame,
};
use divmerge::evaluate::panoptic::MIN_POINTS;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::annotate::plain;
use crate::asked::{assembly, method};
use crate::labelled::{LABELLED, LabelledClouds};
use crate::objects::{OBJECTS, set_objects};
use crate::parameters::{ALL, COORDINATES, Parameters, recording, whole};

/// Names of the arguments of `failures` beside those about clouds, method and objects.
const OWN: &[&str] = &["small", "assemble"];

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
        let mut in_frame = |frame| failures_in_frame(&path, frame, &method, small, &mut summary);
        let found = frame.and_then(|frame| py.detach(|| in_frame(frame)));
        rows.extend(found.map_err(LabelledClouds::raised)?);
    }
    rows.sort_by_key(|row: &FailureInFrame| std::cmp::Reverse(row.failure.judged.points));
    plain(py, &FailureReport::new(&path, &method, small, (&summary, &rows)))
}
