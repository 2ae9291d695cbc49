//! Methods side by side on clouds with truth.

use std::path::PathBuf;

use divmerge::annotate::{AnnotateConfig, ObjectOptions};
use divmerge::comparison::methods::BOXES;
use divmerge::comparison::{
    Contender, ContenderSetting, MethodScores, USUAL_CONTENDERS, check_settings, measure,
};
use divmerge::evaluate::panoptic::MIN_POINTS;
use divmerge::pipeline::overrides::limits;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;

use crate::annotate::plain;
use crate::asked::method;
use crate::errors::{wrong, wrong_type};
use crate::following::given;
use crate::labelled::{LABELLED, LabelledClouds};
use crate::objects::{OBJECTS, set_objects};
use crate::parameters::{NEEDS_BOXES, Parameters, names, recording, whole};

/// Names of the arguments of `compare` beside those about clouds and objects.
const OWN: &[&str] = &["methods", "voxels", "min_points", "taxonomy", "set"];

/// A line of the command's JSON without the memory of a process.
#[derive(Serialize)]
struct Row {
    method: String,
    #[serde(flatten)]
    measured: MethodScores,
}

#[pyfunction]
#[pyo3(
    signature = (path, **parameters),
    text_signature = "(path, *, methods=('best', 'paper', 'authors', 'alpine', 'euclidean', \
        'dbscan', 'scan-line-run', 'depth-clustering', 'supervoxel', 'one-per-class'), voxels=(), \
        min_points=50, topic=None, sequences=(), start=0, stop=None, labels=None, \
        true_class_field='label', true_instance_field='true_instance', semantics='auto', \
        taxonomy=None, tolerance=0.01, model_config=None, model_image='auto', \
        remission_scale=None, batch=None, runtime='auto', onnxruntime=None, device='auto', \
        set=None, **parameters)"
)]
/// Compares methods on clouds with truth: the dicts, one a method, that `divmerge compare -o
/// FILE.json` writes, but for `peak_memory`, since all are measured in this process.
///
/// path, topic, sequences, start, stop, labels, true_class_field, true_instance_field: as for
/// `failures`. methods: presets ("best", "paper", "authors") and other methods (those of
/// `cluster`), one or several. voxels: also preset "paper" with these sides of a voxel, metres.
/// min_points: unmatched objects of fewer points are neither spurious nor missed. semantics,
/// taxonomy and how a network is run: as for `annotate`. set: parameters by path, as
/// {"cluster.voxel": 0.3}, for each method that has them, or for one, as {"dbscan:method.reach":
/// 0.7}; those of ours are keywords, too, as for `cluster`.
///
/// Of each: `method`, `frames`, `all` and `things` (panoptic quality, 0 to 1; None where methods
/// are given no classes), `classes`, `over` and `under` (mean and deviation of the over- and
/// under-segmentation entropy, nats), `cut_ms` (median from object mask to instances), `frame_ms`
/// (from cloud to labels) and `slowest_ms`. Times are those of one thread while others of Python
/// run.
///
/// Raises `divmerge.Error` where there is no truth, or the taxonomy does not know a class of it.
pub fn compare<'py>(
    py: Python<'py>,
    path: PathBuf,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let path = recording(path);
    let (mut clouds, mut objects) = (LabelledClouds::default(), ObjectOptions::default());
    let (mut min_points, mut voxels) = (MIN_POINTS, Vec::new());
    let mut named: Vec<String> = USUAL_CONTENDERS.split(',').map(str::to_owned).collect();
    // `Parameters` takes it for the method, all of whose parameters are a contender's here.
    if let Some(said) = given(parameters, "min_points")? {
        min_points = whole("min_points", &said)? as u64;
    }
    let known = [LABELLED, OWN, OBJECTS];
    let mut parameters = Parameters::take("compare", &known, parameters, |name, value| {
        match name {
            "methods" => named = names(name, value)?,
            "voxels" => voxels = sides(name, value)?,
            _ if LABELLED.contains(&name) => clouds.set(name, value)?,
            _ => set_objects(&mut objects, name, value)?,
        }
        Ok(())
    })?;
    let settings = settings(&mut parameters)?;
    let method = method(py, &parameters, objects, (&path, &clouds.topics(), None))?;
    let mut contenders =
        named.iter().map(|name| contender(name)).collect::<PyResult<Vec<Contender>>>()?;
    contenders.extend(voxels.into_iter().map(Contender::Voxel));
    check_settings(&contenders, &settings, &method).map_err(|error| parameters.raised(error))?;
    let mut rows = Vec::new();
    for contender in contenders {
        let method = contender.with_settings(&method, &settings);
        let method = method.map_err(|error| parameters.raised(error))?;
        let frames = clouds.open(py, &path, &method)?;
        let measured = measured(py, frames, &method, min_points)?;
        rows.push(Row { method: contender.name(), measured });
    }
    plain(py, &rows)
}

/// The parameters that were set, which are not those of the method that reads the clouds.
fn settings(parameters: &mut Parameters) -> PyResult<Vec<ContenderSetting>> {
    let said = parameters.take_settings().into_iter();
    let setting = |(path, value): (String, _)| {
        ContenderSetting::new(&path, value)
            .map_err(|known| wrong("set", format!("`{path}` is of no method: {known}")))
    };
    said.map(setting).collect()
}

fn contender(name: &str) -> PyResult<Contender> {
    if name == BOXES {
        return Err(wrong("methods", NEEDS_BOXES));
    }
    name.parse().map_err(|known| wrong("methods", format!("`{name}` is no method: {known}")))
}

/// The scores of a method; Ctrl-C ends it behind the next cloud.
fn measured(
    py: Python<'_>,
    frames: divmerge::LabelledFrames,
    method: &AnnotateConfig,
    min_points: u64,
) -> PyResult<MethodScores> {
    let mut failure = None;
    let goes_on = frames.take_while(|_| {
        failure = Python::attach(|py| py.check_signals()).err();
        failure.is_none()
    });
    let measured = py.detach(|| measure(goes_on, method, min_points, || ()));
    match failure {
        Some(failure) => Err(failure),
        None => measured.map_err(LabelledClouds::raised),
    }
}

fn sides(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let problem = || wrong_type(name, "expected sides of voxels in metres");
    let sides = value.try_iter().map_err(|_| problem())?;
    let sides: PyResult<Vec<f64>> = sides.map(|side| side?.extract()).collect();
    let each = sides.map_err(|_| problem())?.into_iter();
    each.map(|side| limits::above_zero(side).map_err(|problem| wrong(name, problem))).collect()
}
