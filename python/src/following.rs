//! The objects of a drive, followed over time: for the figure of their ways, and for why they are
//! one.

use std::path::PathBuf;

use divmerge::annotate::{FollowedDrive, ObjectOptions, TrackOptions, follow_drive};
use divmerge::frames::Assemble;
use divmerge::{Error as LibraryError, annotate::FollowProgress};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::annotate::{ego_motion, lag};
use crate::asked::{Own, assembly, method};
use crate::errors::{raised, type_of, wrong, wrong_type};
use crate::objects::{OBJECTS, set_objects};
use crate::parameters::{ALL, COORDINATES, Parameters, recording, text, whole};
use crate::triage::numbers;

/// Names of the arguments that a cloud alone has no use for.
pub const OVER_TIME: &[&str] = &["start", "stop", "lag", "ego_motion"];

/// Names of the arguments that say what is followed.
const FOLLOWED: &[&str] = &["topic", "assemble", "start", "stop", "lag", "ego_motion"];

/// What is followed, and how.
#[derive(Default)]
struct Following {
    topic: Option<String>,
    assemble: Option<Assemble>,
    start: usize,
    stop: Option<usize>,
    lag: Option<f64>,
    options: TrackOptions,
}

impl Following {
    fn set(&mut self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        match name {
            "topic" => self.topic = Some(text(name, value)?),
            "assemble" => self.assemble = Some(assembly(name, value)?),
            "start" => self.start = whole(name, value)?,
            "stop" => self.stop = Some(whole(name, value)?),
            "lag" => self.lag = Some(lag(name, value)?),
            _ => self.options.ego_motion = ego_motion(name, value)?,
        }
        Ok(())
    }
}

/// An argument that is given and not None.
pub fn given<'py>(
    arguments: Option<&Bound<'py, PyDict>>,
    name: &str,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let value = arguments.map(|arguments| arguments.get_item(name)).transpose()?.flatten();
    Ok(value.filter(|value| !value.is_none()))
}

/// The objects of a recording, followed with the keyword arguments of a function, which itself
/// takes those named `own`; and how they were followed.
pub fn followed<'py>(
    function: &str,
    cloud: &Bound<'py, PyAny>,
    arguments: Option<&Bound<'py, PyDict>>,
    own: &[&str],
    set: Own<'_, 'py>,
) -> PyResult<(FollowedDrive, TrackOptions)> {
    let py = cloud.py();
    let path: PathBuf = cloud.extract().map_err(|_| {
        let problem = "objects are followed in a recording; expected its path, got";
        wrong_type("cloud", format!("{problem} {}", type_of(cloud)))
    })?;
    let path = recording(path);
    let (mut asked, mut objects) = (Following::default(), ObjectOptions::default());
    let names: [&[&str]; 5] = [own, FOLLOWED, ALL, COORDINATES, OBJECTS];
    let parameters = Parameters::take(function, &names, arguments, |name, value| match name {
        _ if own.contains(&name) => set(name, value),
        _ if FOLLOWED.contains(&name) => asked.set(name, value),
        _ => set_objects(&mut objects, name, value),
    })?;
    let topics: Vec<String> = asked.topic.iter().cloned().collect();
    let config = method(py, &parameters, objects, (&path, &topics, asked.assemble))?;
    let mut options = asked.options.with_parameters(&parameters.all(&config.taxonomy)?);
    options.params.lag_s = asked.lag.unwrap_or(options.params.lag_s);
    let clouds = numbers(asked.start, asked.stop)?;
    let mut failure = None;
    // Ctrl-C ends it.
    let mut goes_on = |_: FollowProgress| {
        failure = Python::attach(|py| py.check_signals()).err();
        match failure {
            None => Ok(()),
            Some(_) => Err(LibraryError::Interrupted { path: path.clone() }),
        }
    };
    let asked = (asked.topic.as_deref(), clouds);
    let drive = py.detach(|| follow_drive(&path, asked, (&config, &options), &mut goes_on));
    match failure {
        Some(failure) => Err(failure),
        None => Ok((drive.map_err(raised)?, options)),
    }
}

/// Refuses an argument of objects over time where a cloud alone is asked about.
pub fn needs(name: &str, which: &str) -> PyErr {
    wrong(name, format!("only with {which}"))
}
