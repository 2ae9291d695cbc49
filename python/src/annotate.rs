//! Recordings, annotated.

use std::path::{Path, PathBuf};

use divmerge::annotate::time_spec::{self, TimeSpec};
use divmerge::annotate::{
    self as library, AnnotateConfig, AnnotateOptions, AnnotationReport, BoxedInstances,
    EgoMotionSource, Flavor, Form, MessageTypes, ObjectOptions, Slice, TrackMode, TrackOptions,
};
use divmerge::messages::objects::ObjectKind;
use divmerge::recording::Compression;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyString};
use serde::Serialize;

use crate::errors::{Error, exists_already, raised, wrong, wrong_type};
use crate::objects::{OBJECTS, set_objects};
use crate::parameters::{
    ALL, COORDINATES, Parameters, choice, names, number, recording, text, within,
};
use crate::watch::{Progress, See, progress, watched};

/// How the chunks of a recording are compressed.
pub const COMPRESSIONS: [(&str, Compression); 3] =
    [("zstd", Compression::Zstd), ("lz4", Compression::Lz4), ("none", Compression::None)];

#[pyfunction]
#[pyo3(
    signature = (path, out, **parameters),
    text_signature = "(path, out, *, semantics='auto', taxonomy=None, preset='best', voxel=None, \
        angle=None, gap_columns=None, gap_rows=None, min_points=None, bev=None, method=None, \
        set=None, \
        rows=None, columns=None, fov=None, sensor_frame='auto', \
        units=None, sensor_origin=(), min_range=None, max_range=None, crop=None, ego=None, \
        topics=(), \
        from_=None, to=None, objects=None, flavor='auto', compression=None, unchecked=False, \
        assemble=None, track='auto', lag=None, ego_motion='auto', only=False, \
        in_place=False, resume=False, force=False, threads=None, progress=None, \
        tolerance=0.01, model_config=None, model_image='auto', \
        remission_scale=None, batch=None, runtime='auto', onnxruntime=None, device='auto', \
        **parameters)"
)]
/// Writes a recording again with instances in it: the bytes that `divmerge annotate` writes with
/// the same parameters. A viewer's layout is not written. Returns the report that `divmerge
/// annotate --json` prints, as a dict.
///
/// path, out: the recording (MCAP), and the annotated one, which appears when it is whole.
/// semantics, taxonomy, sensor_frame, sensor_origin, units, min_range, max_range, crop, ego,
/// tolerance, model_config, model_image, remission_scale, runtime, onnxruntime, device: as for
/// `frames`; batch: clouds that go through a network at once. preset, voxel, angle, gap_columns,
/// gap_rows, min_points, bev, method, set, rows, columns, fov: as for `cluster`. topics: cloud
/// topics to annotate, one or several; all if not said. from_, to: leave out messages before the
/// one and from the other on: seconds from the start (12.5), or text as at the command line
/// ("@1317384506.4", "2011-09-30T12:28:26Z", "frame:100"). objects: type of the boxes ("markers",
/// "detection3d" or "autoware"), "all" for those of background too, or several of these words;
/// flavor: "auto" or "foxglove". compression: "zstd", "lz4" or "none"; that of most chunks of the
/// input if not said. unchecked: take over chunks without clouds unopened. assemble: cluster whole
/// turns put together of several messages: "auto", "10" (messages) or "0.1s". track: follow objects
/// over time ("auto", "on" or "off"); lag: how far to look ahead for that, seconds, 1 if not said;
/// ego_motion: where the motion of the sensor comes from: "auto" (recorded where it agrees with the
/// clouds), "tf", "topic:/odom", "estimate" (the clouds alone) or "none". only: write the added
/// topics alone; in_place: put the fields into the clouds themselves. resume: go on where a run
/// with resume=True was cut off, and leave what is done if this one is. force: replace an existing
/// output. threads: that unpack, cluster and compress; one for each core up to eight if not said.
/// progress: True for a bar of tqdm, or what is called with the bytes read and the bytes in all (0
/// of a stream); what it raises ends the run.
///
/// Other threads of Python run meanwhile. KeyboardInterrupt ends the run, and nothing half written
/// is left. What is odd in the recording is a UserWarning and stands in the report. Every parameter
/// that `parameters` lists is a keyword, too.
pub fn annotate<'py>(
    py: Python<'py>,
    path: PathBuf,
    out: PathBuf,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    run(py, "annotate", (&recording(path), &out), parameters, None)
}

/// Annotates a recording, or a slice of it, for a function of Python.
pub fn run<'py>(
    py: Python<'py>,
    function: &str,
    (path, out): (&Path, &Path),
    parameters: Option<&Bound<'py, PyDict>>,
    slice: Option<Slice>,
) -> PyResult<Bound<'py, PyAny>> {
    let mut asked = AnnotateArguments::default();
    let parameters = Parameters::take(
        function,
        &[ALL, COORDINATES, OBJECTS, OWN],
        parameters,
        |name, value| asked.set(name, value),
    )?;
    let AnnotateArguments { objects, mut options, from, to, lag, progress, in_place } = asked;
    options.slice = slice;
    if options.form == Form::Only && in_place {
        return Err(wrong("in_place", "not together with only"));
    }
    if options.resume && options.force {
        return Err(wrong("force", "not together with resume"));
    }
    if in_place {
        options.form = Form::InPlace;
    }
    options.resumable = options.resume;
    let window = py.detach(|| time_spec::window(path, (from, to), &options.topics));
    (options.from_ns, options.to_ns) = window.map_err(raised)?;
    let assemble = options.config.assemble;
    options.config = AnnotateConfig { assemble, ..parameters.annotate_config(py, objects, path)? };
    let all = parameters.all(&options.config.taxonomy)?;
    options.tracks = options.tracks.with_parameters(&all);
    options.tracks.params.lag_s = lag.unwrap_or(options.tracks.params.lag_s);
    if !options.force && out.symlink_metadata().is_ok() {
        return Err(exists_already(out));
    }
    reported(py, progress, |see| library::annotate(path, out, &options, see))
}

/// The same of a report, as a dict.
pub fn reported<'py>(
    py: Python<'py>,
    progress: Option<Progress>,
    work: impl FnOnce(See) -> divmerge::Result<AnnotationReport> + Send,
) -> PyResult<Bound<'py, PyAny>> {
    plain(py, &watched(py, progress, work)?)
}

/// Names of the arguments of `annotate` beside those about the method and about objects.
const OWN: &[&str] = &[
    "topics",
    "from_",
    "to",
    "objects",
    "flavor",
    "compression",
    "unchecked",
    "assemble",
    "track",
    "lag",
    "ego_motion",
    "only",
    "in_place",
    "resume",
    "force",
    "threads",
    "progress",
];

/// Arguments of `annotate` beside those of the method.
#[derive(Default)]
struct AnnotateArguments {
    objects: ObjectOptions,
    options: AnnotateOptions,
    in_place: bool,
    from: Option<TimeSpec>,
    to: Option<TimeSpec>,
    lag: Option<f64>,
    progress: Option<Progress>,
}

impl AnnotateArguments {
    fn set(&mut self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let options = &mut self.options;
        match name {
            "topics" => options.topics = names(name, value)?,
            "from_" => self.from = Some(moment(name, value)?),
            "to" => self.to = Some(moment(name, value)?),
            "objects" => set_boxes(&mut options.types, name, value)?,
            "flavor" => {
                let flavors = [("auto", Flavor::Auto), ("foxglove", Flavor::Foxglove)];
                options.types =
                    MessageTypes { flavor: choice(name, value, &flavors)?, ..options.types };
            }
            "compression" => options.compression = Some(choice(name, value, &COMPRESSIONS)?),
            "unchecked" => options.unchecked = flag(name, value)?,
            "assemble" => {
                let how = text(name, value)?.parse();
                options.config.assemble =
                    Some(how.map_err(|problem: String| wrong(name, problem))?);
            }
            "track" => {
                let modes =
                    [("auto", TrackMode::Auto), ("on", TrackMode::On), ("off", TrackMode::Off)];
                options.tracks.mode = choice(name, value, &modes)?;
            }
            "lag" => self.lag = Some(lag(name, value)?),
            "ego_motion" => options.tracks.ego_motion = ego_motion(name, value)?,
            "only" => {
                if flag(name, value)? {
                    options.form = Form::Only;
                }
            }
            "in_place" => self.in_place = flag(name, value)?,
            "resume" => options.resume = flag(name, value)?,
            "force" => options.force = flag(name, value)?,
            "threads" => options.threads = within(name, value, 1024)?,
            "progress" => self.progress = progress(name, value)?,
            _ => return set_objects(&mut self.objects, name, value),
        }
        Ok(())
    }
}

/// The type of the boxes, "all", or several of these words.
fn set_boxes(types: &mut MessageTypes, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let kinds = [
        ("markers", Some(ObjectKind::Markers)),
        ("detection3d", Some(ObjectKind::Detection3d)),
        ("autoware", Some(ObjectKind::Autoware)),
        ("all", None),
    ];
    for word in names(name, value)? {
        match choice(name, PyString::new(value.py(), &word).as_any(), &kinds)? {
            Some(kind) => types.objects = Some(kind),
            None => types.boxed = BoxedInstances::All,
        }
    }
    Ok(())
}

/// How far to look ahead, seconds.
pub fn lag(name: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    let tracks = TrackOptions::default().with_lag(number(name, value)?);
    Ok(tracks.map_err(|problem| wrong(name, problem))?.params.lag_s)
}

/// Where the motion of the sensor comes from.
pub fn ego_motion(name: &str, value: &Bound<'_, PyAny>) -> PyResult<EgoMotionSource> {
    text(name, value)?.parse().map_err(|problem: String| wrong(name, problem))
}

/// True or false.
pub fn flag(name: &str, value: &Bound<'_, PyAny>) -> PyResult<bool> {
    value
        .cast::<PyBool>()
        .map(|flag| flag.is_true())
        .map_err(|_| wrong_type(name, "expected a bool"))
}

/// Seconds from the start as a number, or text as the command line has it.
pub fn moment(name: &str, value: &Bound<'_, PyAny>) -> PyResult<TimeSpec> {
    let said = match value.extract::<f64>() {
        Ok(_) => number(name, value)?.to_string(),
        Err(_) => text(name, value)?,
    };
    said.parse().map_err(|problem: String| wrong(name, problem))
}

/// A value as Python's json reads it.
pub fn plain<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let json = serde_json::to_string(value).map_err(|error| Error::new_err(error.to_string()))?;
    from_json(py, &json)
}

/// A value out of JSON.
pub fn from_json<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import(intern!(py, "json"))?.call_method1(intern!(py, "loads"), (json,))
}
