//! Legends: what the colours and lines of a panel mean.

use super::canvas::{Anchor, Area, Canvas, Colour, Raster, Stroke, opaque};
use super::font::{self, Weight};
use super::look::Look;
use super::theme;

/// A colour for each part of the way along a ramp.
pub type Ramp = fn(&Look, f64) -> [u8; 3];

/// An entry of a legend: a sign, and what it means.
#[derive(Debug, Clone)]
pub enum Key {
    /// A coloured square.
    Square(Colour, String),
    /// A line.
    Line(Stroke, String),
    /// A colour ramp with the words at its two ends.
    Ramp([String; 2], Ramp),
    /// Words alone.
    Words(String),
}

const GAP: f64 = 11.0;
const SIGN: f64 = 10.0;
const RAMP: f64 = 120.0;
const BESIDE_SIGN: f64 = 5.0;

impl Key {
    /// An unbroken line of a colour.
    pub fn line(colour: [u8; 3], words: String) -> Self {
        Key::Line(Stroke::solid(opaque(colour), 2.0), words)
    }

    /// A square of an opaque colour.
    pub fn square(colour: [u8; 3], words: impl Into<String>) -> Self {
        Key::Square(opaque(colour), words.into())
    }

    fn width(&self) -> f64 {
        match self {
            Key::Square(_, words) => SIGN + BESIDE_SIGN + words_width(words),
            Key::Line(_, words) => 2.0 * SIGN + BESIDE_SIGN + words_width(words),
            Key::Ramp([low, high], _) => {
                RAMP + 2.0 * BESIDE_SIGN + words_width(low) + words_width(high)
            }
            Key::Words(words) => words_width(words),
        }
    }

    fn draw(&self, canvas: &mut Canvas, x: f64, baseline: f64) {
        let style = theme::faint(Anchor::Start);
        let square = |x: f64, width: f64| Area { x, y: baseline - 9.0, width, height: SIGN };
        match self {
            Key::Square(colour, words) => {
                canvas.rect(square(x, SIGN), Some(*colour), None);
                canvas.text([x + SIGN + BESIDE_SIGN, baseline], words, style);
            }
            Key::Line(stroke, words) => {
                let (width, y) = (2.0 * SIGN, baseline - 4.0);
                let panel = opaque(canvas.look().panel);
                canvas.rect(square(x, width), Some(panel), None);
                canvas.line([x + 1.5, y], [x + width - 1.5, y], *stroke);
                canvas.text([x + width + BESIDE_SIGN, baseline], words, style);
            }
            Key::Ramp([low, high], ramp) => {
                canvas.text([x, baseline], low, style);
                let left = x + words_width(low) + BESIDE_SIGN;
                let look = canvas.look();
                let pixels = (0..256).map(|step| ramp(look, f64::from(step) / 255.0)).collect();
                canvas.picture(square(left, RAMP), Raster { width: 256, height: 1, pixels });
                canvas.text([left + RAMP + BESIDE_SIGN, baseline], high, style);
            }
            Key::Words(words) => canvas.text([x, baseline], words, style),
        }
    }
}

fn words_width(words: &str) -> f64 {
    font::width(words, theme::SMALL, Weight::Regular)
}

/// Width of a legend in one row.
pub fn width(keys: &[Key]) -> f64 {
    keys.iter().map(Key::width).sum::<f64>() + GAP * keys.len().saturating_sub(1) as f64
}

/// Draws a legend in one row from `left`.
pub fn draw(canvas: &mut Canvas, keys: &[Key], left: f64, baseline: f64) {
    let mut x = left;
    for key in keys {
        key.draw(canvas, x, baseline);
        x += key.width() + GAP;
    }
}
