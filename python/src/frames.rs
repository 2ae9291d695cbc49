//! The clouds of a recording, one after the other.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use divmerge::annotate::{AnnotateConfig, Decoded, ObjectOptions};
use divmerge::frames::{EncodedClouds, choose_topics};
use divmerge::messages::clouds::CloudMessage;
use divmerge::recording::Overview;
use divmerge::semantics::MaskSource;
use divmerge::{FrameError, PointCloud, Taxonomy};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;

use crate::arrays::shaped;
use crate::clustering::{Columns, Objects, of_cloud};
use crate::errors::{raised, wrong};
use crate::parameters::{COORDINATES, OBJECTS, Parameters, names, recording, set_objects, whole};
use crate::result::{ClusterResult, rotation};
use crate::taxonomy::PyTaxonomy;

/// One cloud of a recording, as the clustering sees it: N points with z up, and classes where those
/// are asked for.
#[pyclass(frozen, module = "divmerge")]
pub struct Frame {
    topic: String,
    number: u64,
    stamp_ns: i64,
    log_time_ns: u64,
    frame_id: String,
    semantics: String,
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
        &self.topic
    }

    /// Number of the cloud on its topic, from 0.
    #[getter]
    fn number(&self) -> u64 {
        self.number
    }

    /// Stamp of the cloud's header, nanoseconds since 1970.
    #[getter]
    fn stamp_ns(&self) -> i64 {
        self.stamp_ns
    }

    /// When the cloud was logged, nanoseconds since 1970.
    #[getter]
    fn log_time_ns(&self) -> u64 {
        self.log_time_ns
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
        &self.semantics
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
        format!("Frame({} of {}, {} points)", self.number, self.topic, self.cloud.len())
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
        let own = (&self.cloud, &self.objects, &self.taxonomy);
        of_cloud(py, own, semantics, columns, parameters)
    }
}

/// The clouds of a topic in the order of the file, one at a time in memory.
#[pyclass(frozen, module = "divmerge")]
pub struct Frames {
    messages: Mutex<EncodedClouds>,
    method: AnnotateConfig,
    taxonomy: Py<PyTaxonomy>,
    fields: Vec<String>,
    topic: String,
    count: u64,
}

#[pymethods]
impl Frames {
    /// The topic.
    #[getter]
    fn topic(&self) -> &str {
        &self.topic
    }

    fn __len__(&self) -> usize {
        self.count as usize
    }

    fn __iter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Frame>> {
        match py.detach(|| self.read()) {
            Some(read) => read.map_err(raised)?.frame(py, self).map(Some),
            None => Ok(None),
        }
    }
}

/// A cloud that has been read.
struct Read {
    topic: String,
    number: u64,
    log_time_ns: u64,
    stamp_ns: i64,
    frame_id: String,
    cloud: PointCloud,
    objects: Objects,
    /// The taxonomy of the classes, where it is not the one that was assumed.
    recognised: Option<Taxonomy>,
    semantics: String,
    fields: Vec<Field>,
}

enum Field {
    Whole(Vec<i64>),
    Real(Vec<f64>),
}

impl Frames {
    fn read(&self) -> Option<divmerge::Result<Read>> {
        let message = self.messages.lock().unwrap_or_else(PoisonError::into_inner).next()?;
        Some(message.and_then(|message| {
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
            let fields = self
                .fields
                .iter()
                .map(|name| field(&wire, name))
                .collect::<Result<_, FrameError>>()?;
            let Decoded { cloud, semantics, .. } = decoded;
            Ok(Read {
                topic: message.topic.to_string(),
                number: message.number,
                log_time_ns: message.log_time_ns(),
                stamp_ns: wire.stamp_ns(),
                frame_id: wire.frame_id.clone(),
                cloud,
                objects,
                recognised,
                semantics,
                fields,
            })
        }))
    }
}

fn field(wire: &CloudMessage, name: &str) -> Result<Field, FrameError> {
    match wire.field(name).is_some_and(|field| field.datatype.is_integer()) {
        true => wire.column_i64(name).map(Field::Whole),
        false => wire.column_f64(name).map(Field::Real),
    }
}

impl Read {
    fn frame(self, py: Python<'_>, frames: &Frames) -> PyResult<Frame> {
        let fields = PyDict::new(py);
        for (name, field) in frames.fields.iter().zip(self.fields) {
            let column = match field {
                Field::Whole(column) => PyArray1::from_vec(py, column).into_any(),
                Field::Real(column) => PyArray1::from_vec(py, column).into_any(),
            };
            fields.set_item(name, column)?;
        }
        Ok(Frame {
            topic: self.topic,
            number: self.number,
            stamp_ns: self.stamp_ns,
            log_time_ns: self.log_time_ns,
            frame_id: self.frame_id,
            semantics: self.semantics,
            fields: fields.unbind(),
            points: PyOnceLock::new(),
            cloud: Arc::new(self.cloud),
            objects: self.objects,
            taxonomy: match self.recognised {
                Some(inner) => Py::new(py, PyTaxonomy { inner })?,
                None => frames.taxonomy.clone_ref(py),
            },
        })
    }
}

/// Names of the arguments of `frames` beside those about objects; of these it takes all but
/// `batch`.
const OF_FRAMES: &[&str] =
    &["taxonomy", "rows", "columns", "fov", "sensor_frame", "start", "stop", "fields"];

#[pyfunction]
#[pyo3(
    signature = (path, topic=None, **parameters),
    text_signature = "(path, topic=None, *, start=0, stop=None, fields=(), semantics='auto', \
        taxonomy=None, rows=None, columns=None, fov=None, sensor_frame='auto', \
        units=None, sensor_origin=(), min_range=None, max_range=None, crop=None, ego=None, \
        tolerance=0.01, \
        model_config=None, model_image='auto', remission_scale=None, runtime='auto', \
        onnxruntime=None, device='auto')"
)]
/// The clouds of a topic of a recording, one at a time in memory, as `divmerge annotate` sees them:
/// an iterator of `Frame`.
///
/// path: an MCAP recording. topic: the topic; the first with clouds if not said (`topics` lists
/// them). start, stop: numbers of the first frame and of the one behind the last, from 0. fields:
/// names of further fields of the points that are wanted in `Frame.fields`. semantics: where
/// classes come from, as at the command line: "auto" (a field label, semantic, class_id or
/// class_ids if there is one whose ids are believed, else ground removal), "field:NAME",
/// "onnx:MODEL.onnx", "labels:DIR", "topic:T", "ground" or "all". taxonomy: as for `cluster`; if
/// not said a network's own, else SemanticKITTI's. sensor_frame: as for `cluster`, or "tf": as the
/// recorded static transforms have it; "auto": the same where they are there; "none": z up.
/// sensor_origin: where the sensor stands, "X,Y,Z" in metres or "TOPIC=X,Y,Z", one or several.
/// units: of the coordinates, "m", "cm" or "mm"; points are in metres. min_range, max_range, crop,
/// ego: which returns are looked at, as at the command line: metres, and blocks as
/// "-50..50,-20..20,.."; the others become NaN. ego may be "auto": the vehicle that carries the
/// sensor, as found in the recording. rows, columns, fov: as for `cluster`, for the image that a
/// network is given. tolerance: how far the stamps of "labels:" and "topic:" may be from
/// that of their cloud, seconds. model_config, model_image, remission_scale, runtime, onnxruntime,
/// device: how a network is run, as at the command line.
///
/// A cloud that cannot be read raises `divmerge.Error`; `next` goes on with the one behind it.
pub fn frames(
    py: Python<'_>,
    path: PathBuf,
    topic: Option<String>,
    parameters: Option<&Bound<'_, PyDict>>,
) -> PyResult<Frames> {
    let path = recording(path);
    let (mut start, mut stop, mut fields) = (0, None, Vec::new());
    let mut objects = ObjectOptions::default();
    let parameters = Parameters::take(
        "frames",
        &[OF_FRAMES, COORDINATES, &OBJECTS[..OBJECTS.len() - 1]],
        parameters,
        |name, value| {
            match name {
                "start" => start = whole(name, value)? as u64,
                "stop" => stop = Some(whole(name, value)? as u64),
                "fields" => fields = names(name, value)?,
                _ => return set_objects(&mut objects, name, value),
            }
            Ok(())
        },
    )?;
    if stop.is_some_and(|stop| stop <= start) {
        return Err(wrong("stop", "must be above start"));
    }
    let method = parameters.annotate_config(py, objects, &path)?;
    let taxonomy = match parameters.taxonomy {
        Some(taxonomy) => taxonomy,
        None => Py::new(py, PyTaxonomy { inner: method.taxonomy.clone() })?,
    };
    let last = stop.map_or(u64::MAX, |stop| stop - 1);
    let opened = py.detach(|| EncodedClouds::open(&path, topic.as_deref(), start..=last));
    let messages = opened.map_err(raised)?;
    let count = messages.message_count().min(last.saturating_add(1)).saturating_sub(start);
    let topic = messages.topic().to_owned();
    Ok(Frames { messages: Mutex::new(messages), method, taxonomy, fields, topic, count })
}

#[pyfunction]
/// The topics of a recording that carry clouds, sorted.
pub fn topics(py: Python<'_>, path: PathBuf) -> PyResult<Vec<String>> {
    let path = recording(path);
    let chosen = py.detach(|| choose_topics(&Overview::read(&path)?, &[], None));
    let topics = chosen.map_err(raised)?.into_values().map(|cloud| cloud.topic.to_string());
    let mut topics: Vec<String> = topics.collect();
    topics.sort();
    topics.dedup();
    Ok(topics)
}
