//! Figures of a cloud with its parameters.

use std::path::{Path, PathBuf};

use divmerge::diagnose::explain::ClusteredCloud;
use divmerge::recording::write_file;
use divmerge::view::{
    self, Canvas, ColourTracker, FigureOptions, FrameScene, Panel, StepPages, Theme,
};
use divmerge::{Error as LibraryError, Taxonomy};
use pyo3::prelude::*;

use crate::cloud_run::{CloudRun, Origin};
use crate::errors::{exists_already, raised, wrong};

/// The forms of figures.
#[derive(Debug, Clone, Copy)]
pub enum Form {
    /// Pixels.
    Png,
    /// For the web.
    Svg,
    /// For print.
    Pdf,
}

/// Their names.
pub const FORMS: [(&str, Form); 3] = [("png", Form::Png), ("svg", Form::Svg), ("pdf", Form::Pdf)];

/// How a figure looks.
#[derive(Default)]
pub struct Look {
    /// No panels: the usual ones.
    pub options: FigureOptions,
    /// Dark or light panels.
    pub theme: Theme,
    /// Its form, if it is said.
    pub format: Option<Form>,
    /// Whether a file may be replaced.
    pub force: bool,
}

/// The figure of a run as PNG.
pub fn usual_png(py: Python<'_>, made_of: &CloudRun, dpi: f64) -> PyResult<Vec<u8>> {
    let options = FigureOptions { panels: Vec::new(), dpi, ..FigureOptions::default() };
    drawn(py, made_of, &Look { options, ..Look::default() }, Form::Png)
}

/// The figure of a run.
pub fn drawn(py: Python<'_>, made_of: &CloudRun, look: &Look, form: Form) -> PyResult<Vec<u8>> {
    let origin = &*made_of.origin;
    let page = made_of.look(py, |frame| {
        let scene = scene(frame, origin);
        let scene = FrameScene { theme: look.theme, ..scene };
        let mut options = look.options.clone();
        if options.panels.is_empty() {
            options.panels = Panel::usual(frame.config, frame.stages);
        }
        view::figure(&scene, &options)
    });
    encoded(&page.map_err(raised)?, form, look.options.dpi)
}

/// Writes the pictures of a run's merge to a folder, by each instance or by each decision.
pub fn write_steps(
    py: Python<'_>,
    made_of: &CloudRun,
    look: &Look,
    (folder, by_decision): (&Path, bool),
) -> PyResult<()> {
    let origin = &*made_of.origin;
    made_of.look(py, |frame| {
        let scene = FrameScene { theme: look.theme, ..scene(frame, origin) };
        let pages = StepPages::new(&scene, &look.options, by_decision).map_err(raised)?;
        if by_decision && pages.are_of_objects() {
            let problem = "`decision` draws merges by votes; these objects were cut from a tree";
            return Err(wrong("steps_by", problem));
        }
        let names = (1..=pages.count()).map(|number| folder.join(StepPages::name(number)));
        let there = |file: &PathBuf| !look.force && file.symlink_metadata().is_ok();
        if let Some(there) = names.into_iter().find(there) {
            return Err(exists_already(&there));
        }
        let problem = |source| LibraryError::Io { path: folder.to_owned(), source };
        std::fs::create_dir_all(folder).map_err(|source| raised(problem(source)))?;
        pages.pages().try_for_each(|(name, page)| {
            let picture = encoded(&page, Form::Png, look.options.dpi)?;
            write_file(&folder.join(name), &picture, look.force).map_err(raised)
        })
    })
}

/// A run as it is drawn, with the headings of the command's figure.
fn scene<'a>(frame: &ClusteredCloud<'a>, origin: &'a Origin) -> FrameScene<'a> {
    let ClusteredCloud { cloud, config, stages, .. } = *frame;
    let Origin { message, start_ns, semantics, intensity, .. } = origin;
    let seconds = message.log_time_ns().saturating_sub(*start_ns) as f64 * 1e-9;
    let run = view::describe_run(stages, semantics, config);
    let is_recorded = !message.topic.is_empty();
    FrameScene {
        cloud,
        stages,
        classes: frame.mask.taxonomy().map_or(&[], Taxonomy::classes),
        intensity: intensity.as_deref(),
        merge_ratio: config.cluster.merge_ratio,
        colour_numbers: ColourTracker::default().colour_numbers(&stages.instances),
        heading: match is_recorded {
            true => format!("{}  ·  {seconds:.3} s", message.frames()),
            false => format!("{} points", cloud.len()),
        },
        remark: match is_recorded {
            true => format!("{}  ·  {run}", message.topic),
            false => run,
        },
        theme: Theme::default(),
    }
}

/// A figure in a form.
pub fn encoded(page: &Canvas, form: Form, dpi: f64) -> PyResult<Vec<u8>> {
    match form {
        Form::Svg => Ok(view::svg(page).into_bytes()),
        Form::Pdf => Ok(view::pdf(page)),
        Form::Png => view::png(page, dpi).ok_or_else(|| {
            let [width, height] = view::size_in_pixels(page, dpi);
            wrong("dpi", format!("a picture of {width} x {height} pixels is too large"))
        }),
    }
}
