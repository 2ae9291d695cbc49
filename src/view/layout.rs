//! The parts that all figures share: the page's measures, its heading, and captions of panels.

use super::canvas::{Anchor, Canvas};
use super::font::{self, Weight};
use super::legend::{self, Key};
use super::look::Theme;
use super::scene::FrameScene;
use super::theme;

/// Width of a figure in page units.
pub const WIDTH: f64 = 1000.0;
/// Width between the margins.
pub const INNER_WIDTH: f64 = WIDTH - 2.0 * MARGIN;
/// Margin of the page.
pub const MARGIN: f64 = 14.0;
/// Gap between panels.
pub const GAP: f64 = 12.0;
/// Height of the heading.
pub const HEADING_ROW: f64 = 26.0;
/// Height of a caption without a second row.
pub const TITLE_ROW: f64 = 21.0;
const LEGEND_ROW: f64 = 17.0;
/// From the top of a caption to its baseline.
const BASELINE: f64 = 14.0;
const LETTER: f64 = 19.0;
const BESIDE_TITLE: f64 = 7.0;

/// An empty page of the width of all figures.
pub fn page(theme: Theme) -> Canvas {
    Canvas { theme, ..Canvas::new(WIDTH, 0.0, theme::PAGE) }
}

/// Width of each of so many panels side by side.
pub fn slot_width(count: usize) -> f64 {
    (INNER_WIDTH - GAP * (count - 1) as f64) / count as f64
}

/// The scene's heading on the left, its remark on the right.
pub fn heading(canvas: &mut Canvas, scene: &FrameScene) {
    titled(canvas, &scene.heading, &scene.remark);
}

/// A heading on the left, a remark on the right.
pub fn titled(canvas: &mut Canvas, heading: &str, remark: &str) {
    let baseline = MARGIN + theme::HEADING;
    canvas.text([MARGIN, baseline], heading, theme::heading());
    let taken = font::width(heading, theme::HEADING, Weight::Medium);
    let room = INNER_WIDTH - taken - 20.0;
    let remark = font::fitted(remark, theme::SMALL, Weight::Regular, room);
    canvas.text([WIDTH - MARGIN, baseline], remark, theme::faint(Anchor::End));
}

/// Title, count and legend of a panel.
#[derive(Debug, Clone, Default)]
pub struct Caption {
    /// Place of the panel's letter in the alphabet, if it has one.
    pub letter: Option<usize>,
    /// What the panel shows.
    pub title: &'static str,
    /// Smaller text beside the title.
    pub count: String,
    /// The legend; entries at the end are left out where they do not fit.
    pub keys: Vec<Key>,
}

impl Caption {
    /// Height of the captions of a row of panels of that width.
    pub fn height(captions: &[Caption], width: f64) -> f64 {
        let is_high = captions.iter().any(|caption| !caption.fits(width));
        TITLE_ROW + if is_high { LEGEND_ROW } else { 0.0 }
    }

    /// Whether the legend has room beside the title.
    fn fits(&self, width: f64) -> bool {
        self.keys.is_empty() || self.words_width() + 24.0 + legend::width(&self.keys) <= width
    }

    fn words_width(&self) -> f64 {
        let count = font::width(&self.count, theme::SMALL, Weight::Regular);
        self.title_end() + BESIDE_TITLE + count
    }

    /// From the left edge to the end of the title.
    fn title_end(&self) -> f64 {
        let letter = if self.letter.is_some() { LETTER } else { 0.0 };
        letter + font::width(self.title, theme::TITLE, Weight::Medium)
    }

    /// Draws the caption from a place on the page; a legend without room goes below the title.
    pub fn draw(&self, canvas: &mut Canvas, [left, top]: [f64; 2], width: f64) {
        let baseline = top + BASELINE;
        let mut x = left;
        if let Some(place) = self.letter {
            let letter = char::from(b'a' + (place % 26) as u8);
            let faint = theme::FAINT_INK;
            let style = theme::text(theme::TITLE, Weight::Regular, faint, Anchor::Start);
            canvas.text([x, baseline], format!("({letter})"), style);
            x += LETTER;
        }
        canvas.text([x, baseline], self.title, theme::title());
        let x = left + self.title_end() + BESIDE_TITLE;
        let room = left + width - x;
        let count = font::fitted(&self.count, theme::SMALL, Weight::Regular, room);
        canvas.text([x, baseline], count, theme::faint(Anchor::Start));
        let prefixes = (0..=self.keys.len()).rev().map(|count| &self.keys[..count]);
        let mut fitting = prefixes.filter(|keys| legend::width(keys) <= width);
        let keys = fitting.next().unwrap_or_default();
        match self.fits(width) {
            true => legend::draw(canvas, keys, left + width - legend::width(keys), baseline),
            false => legend::draw(canvas, keys, left, baseline + LEGEND_ROW),
        }
    }
}
