//! The most suspect decisions of a recording.

use std::ops::{self, ControlFlow};
use std::path::{Path, PathBuf};

use divmerge::Error as LibraryError;
use divmerge::annotate::time_spec::{self, TimeSpec};
use divmerge::annotate::{ObjectOptions, RunEvent};
use divmerge::diagnose::triage::TriageParams;
use divmerge::diagnose::triage::ranking::{RankedCase, Ranking};
use divmerge::diagnose::triage::recording::{TriageOutput, Triaged, triage_recording};
use divmerge::diagnose::triage::table::SuspectTable;
use divmerge::frames::{Assemble, Selection};
use divmerge::recording::{Compression, MessageRange, Overview, is_same_file, write_file};
use divmerge::view::case_pages::{CaseReport, entry, is_one_file};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Value, json};

use crate::annotate::{COMPRESSIONS, flag, moment, plain};
use crate::asked::{assembly, method};
use crate::errors::{exists_already, raised, wrong};
use crate::objects::{OBJECTS, set_objects};
use crate::parameters::{
    ALL, COORDINATES, Parameters, choice, names, path, recording, whole, within,
};
use crate::watch::{Progress, progress, watched};

/// Names of the arguments of `triage` beside those about the method and about objects.
const OWN: &[&str] = &[
    "topics",
    "start",
    "stop",
    "from_",
    "to",
    "assemble",
    "limit",
    "weigh_points",
    "out",
    "csv",
    "report",
    "compression",
    "force",
    "progress",
];

/// Arguments of `triage` beside those of the method.
struct TriageArguments {
    objects: ObjectOptions,
    topics: Vec<String>,
    start: usize,
    stop: Option<usize>,
    from: Option<TimeSpec>,
    to: Option<TimeSpec>,
    assemble: Option<Assemble>,
    limit: usize,
    params: TriageParams,
    out: Option<PathBuf>,
    csv: Option<PathBuf>,
    report: Option<PathBuf>,
    compression: Compression,
    force: bool,
    progress: Option<Progress>,
}

impl TriageArguments {
    fn new() -> Self {
        TriageArguments {
            objects: ObjectOptions::default(),
            topics: Vec::new(),
            start: 0,
            stop: None,
            from: None,
            to: None,
            assemble: None,
            limit: 20,
            params: TriageParams::default(),
            out: None,
            csv: None,
            report: None,
            compression: Compression::Zstd,
            force: false,
            progress: None,
        }
    }

    fn set(&mut self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        match name {
            "topics" => self.topics = names(name, value)?,
            "start" => self.start = whole(name, value)?,
            "stop" => self.stop = Some(whole(name, value)?),
            "from_" => self.from = Some(moment(name, value)?),
            "to" => self.to = Some(moment(name, value)?),
            "assemble" => self.assemble = Some(assembly(name, value)?),
            "limit" => self.limit = whole(name, value)?,
            "weigh_points" => {
                self.params.min_points = within(name, value, u32::MAX as usize)? as u64;
            }
            "out" => self.out = Some(path(name, value)?),
            "csv" => self.csv = Some(path(name, value)?),
            "report" => self.report = Some(path(name, value)?),
            "compression" => self.compression = choice(name, value, &COMPRESSIONS)?,
            "force" => self.force = flag(name, value)?,
            "progress" => self.progress = progress(name, value)?,
            _ => return set_objects(&mut self.objects, name, value),
        }
        Ok(())
    }
}

/// Numbers from the first to before the last.
pub fn numbers(start: usize, stop: Option<usize>) -> PyResult<MessageRange> {
    if stop.is_some_and(|stop| stop <= start) {
        return Err(wrong("stop", "must be above start"));
    }
    let first = match start {
        0 => ops::Bound::Unbounded,
        start => ops::Bound::Included(start as u64),
    };
    Ok((first, stop.map_or(ops::Bound::Unbounded, |stop| ops::Bound::Excluded(stop as u64))))
}

#[pyfunction]
#[pyo3(
    signature = (path, **parameters),
    text_signature = "(path, *, limit=20, weigh_points=50, topics=(), start=0, stop=None, \
        from_=None, to=None, assemble=None, out=None, csv=None, report=None, \
        compression='zstd', force=False, progress=None, semantics='auto', taxonomy=None, \
        preset='best', voxel=None, angle=None, gap_columns=None, gap_rows=None, \
        min_points=None, bev=None, method=None, set=None, \
        rows=None, columns=None, fov=None, sensor_frame='auto', units=None, sensor_origin=(), \
        min_range=None, max_range=None, crop=None, ego=None, tolerance=0.01, model_config=None, \
        model_image='auto', remission_scale=None, batch=None, runtime='auto', onnxruntime=None, \
        device='auto', **parameters)"
)]
/// Lists the most suspect decisions in a recording, without any truth, as `divmerge triage` does.
///
/// path: the recording (MCAP). limit: most cases that are listed. weigh_points: instances of fewer
/// points weigh less. topics, from_, to, assemble, progress: as for `annotate`. start, stop:
/// numbers of the first cloud and of the one behind the last, from 0. out: also write the recording
/// with a topic T/suspicion for each cloud topic T; compression: of that file. csv: also write
/// every suspect of every frame as a table. report: also write pages with a figure and an
/// explanation of each case, one .html file or a folder. force: replace existing files. All else is
/// as for `annotate`.
///
/// Returns a dict: `frames`, `unreadable` (clouds that could not be read), `instances`, `suspects`
/// (how many there are), `output_bytes`, and `cases`, the most suspect first. Of each case:
/// `topic`, `frame` (number of its cloud), `seconds` from the start, `score` (how likely it is a
/// failure, 0 to 1), `instance` in words, `at` (one or two points, metres in the recording's frame:
/// what `explain(path, *case["at"], topic=case["topic"], frame=case["frame"])` takes) and
/// `suspects` (dicts of `kind`, `score`, `evidence`, `concerns`, `points` by number, `position`,
/// `measured`, `bound`, `unit`, `sentence`).
pub fn triage<'py>(
    py: Python<'py>,
    path: PathBuf,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let path = recording(path);
    let mut asked = TriageArguments::new();
    let known = [OWN, ALL, COORDINATES, OBJECTS];
    let explain = ExplainCall::new(&path, parameters)?;
    let parameters =
        Parameters::take("triage", &known, parameters, |name, value| asked.set(name, value))?;
    let TriageArguments { objects, topics, from, to, assemble, out, csv, report, .. } = asked;
    let entry = report.as_deref().map(entry);
    refuse([("out", &out), ("csv", &csv), ("report", &entry)], &path, asked.force)?;
    let frames = numbers(asked.start, asked.stop)?;
    let window = py.detach(|| time_spec::window(&path, (from, to), &topics));
    let (from_ns, to_ns) = window.map_err(raised)?;
    let selection = Selection { topics, frames, from_ns, to_ns };
    py.detach(|| selection.check(&path)).map_err(raised)?;
    let method = method(py, &parameters, objects, (&path, &selection.topics, assemble))?;
    let overview = py.detach(|| Overview::read(&path)).map_err(raised)?;
    let mut ranking = Ranking::new(asked.limit, overview.start_ns.unwrap_or(0));
    let (params, compression, force) = (asked.params, asked.compression, asked.force);
    let output = out.as_deref().map(|path| TriageOutput { path, compression, force });
    let table = csv.as_deref().map(|csv| SuspectTable::create(csv, force));
    let mut table = table.transpose().map_err(raised)?;
    let triaged = watched(py, asked.progress, |see| {
        let mut on_event = |event: RunEvent| match see(event) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(LibraryError::Interrupted { path: path.clone() }),
        };
        let of = (&selection, &method, &params);
        triage_recording(&path, output, of, &mut on_event, &mut |frame, found| {
            if let Some(table) = &mut table {
                let (topic, number) = (frame.key.topic, frame.key.number);
                let explain = |at: &[[f64; 3]]| explain.of(topic, number, at);
                table.add(frame, ranking.seconds(frame), found, explain);
            }
            ranking.add(frame, found);
            Ok(())
        })
    })?;
    table.map_or(Ok(()), SuspectTable::finish).map_err(raised)?;
    if let (Some(report), Some(entry)) = (&report, &entry) {
        let (input, ranking, method) = (path.as_path(), &ranking, &method);
        let pages = CaseReport { input, ranking, method, commands: explain.of_each(ranking) };
        py.detach(|| write_pages(&pages, (report, entry), force)).map_err(raised)?;
    }
    plain(py, &found(&ranking, &triaged))
}

/// What was found, as it is returned.
fn found(ranking: &Ranking, triaged: &Triaged) -> Value {
    let cases: Vec<Value> = ranking.cases.iter().map(case).collect();
    json!({
        "frames": ranking.frames,
        "unreadable": triaged.visited.unreadable,
        "instances": ranking.instances,
        "suspects": ranking.suspects,
        "output_bytes": triaged.output_bytes,
        "cases": cases,
    })
}

/// Refuses outputs that are the input, or exist and may not be replaced.
fn refuse(outputs: [(&str, &Option<PathBuf>); 3], input: &Path, force: bool) -> PyResult<()> {
    for (name, file) in outputs {
        match file {
            Some(file) if is_same_file(input, file) => {
                return Err(wrong(name, format!("{} is the recording itself", file.display())));
            }
            Some(file) if !force && file.symlink_metadata().is_ok() => {
                return Err(exists_already(file));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Writes the pages of a report, the one to open last.
fn write_pages(
    pages: &CaseReport,
    (report, entry): (&Path, &Path),
    force: bool,
) -> divmerge::Result<()> {
    let files = pages.files(report, || ())?;
    if !is_one_file(report) {
        let problem = |source| LibraryError::Io { path: report.to_owned(), source };
        std::fs::create_dir_all(report).map_err(problem)?;
    }
    for (name, page) in files[1..].iter().rev() {
        write_file(&report.join(name), page.as_bytes(), force)?;
    }
    Ok(write_file(entry, files[0].1.as_bytes(), force)?)
}

/// The call that explains a case.
struct ExplainCall {
    path: String,
    /// The arguments about the method, as they were given.
    others: String,
}

impl ExplainCall {
    fn new(path: &Path, arguments: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut others = String::new();
        for (name, value) in arguments.into_iter().flatten() {
            let name: String = name.extract()?;
            let is_own = OWN.contains(&name.as_str()) && name != "assemble";
            if !is_own && !value.is_none() {
                others += &format!(", {name}={}", value.repr()?);
            }
        }
        Ok(ExplainCall { path: format!("{:?}", path.display().to_string()), others })
    }

    fn of_each(&self, ranking: &Ranking) -> Vec<String> {
        let cases = ranking.cases.iter();
        cases.map(|case| self.of(&case.topic, case.frame, &case.at)).collect()
    }

    fn of(&self, topic: &str, frame: u64, at: &[[f64; 3]]) -> String {
        let ExplainCall { path, others } = self;
        let at = at.iter().map(|[x, y, z]| format!(", ({x:.3}, {y:.3}, {z:.3})"));
        let at: String = at.collect();
        format!("divmerge.explain({path}{at}, topic={topic:?}, frame={frame}{others})")
    }
}

fn case(case: &RankedCase) -> Value {
    json!({
        "topic": case.topic,
        "frame": case.frame,
        "seconds": case.seconds,
        "score": case.score,
        "instance": case.instance,
        "at": case.at,
        "suspects": case.suspects,
    })
}
