//! Colours, and how lines and text are drawn.

use super::font::{self, Weight};

/// sRGB with opacity.
pub type Colour = [u8; 4];

pub const fn opaque([r, g, b]: [u8; 3]) -> Colour {
    [r, g, b, 255]
}

/// The colour of a hexadecimal number, as in `0xff8000`.
pub const fn rgb(hex: u32) -> [u8; 3] {
    let [_, r, g, b] = hex.to_be_bytes();
    [r, g, b]
}

/// A colour part of the way from one to another: 0 the first, 1 the second.
pub fn between(from: [u8; 3], to: [u8; 3], part: f64) -> [u8; 3] {
    let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * part).round() as u8;
    [mix(from[0], to[0]), mix(from[1], to[1]), mix(from[2], to[2])]
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    pub colour: Colour,
    pub width: f64,
    /// Length of dashes and of the gaps between them; `None` for an unbroken line.
    pub dash: Option<[f64; 2]>,
}

impl Stroke {
    pub fn solid(colour: Colour, width: f64) -> Self {
        Stroke { colour, width, dash: None }
    }
}

/// The point of a text's baseline at its place: the left end, the middle or the right end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// How a text is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextStyle {
    pub size: f64,
    pub weight: Weight,
    pub colour: Colour,
    pub anchor: Anchor,
    /// Colour of a rim around the letters, for text over a picture.
    pub halo: Option<Colour>,
}

impl TextStyle {
    /// The left end of a text whose anchor is at `x`.
    pub fn left_end(&self, x: f64, text: &str) -> f64 {
        let width = font::width(text, self.size, self.weight);
        match self.anchor {
            Anchor::Start => x,
            Anchor::Middle => x - width / 2.0,
            Anchor::End => x - width,
        }
    }
}
