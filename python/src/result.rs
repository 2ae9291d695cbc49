//! What comes of a cloud.

use std::sync::Arc;

use divmerge::PointCloud;
use divmerge::cloud::{Instance, Reason};
use divmerge::pipeline::{StageTimes, Stages};
use divmerge::range_image::NOWHERE;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::{keep_columns, records, shaped};
use crate::cloud_run::CloudRun;
use crate::drawing::usual_png;
use crate::notebook;

/// What became of the points of one cloud. N points, H x W pixels.
///
/// Arrays for each point have the shape of the points without their last axis: (N,), or (H, W) of
/// an organised cloud.
#[pyclass(frozen, name = "Result", module = "divmerge")]
pub struct ClusterResult {
    instance: Py<PyAny>,
    component: Py<PyAny>,
    semantic: Py<PyAny>,
    ground: Option<Py<PyAny>>,
    /// Why each point has no instance.
    reasons: Vec<Reason>,
    /// Without what has been taken above.
    stages: Stages,
    made_of: CloudRun,
    shape: Vec<usize>,
    times: Py<PyDict>,
    lazy: Lazy,
}

/// An array that is made when it is asked for.
struct LazyArray(PyOnceLock<Py<PyAny>>);

impl Default for LazyArray {
    fn default() -> Self {
        LazyArray(PyOnceLock::new())
    }
}

/// What is made when it is asked for.
#[derive(Default)]
struct Lazy {
    reason: LazyArray,
    range_image: LazyArray,
    point_of_pixel: LazyArray,
    pixel_of_point: LazyArray,
    votes: LazyArray,
    merges: LazyArray,
    joins: LazyArray,
    instances: LazyArray,
    png: LazyArray,
}

impl ClusterResult {
    /// The stages of a cloud whose points have a shape; `run_ms` is what the library took.
    pub fn new(
        py: Python<'_>,
        made_of: CloudRun,
        mut stages: Stages,
        shape: Vec<usize>,
        run_ms: f64,
    ) -> PyResult<Self> {
        let labels = std::mem::take(&mut stages.labels);
        let ground = stages.mask.ground.take().map(|ground| shaped(py, ground, &shape));
        Ok(ClusterResult {
            instance: shaped(py, labels.instance, &shape)?.unbind(),
            component: shaped(py, labels.component, &shape)?.unbind(),
            semantic: shaped(py, labels.semantic, &shape)?.unbind(),
            ground: ground.transpose()?.map(Bound::unbind),
            times: times(py, &stages.times, run_ms)?.unbind(),
            reasons: labels.reason,
            stages,
            made_of,
            shape,
            lazy: Lazy::default(),
        })
    }

    /// What it was made of.
    pub fn made_of(&self) -> &CloudRun {
        &self.made_of
    }
}

/// Its columns are used again.
impl Drop for ClusterResult {
    fn drop(&mut self) {
        if let Some(cloud) = Arc::into_inner(std::mem::take(&mut self.made_of.cloud)) {
            keep_columns(cloud);
        }
    }
}

fn times<'py>(py: Python<'py>, times: &StageTimes, run_ms: f64) -> PyResult<Bound<'py, PyDict>> {
    let StageTimes { projection_ms, mask_ms, divide_ms, merge_ms, labels_ms } = times;
    let dict = PyDict::new(py);
    dict.set_item("projection_ms", projection_ms)?;
    dict.set_item("mask_ms", mask_ms)?;
    dict.set_item("divide_ms", divide_ms)?;
    dict.set_item("merge_ms", merge_ms)?;
    dict.set_item("labels_ms", labels_ms)?;
    dict.set_item("run_ms", run_ms)?;
    Ok(dict)
}

#[pymethods]
impl ClusterResult {
    /// Instance of each point from 1, or 0 with a reason: uint32.
    #[getter]
    fn instance(&self, py: Python<'_>) -> Py<PyAny> {
        self.instance.clone_ref(py)
    }

    /// Local component of each point before the merge, from 1, or 0: uint32.
    #[getter]
    fn component(&self, py: Python<'_>) -> Py<PyAny> {
        self.component.clone_ref(py)
    }

    /// Class of each point's instance by majority, else the point's own, in the ids that were
    /// given; 0 where there are no classes: uint16.
    #[getter]
    fn semantic(&self, py: Python<'_>) -> Py<PyAny> {
        self.semantic.clone_ref(py)
    }

    /// Why each point has no instance, as numbers of `Reason`: uint8.
    #[getter]
    fn reason(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        lazily(py, &self.lazy.reason, || {
            let reason: Vec<u8> = self.reasons.iter().map(|&reason| reason as u8).collect();
            shaped(py, reason, &self.shape)
        })
    }

    /// How likely each point is ground, 0 to 1: float32; None unless ground was removed.
    #[getter]
    fn ground(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        self.ground.as_ref().map(|ground| ground.clone_ref(py))
    }

    /// The range image: (H, W) float32, metres from the sensor, NaN in pixels without a point. Row
    /// 0 is the highest beam, unless the cloud is organised and stored bottom up.
    #[getter]
    fn range_image(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let image = &self.stages.image;
        lazily(py, &self.lazy.range_image, || {
            let mut ranges = vec![f32::NAN; image.point_of_pixel.len()];
            for band in &image.bands {
                let pixels = band.rows.start * image.columns()..band.rows.end * image.columns();
                for (range, pixel) in ranges[pixels.clone()].iter_mut().zip(pixels) {
                    if let Some(point) = image.point_at(pixel) {
                        let [x, y, z] = band.in_sensor(self.made_of.cloud.position(point));
                        *range = (x * x + y * y + z * z).sqrt() as f32;
                    }
                }
            }
            shaped(py, ranges, &[image.rows(), image.columns()])
        })
    }

    /// The point seen in each pixel, numbered from 0, or -1: (H, W) int64.
    #[getter]
    fn point_of_pixel(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let image = &self.stages.image;
        lazily(py, &self.lazy.point_of_pixel, || {
            let points = image.point_of_pixel.values().iter().map(number_or_none).collect();
            shaped(py, points, &[image.rows(), image.columns()])
        })
    }

    /// The pixel that each point falls into, row * W + column, or -1 of what is no return: int64. A
    /// shadowed point has the pixel of the point that shadows it.
    #[getter]
    fn pixel_of_point(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        lazily(py, &self.lazy.pixel_of_point, || {
            let pixels = self.stages.image.pixel_of_point.iter().map(number_or_none).collect();
            shaped(py, pixels, &self.shape)
        })
    }

    /// Votes on the borders of components: records (`a`, `b`, `positive`, `negative`), a < b,
    /// sorted; pairs without a common border are not there. Each pair of border pixels counts
    /// twice, as in the paper's Alg. 1.
    #[getter]
    fn votes(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let pairs = &self.stages.votes.pairs;
        lazily(py, &self.lazy.votes, || {
            let columns = [
                ("a", list(py, pairs, |vote| vote.a)),
                ("b", list(py, pairs, |vote| vote.b)),
                ("positive", list(py, pairs, |vote| vote.positive)),
                ("negative", list(py, pairs, |vote| vote.negative)),
            ];
            records(py, pairs.len(), &columns)
        })
    }

    /// Merges of components in their order: records (`target`, `query`, `positive`, `negative`);
    /// the component `query` joined the instance of `target` with these votes, those that its row
    /// had inherited included.
    #[getter]
    fn merges(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let steps = &self.stages.merge.steps;
        lazily(py, &self.lazy.merges, || {
            let columns = [
                ("target", list(py, steps, |step| step.target)),
                ("query", list(py, steps, |step| step.query)),
                ("positive", list(py, steps, |step| step.positive)),
                ("negative", list(py, steps, |step| step.negative)),
            ];
            records(py, steps.len(), &columns)
        })
    }

    /// Joins that follow the merge (preset `best`), in their order: records (`target`, `query`,
    /// `gap`); the piece `query` joined `target` across a gap in metres. Pieces are the instances
    /// of the merge, from 1.
    #[getter]
    fn joins(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let joins = &self.stages.post_merge.joins;
        lazily(py, &self.lazy.joins, || {
            let columns = [
                ("target", list(py, joins, |join| join.target)),
                ("query", list(py, joins, |join| join.query)),
                ("gap", list(py, joins, |join| join.gap)),
            ];
            records(py, joins.len(), &columns)
        })
    }

    /// The instances by id: records (`id`, `semantic`, `class_name`, `confidence`, `likeness`,
    /// `probability`, `points`, `pixels`, `components`, `centre`, `size`, `yaw`).
    ///
    /// The box stands upright: `centre` (3,) and `size` (3,: length, width, height) in metres,
    /// `yaw` in radians from the x axis, in the frame of the points turned by `rotation`.
    /// `confidence` is NaN where classes came without any; `likeness` (its coarse class) and its
    /// `probability` are empty and NaN where there are classes.
    #[getter]
    fn instances(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let all = &self.stages.instances;
        lazily(py, &self.lazy.instances, || instance_records(py, all))
    }

    /// Takes the points as they were given to a frame with z up: (3, 3) float64; the identity
    /// unless a sensor frame asked for more.
    #[getter]
    pub fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        rotation(py, &self.made_of.cloud)
    }

    /// Milliseconds: of each stage, and `run_ms` of the whole method.
    #[getter]
    fn times(&self, py: Python<'_>) -> Py<PyDict> {
        self.times.clone_ref(py)
    }

    /// How the range image was made, in words.
    #[getter]
    fn projection(&self) -> &'static str {
        self.stages.image.projection.describe()
    }

    /// For notebooks: the figure of `divmerge.figure(result)`, 96 pixels per inch, as PNG.
    fn _repr_png_(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        lazily(py, &self.lazy.png, || {
            let png = usual_png(py, &self.made_of, 96.0)?;
            Ok(PyBytes::new(py, &png).into_any())
        })
    }

    /// For notebooks: counts, a table of the classes, and the figure.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        let png = self._repr_png_(py)?.into_bound(py).cast_into()?;
        notebook::html(py, &self.__repr__(), &self.stages.instances, &png)
    }

    fn __repr__(&self) -> String {
        format!(
            "Result({} points, {} instances of {} components)",
            self.made_of.cloud.len(),
            self.stages.instances.len(),
            self.stages.components.count
        )
    }
}

/// By what a cloud was turned, as a matrix.
pub fn rotation<'py>(py: Python<'py>, cloud: &PointCloud) -> PyResult<Bound<'py, PyAny>> {
    let matrix = cloud.turned.to_rotation_matrix();
    let rows = (0..9).map(|i| matrix[(i / 3, i % 3)]).collect();
    shaped::<f64>(py, rows, &[3, 3])
}

fn lazily<'py>(
    py: Python<'py>,
    made: &LazyArray,
    make: impl FnOnce() -> PyResult<Bound<'py, PyAny>>,
) -> PyResult<Py<PyAny>> {
    made.0.get_or_try_init(py, || make().map(Bound::unbind)).map(|array| array.clone_ref(py))
}

fn number_or_none(&number: &u32) -> i64 {
    if number == NOWHERE { -1 } else { i64::from(number) }
}

/// A column of records.
fn list<'py, T, V: numpy::Element>(
    py: Python<'py>,
    of: &[T],
    value: impl Fn(&T) -> V,
) -> Bound<'py, PyAny> {
    PyArray1::from_vec(py, of.iter().map(value).collect()).into_any()
}

/// A column of three numbers each.
fn triples<'py>(
    py: Python<'py>,
    all: &[Instance],
    value: impl Fn(&Instance) -> [f64; 3],
) -> PyResult<Bound<'py, PyAny>> {
    let values: Vec<f64> = all.iter().flat_map(value).collect();
    Ok(PyArray1::from_vec(py, values).reshape([all.len(), 3])?.into_any())
}

fn texts<'py>(
    py: Python<'py>,
    all: &[Instance],
    value: impl Fn(&Instance) -> &str,
) -> PyResult<Bound<'py, PyAny>> {
    let texts: Vec<&str> = all.iter().map(value).collect();
    let numpy = py.import("numpy")?;
    numpy.call_method1("array", (texts, "str"))
}

/// The name of its coarse class, empty where there are classes.
fn coarse_class(instance: &Instance) -> &str {
    instance.coarse_class.map_or("", |found| found.class.name())
}

fn instance_records<'py>(py: Python<'py>, all: &[Instance]) -> PyResult<Bound<'py, PyAny>> {
    let probability = |one: &Instance| one.coarse_class.map_or(f64::NAN, |found| found.probability);
    let columns = [
        ("id", list(py, all, |one| one.id)),
        ("semantic", list(py, all, |one| one.semantic)),
        ("class_name", texts(py, all, |one| one.class_name.as_str())?),
        ("confidence", list(py, all, |one| one.confidence.unwrap_or(f64::NAN))),
        ("likeness", texts(py, all, coarse_class)?),
        ("probability", list(py, all, probability)),
        ("points", list(py, all, |one| one.points)),
        ("pixels", list(py, all, |one| one.pixels)),
        ("components", list(py, all, |one| one.components)),
        ("centre", triples(py, all, |one| one.bounds.centre)?),
        ("size", triples(py, all, |one| one.bounds.size)?),
        ("yaw", list(py, all, |one| one.bounds.yaw)),
    ];
    records(py, all.len(), &columns)
}

/// Names and numbers of the reasons: `NO_RETURN`, 1.
pub fn reasons() -> Vec<(String, u8)> {
    let name = |reason: Reason| {
        let name = serde_json::to_value(reason).unwrap_or_default();
        name.as_str().unwrap_or_default().to_uppercase()
    };
    Reason::ALL.map(|reason| (name(reason), reason as u8)).to_vec()
}
