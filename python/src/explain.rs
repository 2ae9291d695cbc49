//! Why two points are one instance or not.

use std::sync::{Mutex, PoisonError};

use divmerge::diagnose::explain::{
    ClusteredCloud, ExplanationReport, ExplanationText, Subject, distances, nearest_points,
    return_at, what_if_while,
};
use divmerge::diagnose::frame_links::FrameExplanation;
use divmerge::diagnose::track::{TrackExplanation, TrackText};
use divmerge::view::explanation_report;
use divmerge::{Error as LibraryError, PointCloud};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::annotate::{flag, plain};
use crate::asked::cloud_run;
use crate::cloud_run::{CloudRun, Origin};
use crate::errors::{Error, raised, type_of, wrong, wrong_type};
use crate::following::{OVER_TIME, followed, given, needs};
use crate::parameters::{number, within};

/// Names of the arguments about the points.
pub const POINTS: &[&str] = &["instances", "within"];

/// Names of the arguments about an object over time.
const TRACK: &[&str] = &["track", "link"];

/// Pairs of pixels that the text lists for a border: the command's default.
const PAIRS: usize = 3;

/// A point as it is asked for.
#[derive(Clone, Copy)]
enum Point {
    Number(usize),
    /// Metres, the recording's frame.
    Position([f64; 3]),
}

/// What is asked about.
pub struct Question {
    points: Vec<(&'static str, Point)>,
    instances: Option<(u32, u32)>,
    within: f64,
}

impl Default for Question {
    fn default() -> Self {
        Question { points: Vec::new(), instances: None, within: 0.3 }
    }
}

impl Question {
    /// Adds a point: its number, or its position.
    pub fn add(&mut self, name: &'static str, value: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let Some(value) = value else { return Ok(()) };
        let problem = || {
            let wanted = "expected the number of a point, or x, y and z in metres";
            wrong_type(name, format!("{wanted}, got {}", type_of(value)))
        };
        let point = match value.extract::<usize>() {
            Ok(number) => Point::Number(number),
            Err(_) => {
                let all = value.try_iter().map_err(|_| problem())?;
                let all: PyResult<Vec<f64>> = all.map(|one| one?.extract()).collect();
                let position = all.map_err(|_| problem())?.try_into();
                Point::Position(position.map_err(|all: Vec<f64>| {
                    wrong(name, format!("expected x, y and z, got {} numbers", all.len()))
                })?)
            }
        };
        self.points.push((name, point));
        Ok(())
    }

    /// Sets one of the arguments [`POINTS`].
    pub fn set(&mut self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        match name {
            "instances" => {
                let problem = || wrong_type(name, "expected two ids");
                let ids = value.try_iter().map_err(|_| problem())?;
                let ids: PyResult<Vec<u32>> = ids.map(|id| id?.extract()).collect();
                let ids: [u32; 2] =
                    ids.map_err(|_| problem())?.try_into().map_err(|_| problem())?;
                self.instances = Some(ids.into());
            }
            _ => match number(name, value)? {
                within if within > 0.0 && within.is_finite() => self.within = within,
                within => return Err(wrong(name, format!("must be above 0, got {within}"))),
            },
        }
        Ok(())
    }

    /// Whether anything is asked.
    pub fn is_any(&self) -> bool {
        self.instances.is_some() || !self.points.is_empty()
    }

    /// Refuses what is no question.
    pub fn check(&self) -> PyResult<()> {
        match (self.points.len(), self.instances) {
            (0, None) => Err(wrong("a", "say what to explain: a, a and b, or instances")),
            (1.., Some(_)) => Err(wrong("instances", "not together with a and b")),
            (0, Some((a, b))) if a == b => {
                Err(wrong("instances", format!("{a} twice; give two different ones")))
            }
            _ => Ok(()),
        }
    }

    /// The points and their positions in the cloud's frame; none of instances.
    fn subject(&self, frame: &ClusteredCloud) -> Asked {
        if let Some((a, b)) = self.instances {
            let (a, b) = nearest_points(frame, a, b).map_err(Problem::Library)?;
            return Ok((Subject::Pair(a, b), Vec::new()));
        }
        let found = self.points.iter().map(|&(name, point)| self.find(frame.cloud, name, point));
        let (points, positions): (Vec<usize>, Vec<[f64; 3]>) =
            found.collect::<Result<Vec<_>, Problem>>()?.into_iter().unzip();
        match points[..] {
            [a] => Ok((Subject::Point(a), positions)),
            [a, b] if a != b => Ok((Subject::Pair(a, b), positions)),
            _ => {
                let problem = format!("point {} is a as well; give two different ones", points[0]);
                Err(Problem::Wrong("b", problem))
            }
        }
    }

    fn find(
        &self,
        cloud: &PointCloud,
        name: &'static str,
        point: Point,
    ) -> Result<(usize, [f64; 3]), Problem> {
        match point {
            Point::Position(at) => {
                let at = cloud.from_recorded(at);
                let point = return_at(cloud, at, self.within).map_err(Problem::Library)?;
                Ok((point, at))
            }
            Point::Number(point) if point < cloud.len() => {
                Ok((point, cloud.position(point).map(f64::from)))
            }
            Point::Number(point) => {
                let problem = format!("there is no point {point}: the cloud has {}", cloud.len());
                Err(Problem::Wrong(name, problem))
            }
        }
    }
}

type Asked = Result<(Subject, Vec<[f64; 3]>), Problem>;

/// What is wrong with a question.
pub enum Problem {
    /// What the library says.
    Library(LibraryError),
    /// An argument, and why.
    Wrong(&'static str, String),
}

impl Problem {
    /// The same for Python.
    pub fn raised(self) -> PyErr {
        match self {
            Problem::Library(error) => raised(error),
            Problem::Wrong(name, problem) => wrong(name, problem),
        }
    }
}

/// Refuses a method whose merges are not known.
pub fn refuse_other_method(made_of: &CloudRun) -> PyResult<()> {
    match &made_of.parameters.config().other_method {
        None => Ok(()),
        Some(other) => {
            let problem = format!("{} has no votes or merges to explain", other.name());
            Err(wrong("method", problem))
        }
    }
}

/// The report of a question, without changes that would give the other answer.
pub fn report(
    question: &Question,
    origin: &Origin,
    frame: &ClusteredCloud,
) -> Result<(Subject, ExplanationReport), Problem> {
    let (subject, positions) = question.subject(frame)?;
    let Origin { file, message, semantics, .. } = origin;
    let report = explanation_report(file, message, semantics, frame, subject);
    let away = distances(&report.explanation.points, &positions);
    Ok((subject, ExplanationReport { away, ..report }))
}

#[pyfunction]
#[pyo3(
    signature = (cloud, a=None, b=None, **parameters),
    text_signature = "(cloud, a=None, b=None, *, instances=None, within=0.3, what_if=True, \
        track=None, \
        link=None, start=0, stop=None, lag=None, ego_motion='auto', topic=None, frame=0, \
        time=None, assemble=None, semantics='auto', taxonomy=None, preset='best', voxel=None, \
        angle=None, gap_columns=None, gap_rows=None, min_points=None, bev=None, method=None, \
        set=None, rows=None, columns=None, fov=None, sensor_frame='auto', units=None, \
        sensor_origin=(), min_range=None, max_range=None, crop=None, ego=None, tolerance=0.01, \
        model_config=None, model_image='auto', remission_scale=None, batch=None, \
        runtime='auto', onnxruntime=None, device='auto', **parameters)"
)]
/// Says why two points are one instance or not, or what one point belongs to. Returns the dict that
/// `divmerge explain --json` prints, and in `text` what it prints without.
///
/// cloud: a `Result`, whose cloud is clustered again with its parameters; a `Frame`; or the path of
/// a recording. a, b: a point by its number, from 0 in the order of the cloud's points (row by row
/// of an organised one), or by its position (3,) in metres in the frame of the recording, or of the
/// array; the nearest return is meant. One point is explained, two are compared. instances: two
/// ids, instead of points: their nearest points are compared. within: how far a return may be from
/// a position, metres. what_if: search for the smallest change of each single parameter that gives
/// the other answer. topic, frame, time, assemble: which cloud of a recording, as for `figure`. All
/// else is as for `annotate`; with a `Frame` these are the parameters of the method alone, and with
/// a `Result`, which has its own, none.
///
/// track: explain an object over time instead, by its number in `annotate`: the dict that `divmerge
/// explain --track --json` prints, and its `text`; link: the frame that the text explains in
/// detail, without `track` why each instance of that frame is of its track. cloud is then the path
/// of a recording. start, stop: numbers of the first cloud that is followed and of the one behind
/// the last, from 0; lag, ego_motion: as for `annotate`.
///
/// Of the dict: `answer` ("one_instance", "apart", "has_instance", "no_instance"), `decided_by`,
/// `points` (what is known of each: `index`, `position` in metres in the frame of `Frame.points`,
/// ...), `votes`, `later` (the steps after the merge), `what_if` and more.
///
/// Raises `divmerge.Error` if no return, no such instance or no such track is there, ValueError if
/// `method` is another one than ours, which has nothing to explain.
pub fn explain<'py>(
    py: Python<'py>,
    cloud: &Bound<'py, PyAny>,
    a: Option<&Bound<'py, PyAny>>,
    b: Option<&Bound<'py, PyAny>>,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    if given(parameters, "track")?.is_some() || given(parameters, "link")?.is_some() {
        return explain_track(cloud, (a.is_some(), b.is_some()), parameters);
    }
    let mut question = Question::default();
    let mut searches = true;
    question.add("a", a)?;
    question.add("b", b)?;
    let own = [POINTS, TRACK, OVER_TIME, &["what_if"]].concat();
    let made_of = cloud_run("explain", cloud, parameters, &own, &mut |name, value| {
        match name {
            "what_if" => searches = flag(name, value)?,
            _ if !POINTS.contains(&name) => return Err(needs(name, "track or link")),
            _ => question.set(name, value)?,
        }
        Ok(())
    })?;
    question.check()?;
    refuse_other_method(&made_of)?;
    // Ctrl-C ends the search, which clusters the cloud many times.
    let failure = Mutex::new(None);
    let goes_on = || {
        let mut failure = failure.lock().unwrap_or_else(PoisonError::into_inner);
        if failure.is_none() {
            *failure = Python::attach(|py| py.check_signals()).err();
        }
        failure.is_none()
    };
    let explained = made_of.look(py, |frame| {
        let (subject, report) = report(&question, &made_of.origin, frame)?;
        let what_if = searches.then(|| what_if_while(frame, subject, &goes_on));
        Ok(ExplanationReport { what_if, ..report })
    });
    if let Some(failure) = failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(failure);
    }
    let report = explained.map_err(Problem::raised)?;
    let dict = plain(py, &report)?;
    let text = ExplanationText { report: &report, max_pairs: PAIRS }.to_string();
    dict.set_item("text", text)?;
    Ok(dict)
}

/// Why instances of many clouds are one object.
fn explain_track<'py>(
    cloud: &Bound<'py, PyAny>,
    points: (bool, bool),
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    if points != (false, false) {
        let name = if given(parameters, "track")?.is_some() { "track" } else { "link" };
        return Err(wrong(name, "not together with a and b"));
    }
    let (mut track, mut link) = (None, None);
    let (drive, options) = followed("explain", cloud, parameters, TRACK, &mut |name, value| {
        match name {
            "track" => track = Some(within(name, value, u32::MAX as usize)? as u32),
            _ => link = Some(within(name, value, u32::MAX as usize)? as u64),
        }
        Ok(())
    })?;
    let Some(track) = track else {
        let frame = link.unwrap_or(0);
        let explanation = FrameExplanation::of(&drive, frame, &options.params);
        let explanation = explanation.ok_or_else(|| {
            Error::new_err(format!("frame {frame} of {} was not followed", drive.topic))
        })?;
        let dict = plain(cloud.py(), &explanation)?;
        dict.set_item("text", explanation.to_string())?;
        return Ok(dict);
    };
    let explanation = TrackExplanation::of(&drive, track, &options.params).ok_or_else(|| {
        let last = drive.tracks.last().map_or(0, |last| last.track);
        let topic = &drive.topic;
        let problem = format!("no instance of {topic} is of track {track}; they go up to {last}");
        Error::new_err(problem)
    })?;
    let is_there = |frame: &u64| explanation.links.iter().any(|link| link.cloud == *frame);
    if let Some(frame) = link.filter(|frame| !is_there(frame)) {
        return Err(Error::new_err(format!("track {track} is not seen in frame {frame}")));
    }
    let dict = plain(cloud.py(), &explanation)?;
    dict.set_item("text", TrackText { explanation: &explanation, link }.to_string())?;
    Ok(dict)
}
