//! Panoptic quality of arrays and of annotated recordings.

use std::path::{Path, PathBuf};

use divmerge::evaluate::panoptic::MIN_POINTS;
use divmerge::evaluate::{Evaluation, MetricSet, SCAN_STEP_NS, ScanLabels, Scores};
use divmerge::frames::{EncodedClouds, annotated_topics};
use divmerge::messages::annotation::object_field;
use divmerge::recording::Overview;
use numpy::PyUntypedArrayMethods;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::annotate::from_json;
use crate::arrays::{array, whole_numbers};
use crate::errors::{Error, raised, wrong, wrong_type};
use crate::parameters::recording;
use crate::taxonomy::PyTaxonomy;

#[pyfunction]
#[pyo3(
    signature = (scans, *, taxonomy=None, min_points=MIN_POINTS, over_time=false, topic=None),
    text_signature = "(scans, *, taxonomy=None, min_points=50, over_time=False, topic=None)"
)]
/// Panoptic quality, as semantic-kitti-api has it and `divmerge evaluate` prints it: the figures as
/// a dict, 0 to 1. Where no class is found, how well objects are found without, under "objects".
///
/// scans: pairs (truth, prediction), one for each scan; either is a pair of integer arrays (class
/// ids, instances) of one shape, or has them as `semantic` and `instance`, as a `Result` does. Or
/// the path of an annotated recording whose clouds carry their truth as `label` and
/// `true_instance`: then the figures of each annotated topic, by its name. taxonomy: as for
/// `cluster`. A class that it does not know is an error. min_points: unmatched segments of fewer
/// points are neither spurious nor missed. over_time: also LSTQ, HOTA, changes of ids and
/// occlusions, for instances that last from scan to scan; arrays count as 0.1 s apart.
/// topic: of a recording only this one.
pub fn evaluate<'py>(
    py: Python<'py>,
    scans: &Bound<'py, PyAny>,
    taxonomy: Option<&Bound<'py, PyAny>>,
    min_points: u64,
    over_time: bool,
    topic: Option<&str>,
) -> PyResult<Bound<'py, PyAny>> {
    let taxonomy = match taxonomy {
        Some(taxonomy) => PyTaxonomy::of(taxonomy)?,
        None => PyTaxonomy::usual(py)?,
    };
    let taxonomy = &taxonomy.get().inner;
    let metrics = MetricSet { taxonomy, min_points, entropy: false, over_time };
    if let Ok(path) = scans.extract::<PathBuf>() {
        return of_recording(py, &recording(path), topic, metrics);
    }
    let mut sums = Evaluation::new(metrics);
    let each = scans
        .try_iter()
        .map_err(|_| wrong_type("scans", "expected a path, or pairs of truth and prediction"))?;
    for (number, pair) in each.enumerate() {
        let (truth, found) = sides(&pair?, number)?;
        let places = ["prediction", "truth"].map(|side| format!("{side} of scan {number}"));
        let time_ns = number as u64 * SCAN_STEP_NS;
        let (found, truth) = ((&found, places[0].as_str()), (&truth, places[1].as_str()));
        let added = py.detach(|| sums.add(time_ns, found, truth, None));
        added.map_err(raised)?;
    }
    sums.end_sequence();
    dict(py, &sums.scores())
}

/// Truth and prediction of a scan, as many points each.
fn sides(pair: &Bound<'_, PyAny>, number: usize) -> PyResult<(ScanLabels, ScanLabels)> {
    let (truth, found): (Bound<'_, PyAny>, Bound<'_, PyAny>) = pair.extract().map_err(|_| {
        wrong_type("scans", format!("scan {number} is no pair of truth and prediction"))
    })?;
    let truth = side(&truth, &format!("truth of scan {number}"))?;
    let found = side(&found, &format!("prediction of scan {number}"))?;
    let (points, of_truth) = (found.class.len(), truth.class.len());
    match points == of_truth {
        true => Ok((truth, found)),
        false => Err(wrong(
            "scans",
            format!("scan {number}: a prediction of {points} points for a truth of {of_truth}"),
        )),
    }
}

/// Classes and instances: a pair of arrays, or something that has them, as a result does.
fn side(side: &Bound<'_, PyAny>, name: &str) -> PyResult<ScanLabels> {
    let py = side.py();
    let [semantic, instance] = [intern!(py, "semantic"), intern!(py, "instance")];
    let (class, instance) = match (side.getattr(semantic), side.getattr(instance)) {
        (Ok(class), Ok(instance)) => (class, instance),
        _ => side.extract().map_err(|_| {
            wrong_type("scans", format!("{name} is no pair of classes and instances"))
        })?,
    };
    let shape = array(name, &class)?.shape().to_vec();
    let class = whole_numbers(&format!("classes of {name}"), &class, &shape)?;
    let instance = whole_numbers(&format!("instances of {name}"), &instance, &shape)?;
    Ok(ScanLabels::of_columns(&class, instance))
}

/// The figures of each annotated topic whose clouds carry their truth in `label` and
/// `true_instance`.
fn of_recording<'py>(
    py: Python<'py>,
    path: &Path,
    topic: Option<&str>,
    metrics: MetricSet,
) -> PyResult<Bound<'py, PyAny>> {
    let scored = PyDict::new(py);
    let overview = py.detach(|| Overview::read(path)).map_err(raised)?;
    let is_asked = |annotated: &str| {
        topic.is_none_or(|topic| annotated == topic || annotated == format!("{topic}/instances"))
    };
    for annotated in annotated_topics(&overview).into_iter().filter(|topic| is_asked(topic)) {
        let figures = py.detach(|| score(path, annotated, metrics)).map_err(raised)?;
        scored.set_item(annotated, dict(py, &figures)?)?;
    }
    match scored.is_empty() {
        true => Err(Error::new_err(format!("{}: no such annotated topic", path.display()))),
        false => Ok(scored.into_any()),
    }
}

fn score(path: &Path, topic: &str, metrics: MetricSet) -> divmerge::Result<Scores> {
    let mut sums = Evaluation::new(metrics);
    for message in EncodedClouds::open(path, Some(topic), 0..=u64::MAX)? {
        let message = message?;
        let place = format!("{}: cloud {} of {topic}", path.display(), message.number);
        let wire = message.decode()?;
        let own = |class, instance| {
            let columns = (wire.column_u32(class)?, wire.column_u32(instance)?);
            Ok::<_, divmerge::Error>(ScanLabels::of_columns(&columns.0, columns.1))
        };
        let found = if metrics.over_time { object_field(&wire) } else { "instance" };
        let (found, truth) = (own("semantic", found)?, own("label", "true_instance")?);
        let cloud = sums.needs_cloud(&found).then(|| wire.to_cloud(None)).transpose()?;
        sums.add(message.log_time_ns(), (&found, &place), (&truth, &place), cloud.as_ref())?;
    }
    sums.end_sequence();
    Ok(sums.scores())
}

fn dict<'py>(py: Python<'py>, figures: &Scores) -> PyResult<Bound<'py, PyAny>> {
    let json = serde_json::to_string(figures).map_err(|error| Error::new_err(error.to_string()))?;
    from_json(py, &json)
}
