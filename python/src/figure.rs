//! Figures of a clustered cloud.

use std::path::{Path, PathBuf};

use divmerge::error::spelling::did_you_mean;
use divmerge::recording::write_file;
use divmerge::view::{self, FigureOptions, FrameScene, Panel, PixelCrop, PlaneRegion, Theme};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::annotate::flag;
use crate::asked::cloud_run;
use crate::cloud_run::CloudRun;
use crate::drawing::{FORMS, Form, Look, drawn, encoded, write_steps};
use crate::errors::{exists_already, raised, wrong, wrong_type};
use crate::explain::{POINTS, Problem, Question, refuse_other_method, report};
use crate::following::{OVER_TIME, followed, given, needs};
use crate::parameters::{choice, names, number, path};

/// Names of the arguments of `figure` beside those about cloud and method.
const OWN: &[&str] = &[
    "a", "b", "panels", "theme", "aspect", "dpi", "window", "view", "format", "force", "steps",
    "steps_by",
];

#[pyfunction]
#[pyo3(
    signature = (cloud, out=None, **parameters),
    text_signature = "(cloud, out=None, *, format=None, panels=(), theme='dark', aspect=0.125, \
        dpi=192, window=None, view=None, steps=None, steps_by='instance', force=False, \
        a=None, b=None, instances=None, within=0.3, tracks=False, start=0, stop=None, \
        lag=None, ego_motion='auto', \
        topic=None, frame=0, time=None, assemble=None, semantics='auto', taxonomy=None, \
        preset='best', voxel=None, angle=None, gap_columns=None, gap_rows=None, \
        min_points=None, bev=None, method=None, set=None, rows=None, columns=None, \
        fov=None, sensor_frame='auto', units=None, sensor_origin=(), min_range=None, \
        max_range=None, crop=None, ego=None, tolerance=0.01, model_config=None, \
        model_image='auto', remission_scale=None, batch=None, runtime='auto', \
        onnxruntime=None, device='auto', **parameters)"
)]
/// Draws the clustering of a cloud: the bytes that `divmerge figure` writes, or with `a`, `b` or
/// `instances` those of `divmerge explain -o`. Returns them, or None if they are written to `out`.
///
/// cloud: a `Result`, whose cloud is clustered again with its parameters; a `Frame`; or the path of
/// a recording. out: a file, which appears when it is whole. format: "png", "svg" or "pdf"; if not
/// said, that of `out`, else "png". panels: from the top, one or several of "range", "intensity",
/// "mask", "components", "instances", "votes" and "bev"; if not said, those that the method has.
/// theme: "dark" or "light". aspect: height over width of the whole range image, 0.01 to 10. dpi:
/// pixels per inch, 24 to 1200; a figure is 10.4 inches wide. window: ((first, end), (first, end)),
/// the columns and the rows from the top that are shown, None for all. view: ((x, x), (y, y)), the
/// part of the bird's-eye plane, metres. steps: also write numbered pictures to this folder: the
/// merge step by step, or without classes each object and the tree of merges around it; steps_by:
/// "instance", or "decision" for one picture for each merge by votes. force: replace existing
/// files. a, b, instances, within:
/// draw what `explain` says of these; aspect, panels, window and view are then its own. tracks:
/// draw the ways of all objects of a recording, as `divmerge figure --tracks`; start, stop: numbers
/// of the first cloud that is followed and of the one behind the last, from 0; lag, ego_motion: as
/// for `annotate`. topic: of a recording; the first with clouds if not said. frame: number of the
/// cloud on its topic, from 0. time: take the cloud nearest to this log time: seconds from the
/// start, or text as for `annotate`. assemble: put a whole turn together of several messages, as
/// for `annotate`. All else is as for `annotate`; with a `Frame` these are the parameters of the
/// method alone, and with a `Result`, which has its own, none.
pub fn figure<'py>(
    py: Python<'py>,
    cloud: &Bound<'py, PyAny>,
    out: Option<PathBuf>,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<Option<Bound<'py, PyBytes>>> {
    if let Some(asked) = given(parameters, "tracks")?
        && flag("tracks", &asked)?
    {
        return ways(cloud, out, parameters);
    }
    let (mut question, mut steps, mut by_decision) = (Question::default(), None, false);
    let options = FigureOptions { panels: Vec::new(), ..FigureOptions::default() };
    let mut look = Look { options, ..Look::default() };
    let own = [POINTS, OWN, OVER_TIME, &["tracks"]].concat();
    let made_of = cloud_run("figure", cloud, parameters, &own, &mut |name, value| match name {
        "a" => question.add("a", Some(value)),
        "b" => question.add("b", Some(value)),
        _ if POINTS.contains(&name) => question.set(name, value),
        _ if OVER_TIME.contains(&name) => Err(needs(name, "tracks=True")),
        "steps" => {
            steps = Some(path(name, value)?);
            Ok(())
        }
        "steps_by" => {
            by_decision = choice(name, value, &[("instance", false), ("decision", true)])?;
            Ok(())
        }
        _ => set_look(&mut look, name, value),
    })?;
    let form = target(out.as_deref(), &look)?;
    let bytes = match question.is_any() {
        true if steps.is_some() => return Err(wrong("steps", "not together with a, b, instances")),
        true => explained(py, &made_of, &question, (&look, form))?,
        false => drawn(py, &made_of, &look, form)?,
    };
    if let Some(folder) = steps {
        write_steps(py, &made_of, &look, (&folder, by_decision))?;
    }
    written(py, out, bytes, look.force)
}

/// The form of a figure, whose file is not there yet.
fn target(out: Option<&Path>, look: &Look) -> PyResult<Form> {
    let form = form(out, look.format)?;
    match out.filter(|out| !look.force && out.symlink_metadata().is_ok()) {
        Some(out) => Err(exists_already(out)),
        None => Ok(form),
    }
}

/// A figure as bytes, or None if it is written to a file.
fn written(
    py: Python<'_>,
    out: Option<PathBuf>,
    bytes: Vec<u8>,
    force: bool,
) -> PyResult<Option<Bound<'_, PyBytes>>> {
    let Some(out) = out else { return Ok(Some(PyBytes::new(py, &bytes))) };
    py.detach(|| write_file(&out, &bytes, force)).map_err(raised)?;
    Ok(None)
}

/// The ways of the objects of a drive.
fn ways<'py>(
    cloud: &Bound<'py, PyAny>,
    out: Option<PathBuf>,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<Option<Bound<'py, PyBytes>>> {
    const OWN: &[&str] = &["tracks", "theme", "dpi", "view", "format", "force"];
    let mut look = Look::default();
    let (drive, _) =
        followed("figure(tracks=True)", cloud, parameters, OWN, &mut |name, value| match name {
            "tracks" => Ok(()),
            _ => set_look(&mut look, name, value),
        })?;
    let form = target(out.as_deref(), &look)?;
    let FigureOptions { region, dpi, .. } = look.options;
    let page = view::track_figure(&drive, region, look.theme, dpi);
    written(cloud.py(), out, encoded(&page, form, dpi)?, look.force)
}

fn explained(
    py: Python<'_>,
    made_of: &CloudRun,
    question: &Question,
    (look, form): (&Look, Form),
) -> PyResult<Vec<u8>> {
    question.check()?;
    refuse_other_method(made_of)?;
    let page = made_of.look(py, |frame| {
        let (_, report) = report(question, &made_of.origin, frame)?;
        let scene = view::explained_scene(frame, &report);
        let scene = FrameScene { theme: look.theme, ..scene };
        let explanation = &report.explanation;
        Ok(view::explanation(&scene, explanation, &explanation.headline(), look.options.dpi))
    });
    encoded(&page.map_err(Problem::raised)?, form, look.options.dpi)
}

/// The form that is said, else that of the file's name, else PNG.
fn form(out: Option<&Path>, said: Option<Form>) -> PyResult<Form> {
    let (None, Some(out)) = (said, out) else { return Ok(said.unwrap_or(Form::Png)) };
    let ending = out.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    let known = FORMS.iter().find(|(name, _)| ending.as_deref() == Some(name));
    known.map(|&(_, form)| form).ok_or_else(|| {
        let problem = "must end in .png, .svg or .pdf, or say format";
        wrong("out", format!("{}: {problem}", out.display()))
    })
}

/// Sets one of the arguments about how a figure looks.
fn set_look(look: &mut Look, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let options = &mut look.options;
    match name {
        "format" => look.format = Some(choice(name, value, &FORMS)?),
        "theme" => {
            look.theme = choice(name, value, &[("dark", Theme::Dark), ("light", Theme::Light)])?;
        }
        "panels" => {
            let each = names(name, value)?.into_iter();
            options.panels = each.map(panel).collect::<PyResult<_>>()?;
        }
        "aspect" => options.aspect = between(name, value, [0.01, 10.0])?,
        "dpi" => options.dpi = between(name, value, [24.0, 1200.0])?,
        "window" => {
            let (columns, rows) = window(name, value)?;
            options.crop = PixelCrop { columns, rows };
        }
        "view" => options.region = Some(region(name, value)?),
        _ => look.force = flag(name, value)?,
    }
    Ok(())
}

fn panel(said: String) -> PyResult<Panel> {
    let found = Panel::NAMES.iter().find(|(name, _)| *name == said);
    found.map(|&(_, panel)| panel).ok_or_else(|| {
        let names = Panel::NAMES.map(|(name, _)| name);
        let near = did_you_mean(&said, &names);
        wrong("panels", format!("`{said}` is none of {}{near}", names.join(", ")))
    })
}

fn between(name: &str, value: &Bound<'_, PyAny>, [least, most]: [f64; 2]) -> PyResult<f64> {
    match number(name, value)? {
        number if (least..=most).contains(&number) => Ok(number),
        number => Err(wrong(name, format!("must be in {least}..={most}, got {number}"))),
    }
}

type Part = Option<std::ops::Range<usize>>;

fn window(name: &str, value: &Bound<'_, PyAny>) -> PyResult<(Part, Part)> {
    let problem = "expected ((first, end), (first, end)), columns and rows, None for all";
    type Said = Option<(usize, usize)>;
    let (columns, rows): (Said, Said) = value.extract().map_err(|_| wrong_type(name, problem))?;
    let part = |said: Said| said.map(|(first, end)| first..end);
    Ok((part(columns), part(rows)))
}

fn region(name: &str, value: &Bound<'_, PyAny>) -> PyResult<PlaneRegion> {
    let problem = "expected ((x, x), (y, y)) in metres";
    let (x, y): ([f64; 2], [f64; 2]) = value
        .extract::<((f64, f64), (f64, f64))>()
        .map(|(x, y)| (x.into(), y.into()))
        .map_err(|_| wrong_type(name, problem))?;
    let is_wide = |[low, high]: [f64; 2]| (1.0..=2000.0).contains(&(high - low));
    match is_wide(x) && is_wide(y) {
        true => Ok(PlaneRegion { x, y }),
        false => Err(wrong(name, "must be 1 m to 2 km wide along x and y")),
    }
}
