//! One cloud of a recording, and how it is read.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use divmerge::annotate::{AnnotateConfig, Decoded};
use divmerge::frames::EncodedCloud;
use divmerge::messages::clouds::CloudMessage;
use divmerge::recording::Overview;
use divmerge::semantics::MaskSource;
use divmerge::view::intensity;
use divmerge::{FrameError, PointCloud, Taxonomy};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;

use crate::arrays::shaped;
use crate::cloud_run::{CloudRun, Objects, Origin};
use crate::clustering::{Columns, of_frame, run};
use crate::errors::wrong;
use crate::parameters::Parameters;
use crate::result::{ClusterResult, rotation};
use crate::taxonomy::PyTaxonomy;

/// One cloud of a recording, as the clustering sees it: N points with z up, and classes where those
/// are asked for.
#[pyclass(frozen, module = "divmerge")]
pub struct Frame {
    origin: Arc<Origin>,
    stamp_ns: i64,
    frame_id: String,
    fields: Py<PyDict>,
    points: PyOnceLock<Py<PyAny>>,
    cloud: Arc<PointCloud>,
    objects: Objects,
    taxonomy: Py<PyTaxonomy>,
}

#[pymethods]
impl Frame {
    /// Topic of the cloud.
    #[getter]
    fn topic(&self) -> &str {
        &self.origin.message.topic
    }

    /// Number of the cloud on its topic, from 0.
    #[getter]
    fn number(&self) -> u64 {
        self.origin.message.number
    }

    /// Stamp of the cloud's header, nanoseconds since 1970.
    #[getter]
    fn stamp_ns(&self) -> i64 {
        self.stamp_ns
    }

    /// When the cloud was logged, nanoseconds since 1970.
    #[getter]
    fn log_time_ns(&self) -> u64 {
        self.origin.message.log_time_ns()
    }

    /// Coordinate frame of the cloud.
    #[getter]
    fn frame_id(&self) -> &str {
        &self.frame_id
    }

    /// Rows and columns: (H, W) of an organised cloud, else (1, N).
    #[getter]
    fn shape(&self) -> (usize, usize) {
        (self.cloud.height, self.cloud.width)
    }

    /// x, y and z: (N, 3) float32, metres, in the cloud's own frame turned by `rotation`.
    #[getter]
    fn points(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let make = || {
            let cloud = &self.cloud;
            let axes = cloud.x.iter().zip(&cloud.y).zip(&cloud.z);
            let points = axes.flat_map(|((&x, &y), &z)| [x, y, z]).collect();
            shaped::<f32>(py, points, &[cloud.len(), 3]).map(Bound::unbind)
        };
        self.points.get_or_try_init(py, make).map(|points| points.clone_ref(py))
    }

    /// Class of each point in the recording's ids: (N,) uint16; None where there are none.
    #[getter]
    fn classes<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<u16>>> {
        self.cloud.class.as_deref().map(|class| PyArray1::from_slice(py, class))
    }

    /// How sure each class is, 0 to 1: (N,) float32; None where that is not known.
    #[getter]
    fn confidence<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f32>>> {
        self.cloud.confidence.as_deref().map(|confidence| PyArray1::from_slice(py, confidence))
    }

    /// Beam number of each point: (N,) uint16; None where the cloud has none.
    #[getter]
    fn ring<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<u16>>> {
        self.cloud.ring.as_deref().map(|ring| PyArray1::from_slice(py, ring))
    }

    /// Sensor of each point of a cloud merged of several: (N,) uint16; None where that is not told.
    #[getter]
    fn source<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<u16>>> {
        self.cloud.source.as_deref().map(|source| PyArray1::from_slice(py, source))
    }

    /// The fields that `frames(fields=...)` asked for, by name: (N,) int64, or float64 of fields of
    /// floats.
    #[getter]
    fn fields(&self, py: Python<'_>) -> Py<PyDict> {
        self.fields.clone_ref(py)
    }

    /// Where objects come from, in words: `field:label`, `ground`, `all`, `onnx`, ...
    #[getter]
    fn semantics(&self) -> &str {
        &self.origin.semantics
    }

    /// What the ids of `classes` mean.
    #[getter]
    fn taxonomy(&self, py: Python<'_>) -> Py<PyTaxonomy> {
        self.taxonomy.clone_ref(py)
    }

    /// Takes points as they are recorded to `points`: (3, 3) float64; the identity unless the
    /// sensor is mounted otherwise than with z up.
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        rotation(py, &self.cloud)
    }

    /// The same as `divmerge.cluster(frame, semantics, **parameters)`.
    #[pyo3(signature = (semantics=None, **parameters))]
    fn cluster<'py>(
        &self,
        py: Python<'py>,
        semantics: Option<&Bound<'py, PyAny>>,
        parameters: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<ClusterResult> {
        let (columns, parameters) = Columns::take(parameters)?;
        self.cluster_with(py, semantics, &columns, &parameters)
    }

    fn __len__(&self) -> usize {
        self.cloud.len()
    }

    fn __repr__(&self) -> String {
        let EncodedCloud { number, topic, .. } = &self.origin.message;
        format!("Frame({number} of {topic}, {} points)", self.cloud.len())
    }
}

impl Frame {
    /// Its instances, given what `cluster` takes beside the points.
    pub fn cluster_with<'py>(
        &self,
        py: Python<'py>,
        semantics: Option<&Bound<'py, PyAny>>,
        columns: &Columns<'py>,
        parameters: &Parameters,
    ) -> PyResult<ClusterResult> {
        let made_of = self.cloud_run(py, semantics, columns, parameters)?;
        run(py, made_of, vec![self.cloud.len()])
    }

    /// It with its parameters, given what `cluster` takes beside the points.
    pub fn cloud_run<'py>(
        &self,
        py: Python<'py>,
        semantics: Option<&Bound<'py, PyAny>>,
        columns: &Columns<'py>,
        parameters: &Parameters,
    ) -> PyResult<CloudRun> {
        if parameters.sensor_frame.is_some() {
            return Err(wrong("sensor_frame", "a frame is turned already; frames() takes it"));
        }
        self.turned_run(py, semantics, columns, parameters)
    }

    /// The same where the parameters are those with which it was read.
    pub fn turned_run<'py>(
        &self,
        py: Python<'py>,
        semantics: Option<&Bound<'py, PyAny>>,
        columns: &Columns<'py>,
        parameters: &Parameters,
    ) -> PyResult<CloudRun> {
        let own = (&self.cloud, &self.objects, &self.taxonomy);
        of_frame(py, own, semantics, (columns, &self.origin), parameters)
    }
}

/// How the clouds of a recording are read.
pub struct FrameReader {
    /// The recording.
    pub path: PathBuf,
    start_ns: u64,
    overview: OnceLock<Overview>,
    method: AnnotateConfig,
    taxonomy: Py<PyTaxonomy>,
    fields: Vec<String>,
}

/// A cloud that has been read.
pub struct Read {
    origin: Origin,
    stamp_ns: i64,
    frame_id: String,
    cloud: PointCloud,
    objects: Objects,
    /// The taxonomy of the classes, where it is not the one that was assumed.
    recognised: Option<Taxonomy>,
    fields: Vec<Field>,
}

enum Field {
    Whole(Vec<i64>),
    Real(Vec<f64>),
}

impl FrameReader {
    /// A reader of the clouds of a recording, whose first message was logged at `start_ns`.
    pub fn new(
        py: Python<'_>,
        (path, start_ns): (&Path, u64),
        method: AnnotateConfig,
        taxonomy: Option<Py<PyTaxonomy>>,
        fields: Vec<String>,
    ) -> PyResult<Self> {
        let taxonomy = match taxonomy {
            Some(taxonomy) => taxonomy,
            None => Py::new(py, PyTaxonomy { inner: method.taxonomy.clone() })?,
        };
        let (path, overview) = (path.to_owned(), OnceLock::new());
        Ok(FrameReader { path, start_ns, overview, method, taxonomy, fields })
    }

    /// What is in the recording, which is read once.
    pub fn overview(&self) -> divmerge::Result<&Overview> {
        if let Some(overview) = self.overview.get() {
            return Ok(overview);
        }
        let read = Overview::read(&self.path)?;
        Ok(self.overview.get_or_init(|| read))
    }

    /// The cloud of a message.
    pub fn read(&self, message: &EncodedCloud) -> divmerge::Result<Read> {
        let wire = message.decode()?;
        let decoded = self.method.decode(&wire, &message.key(&wire))?;
        let own = &self.method.taxonomy.name;
        let (objects, recognised) = match decoded.mask {
            MaskSource::All => (Objects::All, None),
            MaskSource::Classes(taxonomy) => {
                let other = Some(taxonomy).filter(|taxonomy| taxonomy.name != *own);
                (Objects::Classes, other.cloned())
            }
            MaskSource::NetworkClasses(..) => (Objects::NetworkClasses, None),
            _ => (Objects::NotGround, None),
        };
        let fields = self.fields.iter().map(|name| field(&wire, name));
        let fields = fields.collect::<Result<_, FrameError>>()?;
        let Decoded { cloud, semantics, .. } = decoded;
        let origin = Origin {
            file: self.path.clone(),
            message: without_bytes(message),
            start_ns: self.start_ns,
            semantics,
            intensity: intensity(&wire),
        };
        let (stamp_ns, frame_id) = (wire.stamp_ns(), wire.frame_id.clone());
        Ok(Read { origin, stamp_ns, frame_id, cloud, objects, recognised, fields })
    }
}

/// Which message it is, without its bytes.
fn without_bytes(message: &EncodedCloud) -> EncodedCloud {
    let parts = message.parts.iter().map(without_bytes).collect();
    EncodedCloud { parts, data: Vec::new().into(), ..message.clone() }
}

fn field(wire: &CloudMessage, name: &str) -> Result<Field, FrameError> {
    match wire.field(name).is_some_and(|field| field.datatype.is_integer()) {
        true => wire.column_i64(name).map(Field::Whole),
        false => wire.column_f64(name).map(Field::Real),
    }
}

impl Read {
    /// The same for Python.
    pub fn frame(self, py: Python<'_>, reader: &FrameReader) -> PyResult<Frame> {
        let fields = PyDict::new(py);
        for (name, field) in reader.fields.iter().zip(self.fields) {
            let column = match field {
                Field::Whole(column) => PyArray1::from_vec(py, column).into_any(),
                Field::Real(column) => PyArray1::from_vec(py, column).into_any(),
            };
            fields.set_item(name, column)?;
        }
        Ok(Frame {
            origin: Arc::new(self.origin),
            stamp_ns: self.stamp_ns,
            frame_id: self.frame_id,
            fields: fields.unbind(),
            points: PyOnceLock::new(),
            cloud: Arc::new(self.cloud),
            objects: self.objects,
            taxonomy: match self.recognised {
                Some(inner) => Py::new(py, PyTaxonomy { inner })?,
                None => reader.taxonomy.clone_ref(py),
            },
        })
    }
}
