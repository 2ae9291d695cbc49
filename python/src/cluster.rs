//! Clouds in arrays, clustered.

use std::sync::Arc;
use std::time::Instant;

use divmerge::PointCloud;
use divmerge::pipeline::{self, Config};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::sensor_frame::{SensorFrame, Transforms};
use divmerge::stopwatch::ms_since;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::arrays::{self, Numbers};
use crate::errors::{raised, wrong};
use crate::frames::Frame;
use crate::parameters::{ALL, Parameters, WITHOUT_CLASSES, text};
use crate::result::ClusterResult;
use crate::taxonomy::PyTaxonomy;

/// Which points are objects.
#[derive(Clone)]
pub enum Objects {
    /// Those that ground removal leaves.
    NotGround,
    /// All returns.
    All,
    /// Things by the cloud's classes.
    Classes,
    /// Those that are marked.
    Marked(Vec<bool>),
}

/// Names of the arguments of `cluster` beside those of the method.
const COLUMNS: &[&str] = &["confidence", "ring", "source"];

/// Arguments of `cluster` beside those of the method.
#[derive(Default)]
struct Columns<'py> {
    confidence: Option<Bound<'py, PyAny>>,
    ring: Option<Bound<'py, PyAny>>,
    source: Option<Bound<'py, PyAny>>,
}

#[pyfunction]
#[pyo3(
    signature = (points, semantics=None, **parameters),
    text_signature = "(points, semantics=None, *, confidence=None, ring=None, source=None, taxonomy=None, preset='best', voxel=None, angle=None, gap_columns=None, gap_rows=None, min_points=None, bev=None, method=None, rows=None, columns=None, fov=None, sensor_frame=None)"
)]
/// Cuts a LiDAR cloud into object instances.
///
/// points: (N, 3) or (N, 4), or organised (H, W, 3) or (H, W, 4): x, y, z in metres, sensor at the origin, z up unless
///     `sensor_frame` says otherwise; a fourth column is not read. C-contiguous float32 is read in place, other real
///     numbers and strides are converted first. NaN, infinity and the origin are no returns. Anything with `__array__` or
///     `__dlpack__` will do, as a tensor on the CPU; or a `Frame`.
/// semantics: which points are objects. None: a frame's own classes, else ground removal; (N,) integers: class ids of the
///     taxonomy (of ids above 65535, as SemanticKITTI's words, the low 16 bits); (N,) bool: objects are marked; "ground":
///     ground removal; "all": every return.
/// confidence: (N,) probability of each class, 0 to 1.
/// ring, source: (N,) beam number, and sensor in a cloud merged of several, 0 to 65535.
/// taxonomy: what class ids mean, a Taxonomy or the path of a YAML file; SemanticKITTI's if not said.
/// preset: "best", "paper" or "authors", the parameters to start from; each of the following overrides one.
/// voxel: side of a voxel of the divide step, metres.
/// angle: least angle beta between neighbours of one object, degrees.
/// gap_columns, gap_rows: most columns and rows from a pixel to its neighbour.
/// min_points: instances seen in fewer pixels are dropped.
/// bev: merge on the bird's-eye plane: "off", "size", "box", "rectangle" or "hull".
/// method: another method in place of divide and merge: "depth-clustering", "scan-line-run", "euclidean", "dbscan",
///     "supervoxel", "alpine" or "one-per-class".
/// rows, columns, fov: rows of equal elevation, columns of the full circle, and (upper, lower) elevation in degrees of the
///     range image, in place of what is found in the cloud.
/// sensor_frame: how the points' frame stands: where x, y and z look ("rfu", "frd", ...), or roll, pitch and yaw of the
///     sensor in degrees ("180,0,0").
///
/// Other threads of Python run meanwhile.
pub fn cluster<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    semantics: Option<&Bound<'py, PyAny>>,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<ClusterResult> {
    let mut columns = Columns::default();
    let parameters = Parameters::take("cluster", &[ALL, COLUMNS], parameters, |name, value| {
        let column = match name {
            "confidence" => &mut columns.confidence,
            "ring" => &mut columns.ring,
            _ => &mut columns.source,
        };
        *column = Some(value.clone());
        Ok(())
    })?;
    match points.cast::<Frame>() {
        Ok(frame) => of_frame(py, frame.get(), semantics, &columns, &parameters),
        Err(_) => of_points(py, points, semantics, &columns, &parameters),
    }
}

fn of_points<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    semantics: Option<&Bound<'py, PyAny>>,
    columns: &Columns<'py>,
    parameters: &Parameters,
) -> PyResult<ClusterResult> {
    let (mut cloud, shape) = arrays::points(points)?;
    columns.set(&mut cloud, &shape)?;
    let objects = objects(semantics, &mut cloud, &shape)?.unwrap_or(Objects::NotGround);
    let taxonomy = taxonomy(py, parameters, None)?;
    turn(&mut cloud, parameters.sensor_frame)?;
    let config = parameters.config(&taxonomy.get().inner)?;
    run(py, Arc::new(cloud), shape, &objects, &taxonomy, &config)
}

/// A frame is turned already, and has the classes that were asked for; others can be said.
fn of_frame<'py>(
    py: Python<'py>,
    frame: &Frame,
    semantics: Option<&Bound<'py, PyAny>>,
    columns: &Columns<'py>,
    parameters: &Parameters,
) -> PyResult<ClusterResult> {
    if parameters.sensor_frame.is_some() {
        return Err(wrong("sensor_frame", "a frame is turned already; frames() takes it"));
    }
    let shape = vec![frame.cloud.len()];
    let mut cloud = Arc::clone(&frame.cloud);
    let has_more =
        columns.confidence.is_some() || columns.ring.is_some() || columns.source.is_some();
    let mut asked = None;
    if semantics.is_some() || has_more {
        let own = Arc::make_mut(&mut cloud);
        columns.set(own, &shape)?;
        asked = objects(semantics, own, &shape)?;
    }
    let objects = asked.unwrap_or_else(|| frame.objects.clone());
    let taxonomy = taxonomy(py, parameters, Some(&frame.taxonomy))?;
    let config = parameters.config(&taxonomy.get().inner)?;
    run(py, cloud, shape, &objects, &taxonomy, &config)
}

#[pyfunction]
#[pyo3(
    signature = (x, y, z, mask, **parameters),
    text_signature = "(x, y, z, mask, *, preset='best', voxel=None, angle=None, gap_columns=None, gap_rows=None, min_points=None, bev=None, method=None, rows=None, columns=None, fov=None, sensor_frame=None)"
)]
/// Cuts the objects of an organised range image into instances, as the paper's own Python function does.
///
/// x, y, z: (H, W) metres, a row per beam and a column per moment; NaN, infinity or the origin where nothing came back.
/// mask: (H, W) bool, or integers of which 0 is no object.
///
/// Instances are told by the mask and the geometry alone, without classes. The parameters are those of `cluster`; arrays of
/// the result are (H, W).
pub fn cluster_image<'py>(
    py: Python<'py>,
    x: &Bound<'py, PyAny>,
    y: &Bound<'py, PyAny>,
    z: &Bound<'py, PyAny>,
    mask: &Bound<'py, PyAny>,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<ClusterResult> {
    let parameters =
        Parameters::take("cluster_image", &[WITHOUT_CLASSES], parameters, |_, _| Ok(()))?;
    let (mut cloud, shape) = arrays::image_points([("x", x), ("y", y), ("z", z)])?;
    let (Numbers::Marks(marks) | Numbers::Whole(marks)) =
        arrays::numbers("mask", mask, &shape, |number| number != 0)?;
    let objects = Objects::Marked(marks);
    let taxonomy = taxonomy(py, &parameters, None)?;
    turn(&mut cloud, parameters.sensor_frame)?;
    let config = parameters.config(&taxonomy.get().inner)?;
    run(py, Arc::new(cloud), shape, &objects, &taxonomy, &config)
}

/// Clusters a cloud with other threads at their work.
fn run(
    py: Python<'_>,
    cloud: Arc<PointCloud>,
    shape: Vec<usize>,
    objects: &Objects,
    taxonomy: &Py<PyTaxonomy>,
    config: &Config,
) -> PyResult<ClusterResult> {
    let taxonomy = &taxonomy.get().inner;
    let (stages, run_ms) = py.detach(|| {
        let ground = GroundParams::default();
        let mask = match objects {
            Objects::NotGround => MaskSource::NotGround(&ground),
            Objects::All => MaskSource::All,
            Objects::Classes => MaskSource::Classes(taxonomy),
            Objects::Marked(marks) => MaskSource::Marked(marks),
        };
        let started = Instant::now();
        let stages = pipeline::run(&cloud, mask, config);
        (stages, ms_since(started))
    });
    ClusterResult::new(py, cloud, stages, shape, run_ms)
}

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

fn turn(cloud: &mut PointCloud, sensor_frame: Option<SensorFrame>) -> PyResult<()> {
    let asked = match sensor_frame {
        Some(SensorFrame::Recorded) => {
            return Err(wrong("sensor_frame", "`tf` is for recordings; give axes or angles"));
        }
        asked => asked.unwrap_or(SensorFrame::AsIs),
    };
    cloud.turn(asked.turn("", &Transforms::default()).map_err(raised)?);
    Ok(())
}

/// What is said of the objects; classes go into the cloud.
fn objects(
    semantics: Option<&Bound<'_, PyAny>>,
    cloud: &mut PointCloud,
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
    fn set(&self, cloud: &mut PointCloud, shape: &[usize]) -> PyResult<()> {
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
