//! The cloud that is explained or drawn: a result, a frame, or a frame of a recording.

use std::path::{Path, PathBuf};

use divmerge::annotate::time_spec::TimeSpec;
use divmerge::annotate::{AnnotateConfig, ObjectOptions};
use divmerge::frames::{Assemble, CloudAt, encoded_cloud_at, sweeps_in_parts};
use divmerge::recording::Overview;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::annotate::moment;
use crate::cloud_run::CloudRun;
use crate::clustering::Columns;
use crate::errors::{raised, type_of, wrong, wrong_type};
use crate::frame::{Frame, FrameReader};
use crate::objects::{OBJECTS, set_objects};
use crate::parameters::{ALL, COORDINATES, Parameters, recording, text, whole};
use crate::result::ClusterResult;
use crate::warnings::warn;

/// Names of the arguments that say which cloud of a recording.
const PLACE: &[&str] = &["topic", "frame", "time", "assemble"];

/// Which cloud of a recording.
#[derive(Default)]
struct Place {
    topic: Option<String>,
    frame: Option<u64>,
    time: Option<TimeSpec>,
    assemble: Option<Assemble>,
}

/// Sets an argument of a function's own.
pub type Own<'a, 'py> = &'a mut dyn FnMut(&str, &Bound<'py, PyAny>) -> PyResult<()>;

/// The cloud that a function was given with its keyword arguments, of which the function takes
/// those named `own`: a result, which has its parameters; a frame; or the path of a recording.
pub fn cloud_run<'py>(
    function: &str,
    cloud: &Bound<'py, PyAny>,
    arguments: Option<&Bound<'py, PyDict>>,
    own: &[&str],
    set: Own<'_, 'py>,
) -> PyResult<CloudRun> {
    let py = cloud.py();
    if let Ok(result) = cloud.cast::<ClusterResult>() {
        let function = format!("{function}(Result)");
        Parameters::take(&function, &[own], arguments, set)?;
        return Ok(result.get().made_of().clone_ref(py));
    }
    if let Ok(frame) = cloud.cast::<Frame>() {
        let function = format!("{function}(Frame)");
        let parameters = Parameters::take(&function, &[ALL, own], arguments, set)?;
        return frame.get().cloud_run(py, None, &Columns::default(), &parameters);
    }
    let path: PathBuf = cloud.extract().map_err(|_| {
        let got = type_of(cloud);
        wrong_type(
            "cloud",
            format!("expected a Result, a Frame or the path of a recording, got {got}"),
        )
    })?;
    let (mut place, mut objects) = (Place::default(), ObjectOptions::default());
    let names: [&[&str]; 5] = [own, PLACE, ALL, COORDINATES, OBJECTS];
    let parameters = Parameters::take(function, &names, arguments, |name, value| match name {
        _ if own.contains(&name) => set(name, value),
        _ if PLACE.contains(&name) => place.set(name, value),
        _ => set_objects(&mut objects, name, value),
    })?;
    of_recording(py, &recording(path), &place, (objects, &parameters))
}

impl Place {
    fn set(&mut self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        match name {
            "topic" => self.topic = Some(text(name, value)?),
            "frame" => self.frame = Some(whole(name, value)? as u64),
            "time" => self.time = Some(moment(name, value)?),
            _ => self.assemble = Some(assembly(name, value)?),
        }
        Ok(())
    }

    fn at(&self, overview: &Overview) -> divmerge::Result<CloudAt> {
        match self.time {
            Some(TimeSpec::Frame(number)) => Ok(CloudAt::Frame(number)),
            Some(time) => time.log_time(overview, &[]).map(CloudAt::Time),
            None => Ok(CloudAt::Frame(self.frame.unwrap_or(0))),
        }
    }
}

/// How messages are put together.
pub fn assembly(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Assemble> {
    text(name, value)?.parse().map_err(|problem: String| wrong(name, problem))
}

/// One cloud of a recording.
fn of_recording(
    py: Python<'_>,
    path: &Path,
    place: &Place,
    (objects, parameters): (ObjectOptions, &Parameters),
) -> PyResult<CloudRun> {
    if place.frame.is_some() && place.time.is_some() {
        return Err(wrong("time", "not together with frame"));
    }
    let topics: Vec<String> = place.topic.iter().cloned().collect();
    let asked = (path, &*topics, place.assemble);
    let method = method(py, parameters, objects, asked)?;
    let (start_ns, message) = py
        .detach(|| {
            let overview = Overview::read(path)?;
            let at = place.at(&overview)?;
            let message = encoded_cloud_at(path, place.topic.as_deref(), at, method.assemble)?;
            Ok::<_, divmerge::Error>((overview.start_ns.unwrap_or(0), message))
        })
        .map_err(raised)?;
    let taxonomy = parameters.taxonomy.as_ref().map(|taxonomy| taxonomy.clone_ref(py));
    let reader = FrameReader::new(py, (path, start_ns), method, taxonomy, Vec::new())?;
    let read = py.detach(|| reader.read(&message)).map_err(raised)?;
    let frame = read.frame(py, &reader)?;
    frame.turned_run(py, None, &Columns::default(), parameters)
}

/// What is done to the clouds of some topics of a recording, with a warning of what is odd about
/// them, as at the command line.
pub fn method(
    py: Python<'_>,
    parameters: &Parameters,
    objects: ObjectOptions,
    (path, topics, assemble): (&Path, &[String], Option<Assemble>),
) -> PyResult<AnnotateConfig> {
    let method = parameters.annotate_config(py, objects, path)?;
    let method = AnnotateConfig { assemble, ..method };
    method.refuse_with_turns(path).map_err(raised)?;
    let in_parts = match assemble {
        Some(_) => Vec::new(),
        None => py.detach(|| sweeps_in_parts(path, topics)),
    };
    for problem in method.ego.unknown().chain(in_parts) {
        warn(py, &format!("{}: {problem}", path.display()))?;
    }
    Ok(method)
}
