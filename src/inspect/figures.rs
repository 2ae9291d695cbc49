//! Figures of what is seen.

use super::requests::{FigureForm, Outcome, Problem};
use super::run::Run;
use super::session::Session;
use super::why::{Question, explained};
use crate::view::{self, FigureOptions, Panel, PlaneRegion, Theme};

/// Dots per inch of a picture.
const DPI: f64 = 192.0;

/// A figure of a run, or of the explanation of a question: its type and its bytes.
///
/// # Errors
/// If the form has a wrong word, or a panel shows what the cloud does not have.
pub(super) fn figure(
    session: &Session,
    run: &Run,
    question: Option<&Question>,
    form: &FigureForm,
) -> Outcome<(&'static str, Vec<u8>)> {
    let mut scene = run.scene(session.start_ns, session.colours(run)?);
    scene.theme = if form.dark { Theme::Dark } else { Theme::Light };
    let page = match question {
        Some(question) => {
            let found = explained(session, run, question)?.explanation;
            view::explanation(&scene, &found, &found.headline(), DPI)
        }
        None => view::figure(&scene, &options(run, form)?)?,
    };
    let page = if form.dark { view::dark_page(page) } else { page };
    match form.format.as_str() {
        "svg" => Ok(("image/svg+xml", view::svg(&page).into_bytes())),
        "pdf" => Ok(("application/pdf", view::pdf(&page))),
        "png" => {
            let bytes = view::png(&page, DPI);
            Ok(("image/png", bytes.ok_or_else(|| Problem::wrong("the figure is too large"))?))
        }
        other => {
            Err(Problem::wrong(format!("`{other}` is no form of a figure: use svg, png or pdf")))
        }
    }
}

fn options(run: &Run, form: &FigureForm) -> Outcome<FigureOptions> {
    let named = |name: &String| {
        let found = Panel::NAMES.iter().find(|(known, _)| known == name);
        found.map(|&(_, panel)| panel).ok_or_else(|| Problem::wrong(format!("no panel `{name}`")))
    };
    let mut panels = form.panels.iter().map(named).collect::<Outcome<Vec<Panel>>>()?;
    if panels.is_empty() {
        panels = Panel::usual(&run.config.pipeline, &run.stages);
    }
    let region = form.view.map(|[x, y]| PlaneRegion { x, y });
    let fits = |[low, high]: [f64; 2]| (1.0..=2000.0).contains(&(high - low));
    let region = region.filter(|region| fits(region.x) && fits(region.y));
    Ok(FigureOptions { panels, region, dpi: DPI, ..FigureOptions::default() })
}
