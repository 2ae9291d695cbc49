//! From a cloud in arrays to instances: what `cluster`, `cluster_image` and frames share.

use std::sync::Arc;
use std::time::Instant;

use divmerge::cloud::Transforms;
use divmerge::cloud::sensor_frame::SensorFrame;
use divmerge::pipeline;
use divmerge::recording::stopwatch::ms_since;
use divmerge::{PointCloud, PointColumns};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::arrays::{self, Numbers};
use crate::cloud_run::{CloudRun, Objects, Origin};
use crate::errors::{raised, wrong};
use crate::parameters::{ALL, Parameters, text};
use crate::result::ClusterResult;
use crate::taxonomy::PyTaxonomy;

/// Names of the arguments of `cluster` beside those of the method.
const COLUMNS: &[&str] = &["confidence", "ring", "source"];

/// Arguments of `cluster` beside those of the method.
#[derive(Default)]
pub struct Columns<'py> {
    confidence: Option<Bound<'py, PyAny>>,
    ring: Option<Bound<'py, PyAny>>,
    source: Option<Bound<'py, PyAny>>,
}

/// The instances of points in an array.
pub fn of_points<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    semantics: Option<&Bound<'py, PyAny>>,
    columns: &Columns<'py>,
    parameters: &Parameters,
) -> PyResult<ClusterResult> {
    let (mut cloud, shape) = arrays::points(points)?;
    columns.set(&mut cloud, &shape)?;
    let objects = objects(semantics, &mut cloud, &shape)?.unwrap_or(Objects::NotGround);
    let cloud = upright(cloud, parameters.sensor_frame)?;
    let made_of = of_arrays(py, cloud, objects, parameters)?;
    run(py, made_of, shape)
}

/// A cloud in arrays with its parameters.
pub fn of_arrays(
    py: Python<'_>,
    cloud: PointCloud,
    objects: Objects,
    parameters: &Parameters,
) -> PyResult<CloudRun> {
    let taxonomy = taxonomy(py, parameters, None)?;
    let parameters = parameters.all(&taxonomy.get().inner)?;
    let origin = Arc::new(Origin::arrays(&objects));
    Ok(CloudRun { cloud: Arc::new(cloud), objects, taxonomy, parameters, origin })
}

/// A frame, which is turned already and has its objects and taxonomy; others can be given.
pub fn of_frame<'py>(
    py: Python<'py>,
    (cloud, own_objects, own_taxonomy): (&Arc<PointCloud>, &Objects, &Py<PyTaxonomy>),
    semantics: Option<&Bound<'py, PyAny>>,
    (columns, origin): (&Columns<'py>, &Arc<Origin>),
    parameters: &Parameters,
) -> PyResult<CloudRun> {
    let shape = vec![cloud.len()];
    let mut cloud = Arc::clone(cloud);
    let has_more =
        columns.confidence.is_some() || columns.ring.is_some() || columns.source.is_some();
    let mut given = None;
    if semantics.is_some() || has_more {
        let mut own = PointCloud::clone(&cloud).into_columns();
        columns.set(&mut own, &shape)?;
        given = objects(semantics, &mut own, &shape)?;
        cloud = Arc::new(own.checked().map_err(raised)?);
    }
    let objects = given.unwrap_or_else(|| own_objects.clone());
    let taxonomy = taxonomy(py, parameters, Some(own_taxonomy))?;
    let parameters = parameters.all(&taxonomy.get().inner)?;
    Ok(CloudRun { cloud, objects, taxonomy, parameters, origin: Arc::clone(origin) })
}

/// Clusters a cloud, whose points have a shape, while other threads of Python run.
pub fn run(py: Python<'_>, made_of: CloudRun, shape: Vec<usize>) -> PyResult<ClusterResult> {
    let (cloud, parameters) = (&*made_of.cloud, &made_of.parameters);
    let mask = made_of.objects.mask(&made_of.taxonomy.get().inner, &parameters.ground);
    let config = parameters.config();
    let (stages, run_ms) = py.detach(|| {
        let started = Instant::now();
        let stages = pipeline::run(cloud, mask, &config);
        (stages, ms_since(started))
    });
    ClusterResult::new(py, made_of, stages, shape, run_ms)
}

/// The taxonomy of the arguments, else the cloud's own, else SemanticKITTI's.
fn taxonomy(
    py: Python<'_>,
    parameters: &Parameters,
    own: Option<&Py<PyTaxonomy>>,
) -> PyResult<Py<PyTaxonomy>> {
    match parameters.taxonomy.as_ref().or(own) {
        Some(taxonomy) => Ok(taxonomy.clone_ref(py)),
        None => PyTaxonomy::usual(py),
    }
}

/// The cloud of some columns, turned upright.
pub fn upright(columns: PointColumns, sensor_frame: Option<SensorFrame>) -> PyResult<PointCloud> {
    let mut cloud = columns.checked().map_err(raised)?.without_fill_values();
    let asked = match sensor_frame {
        Some(SensorFrame::Recorded) => {
            return Err(wrong("sensor_frame", "`tf` is for recordings; give axes or angles"));
        }
        asked => asked.unwrap_or_default(),
    };
    asked.place(&mut cloud, "", &Transforms::default()).map_err(raised)?;
    Ok(cloud)
}

/// The objects of the arguments; classes go into the cloud.
fn objects(
    semantics: Option<&Bound<'_, PyAny>>,
    cloud: &mut PointColumns,
    shape: &[usize],
) -> PyResult<Option<Objects>> {
    let Some(semantics) = semantics else { return Ok(None) };
    if semantics.cast::<PyString>().is_ok() {
        return match text("semantics", semantics)?.as_str() {
            "ground" => Ok(Some(Objects::NotGround)),
            "all" => Ok(Some(Objects::All)),
            other => {
                let problem =
                    format!("`{other}` is neither ground nor all, nor an array of classes");
                Err(wrong("semantics", problem))
            }
        };
    }
    // Of words as in SemanticKITTI the low 16 bits are the class.
    Ok(Some(match arrays::numbers("semantics", semantics, shape, |word| word as u16)? {
        Numbers::Marks(marks) => Objects::Marked(marks),
        Numbers::Whole(classes) => {
            cloud.class = Some(classes);
            Objects::Classes
        }
    }))
}

impl Columns<'_> {
    fn set(&self, cloud: &mut PointColumns, shape: &[usize]) -> PyResult<()> {
        if let Some(confidence) = &self.confidence {
            let mut column = arrays::column("confidence", confidence, shape)?;
            // NaN is not sure at all.
            column.iter_mut().for_each(|sure| *sure = sure.clamp(0.0, 1.0).max(0.0));
            cloud.confidence = Some(column);
        }
        if let Some(ring) = &self.ring {
            cloud.ring = Some(arrays::short_numbers("ring", ring, shape)?);
        }
        if let Some(source) = &self.source {
            cloud.source = Some(arrays::short_numbers("source", source, shape)?);
        }
        Ok(())
    }
}

impl<'py> Columns<'py> {
    /// Sorts the keyword arguments of `cluster` into columns of the cloud and parameters.
    pub fn take(parameters: Option<&Bound<'py, PyDict>>) -> PyResult<(Self, Parameters)> {
        let mut columns = Columns::default();
        let parameters =
            Parameters::take("cluster", &[ALL, COLUMNS], parameters, |name, value| {
                let column = match name {
                    "confidence" => &mut columns.confidence,
                    "ring" => &mut columns.ring,
                    _ => &mut columns.source,
                };
                *column = Some(value.clone());
                Ok(())
            })?;
        Ok((columns, parameters))
    }
}
