//! What figures look like: a white page, dark panels on which the palette's colours stand out.

use super::canvas::{Anchor, Canvas, Colour, Stroke, TextStyle, opaque};
use super::font::Weight;

/// The page.
pub const PAGE: Colour = [255, 255, 255, 255];
/// Titles.
pub const INK: Colour = [24, 26, 30, 255];
/// Everything that is said beside.
pub const FAINT_INK: Colour = [98, 103, 112, 255];
/// A panel where there is nothing.
pub const PANEL: [u8; 3] = [19, 21, 26];
/// Text and lines on a panel.
pub const ON_PANEL: Colour = [232, 234, 238, 255];
/// Lines on a panel that should not be noticed first.
pub const GUIDE: Colour = [255, 255, 255, 34];
/// Returns that are no objects: the farthest and the nearest.
pub const OTHER_RETURNS: [[u8; 3]; 2] = [[44, 48, 56], [104, 110, 120]];
/// Objects where there are no classes.
pub const OBJECT: [u8; 3] = [240, 226, 178];
/// Components that the vote joined: blue.
pub const MERGED: Colour = [104, 190, 255, 255];
/// Components that the vote kept apart: vermilion.
pub const APART: Colour = [255, 120, 64, 255];
/// Components that the vote kept apart and a later step put together: violet, in the background.
pub const REJOINED: Colour = [150, 122, 214, 150];
/// What is looked at in a step of the merge.
pub const FOCUS: Colour = [255, 214, 64, 255];

/// Colours of classes on a panel, by the class's place among the things: Okabe and Ito's, brighter.
const CLASSES: [[u8; 3]; 8] = [
    [86, 180, 233],
    [240, 228, 66],
    [230, 159, 0],
    [0, 190, 140],
    [204, 151, 220],
    [255, 120, 90],
    [160, 220, 110],
    [235, 235, 240],
];

/// Colour of the class at a place among the things.
pub fn class_colour(place: usize) -> [u8; 3] {
    CLASSES[place % CLASSES.len()]
}

/// Size of a heading.
pub const HEADING: f64 = 15.0;
/// Size of a panel's title.
pub const TITLE: f64 = 12.5;
/// Size of all other text.
pub const SMALL: f64 = 11.0;

/// Text on the page.
pub fn text(size: f64, weight: Weight, colour: Colour, anchor: Anchor) -> TextStyle {
    TextStyle { size, weight, colour, anchor, halo: None }
}

/// Text over a panel.
pub fn label(size: f64, colour: Colour, anchor: Anchor) -> TextStyle {
    let mut halo = opaque(PANEL);
    halo[3] = 215;
    TextStyle { size, weight: Weight::Medium, colour, anchor, halo: Some(halo) }
}

/// A line of a legend's kind: what it looks like, and what that means.
#[derive(Debug, Clone)]
pub enum Key {
    /// A coloured square.
    Square(Colour, String),
    /// A line.
    Line(Stroke, String),
    /// A colour ramp with the words at its two ends.
    Ramp([String; 2], fn(f64) -> [u8; 3]),
    /// Words alone.
    Words(String),
}

const GAP: f64 = 14.0;
const SIGN: f64 = 10.0;
const RAMP: f64 = 120.0;
const BESIDE_SIGN: f64 = 5.0;

fn words_width(words: &str) -> f64 {
    super::font::width(words, SMALL, Weight::Regular)
}

fn key_width(key: &Key) -> f64 {
    match key {
        Key::Square(_, words) => SIGN + BESIDE_SIGN + words_width(words),
        Key::Line(_, words) => 2.0 * SIGN + BESIDE_SIGN + words_width(words),
        Key::Ramp([low, high], _) => {
            RAMP + 2.0 * BESIDE_SIGN + words_width(low) + words_width(high)
        }
        Key::Words(words) => words_width(words),
    }
}

/// Width of a legend in one row.
pub fn legend_width(keys: &[Key]) -> f64 {
    keys.iter().map(key_width).sum::<f64>() + GAP * keys.len().saturating_sub(1) as f64
}

/// Draws a legend in one row that ends at `right`.
pub fn legend(canvas: &mut Canvas, keys: &[Key], right: f64, baseline: f64) {
    let mut x = right - legend_width(keys);
    for key in keys {
        draw_key(canvas, key, x, baseline);
        x += key_width(key) + GAP;
    }
}

fn draw_key(canvas: &mut Canvas, key: &Key, x: f64, baseline: f64) {
    use super::canvas::{Area, Raster};
    let style = text(SMALL, Weight::Regular, FAINT_INK, Anchor::Start);
    let square = |x: f64, width: f64| Area { x, y: baseline - 9.0, width, height: SIGN };
    match key {
        Key::Square(colour, words) => {
            canvas.rect(square(x, SIGN), Some(*colour), None);
            canvas.text([x + SIGN + BESIDE_SIGN, baseline], words, style);
        }
        Key::Line(stroke, words) => {
            let (width, y) = (2.0 * SIGN, baseline - 4.0);
            canvas.rect(square(x, width), Some(opaque(PANEL)), None);
            canvas.line([x + 1.5, y], [x + width - 1.5, y], *stroke);
            canvas.text([x + width + BESIDE_SIGN, baseline], words, style);
        }
        Key::Ramp([low, high], ramp) => {
            canvas.text([x, baseline], low, style);
            let left = x + words_width(low) + BESIDE_SIGN;
            let mut raster = Raster::filled(256, 1, PANEL);
            for (i, pixel) in raster.pixels.iter_mut().enumerate() {
                *pixel = ramp(i as f64 / 255.0);
            }
            canvas.picture(square(left, RAMP), raster);
            canvas.text([left + RAMP + BESIDE_SIGN, baseline], high, style);
        }
        Key::Words(words) => canvas.text([x, baseline], words, style),
    }
}
