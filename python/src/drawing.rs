//! Figures of a cloud with its parameters.

use divmerge::Taxonomy;
use divmerge::diagnose::explain::ClusteredCloud;
use divmerge::view::{self, Canvas, ColourTracker, FigureOptions, FrameScene, Panel, Theme};
use pyo3::prelude::*;

use crate::cloud_run::{CloudRun, Origin};
use crate::errors::{raised, wrong};

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
