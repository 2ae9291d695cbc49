//! The clouds of a recording, one after the other or by number.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use divmerge::Error as LibraryError;
use divmerge::annotate::ObjectOptions;
use divmerge::error::NoCloud;
use divmerge::frames::{CloudTopic, EncodedClouds, Selection, choose_topics};
use divmerge::messages::clouds::CloudChannel;
use divmerge::recording::Overview;
use pyo3::exceptions::{PyIndexError, PyOverflowError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice};

use crate::errors::{raised, type_of, wrong, wrong_type};
use crate::frame::{Frame, FrameReader, Read};
use crate::objects::{OBJECTS, set_objects};
use crate::parameters::{COORDINATES, Parameters, names, recording, whole};

/// Numbers of clouds: from `start` to before `end`, each `step`-th.
#[derive(Clone, Copy)]
struct Numbers {
    start: u64,
    end: u64,
    step: u64,
}

impl Numbers {
    fn count(&self) -> u64 {
        (self.end - self.start).div_ceil(self.step)
    }

    /// The number at a place.
    fn at(&self, place: u64) -> u64 {
        self.start + place * self.step
    }

    fn contain(&self, number: u64) -> bool {
        (number - self.start).is_multiple_of(self.step)
    }
}

/// The clouds of a topic in the order of the file, one at a time in memory.
///
/// An iterator, and a sequence: `frames[7]`, `frames[-1]` and `frames[2:5]` read the chunks of
/// these clouds alone where the recording has an index, and leave the iterator where it is. Numbers
/// count from `start`. A slice is `Frames` again; its step is 1 or more.
#[pyclass(frozen, module = "divmerge")]
pub struct Frames {
    /// None where nothing is selected.
    messages: Mutex<Option<EncodedClouds>>,
    reader: Arc<FrameReader>,
    topic: String,
    numbers: Numbers,
}

#[pymethods]
impl Frames {
    /// The topic.
    #[getter]
    fn topic(&self) -> &str {
        &self.topic
    }

    fn __len__(&self) -> usize {
        self.numbers.count() as usize
    }

    fn __iter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Frame>> {
        match py.detach(|| self.read_next()) {
            Some(read) => read.map_err(raised)?.frame(py, &self.reader).map(Some),
            None => Ok(None),
        }
    }

    /// The frame of a number, of a negative one counted from the end; of a slice `Frames` again.
    fn __getitem__<'py>(
        &self,
        py: Python<'py>,
        index: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if let Ok(slice) = index.cast::<PySlice>() {
            return Ok(Bound::new(py, self.slice(py, slice)?)?.into_any());
        }
        let problem =
            || wrong_type("index", format!("expected an int or a slice, got {}", type_of(index)));
        let number: isize = index.extract().map_err(|error: PyErr| {
            match error.is_instance_of::<PyOverflowError>(py) {
                true => self.no_such(index),
                false => problem(),
            }
        })?;
        let count = self.numbers.count() as isize;
        let place = if number < 0 { number + count } else { number };
        if !(0..count).contains(&place) {
            return Err(self.no_such(index));
        }
        let frame = py.detach(|| self.read_at(self.numbers.at(place as u64))).map_err(raised)?;
        Ok(Bound::new(py, frame.frame(py, &self.reader)?)?.into_any())
    }
}

impl Frames {
    fn no_such(&self, index: &Bound<'_, PyAny>) -> PyErr {
        let (topic, count) = (&self.topic, self.numbers.count());
        PyIndexError::new_err(format!("no frame {index}: {topic} has {count} here"))
    }

    fn slice(&self, py: Python<'_>, slice: &Bound<'_, PySlice>) -> PyResult<Self> {
        let of = slice.indices(self.numbers.count() as isize)?;
        if of.step < 1 {
            return Err(wrong("step", format!("must be 1 or more, got {}", of.step)));
        }
        let start = self.numbers.at(of.start as u64);
        let end = start + (of.stop - of.start).max(0) as u64 * self.numbers.step;
        let step = self.numbers.step * of.step as u64;
        let numbers = Numbers { start, end: end.min(self.numbers.end).max(start), step };
        let messages = match numbers.count() {
            0 => None,
            _ => Some(py.detach(|| self.open(start, numbers.end - 1)).map_err(raised)?),
        };
        let (reader, topic) = (Arc::clone(&self.reader), self.topic.clone());
        Ok(Frames { messages: Mutex::new(messages), reader, topic, numbers })
    }

    /// The messages of some numbers.
    fn open(&self, first: u64, last: u64) -> divmerge::Result<EncodedClouds> {
        let overview = self.reader.overview()?;
        let clouds = overview.channels_of(&self.topic);
        let clouds = clouds.filter_map(|channel| {
            let format = CloudChannel::of(overview, channel).format()?;
            Some((channel.id, CloudTopic { topic: channel.topic.as_str().into(), format }))
        });
        EncodedClouds::of_channels(overview, clouds.collect(), &Selection::of_frames(first..=last))
    }

    fn read_at(&self, number: u64) -> divmerge::Result<Read> {
        let path = || self.reader.path.clone();
        let problem = NoCloud::LostFrame { frame: number };
        let lost = || LibraryError::NoCloud { path: path(), problem };
        let message = self.open(number, number)?.next().ok_or_else(lost)??;
        self.reader.read(&message)
    }

    fn read_next(&self) -> Option<divmerge::Result<Read>> {
        let mut messages = self.messages.lock().unwrap_or_else(PoisonError::into_inner);
        let message = messages.as_mut()?.find(|message| {
            message.as_ref().map_or(true, |message| self.numbers.contain(message.number))
        })?;
        drop(messages);
        Some(message.and_then(|message| self.reader.read(&message)))
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
/// `Frames`, an iterator of `Frame` and a sequence, as in `frames[7]`, `frames[-1]`, `frames[2:5]`.
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
/// network is given. tolerance: how far the stamps of "labels:" and "topic:" may be from that of
/// their cloud, seconds. model_config, model_image, remission_scale, runtime, onnxruntime, device:
/// how a network is run, as at the command line.
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
    let last = stop.map_or(u64::MAX, |stop| stop - 1);
    let opened = py.detach(|| EncodedClouds::open(&path, topic.as_deref(), start..=last));
    let messages = opened.map_err(raised)?;
    let opened = (&*path, messages.start_ns());
    let reader = FrameReader::new(py, opened, method, parameters.taxonomy, fields)?;
    let end = messages.message_count().min(last.saturating_add(1));
    let topic = messages.topic().to_owned();
    let numbers = Numbers { start, end: end.max(start), step: 1 };
    Ok(Frames { messages: Mutex::new(Some(messages)), reader: Arc::new(reader), topic, numbers })
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
