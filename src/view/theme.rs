//! What figures look like around their panels: a white page.

use super::canvas::{Anchor, Colour, TextStyle, opaque, rgb};
use super::font::Weight;

/// The page.
pub const PAGE: Colour = [255, 255, 255, 255];
/// Titles.
pub const INK: Colour = [24, 26, 30, 255];
/// All other text on the page.
pub const FAINT_INK: Colour = [98, 103, 112, 255];
/// Text on the page that no longer matters.
pub const PALE_INK: Colour = [176, 180, 188, 255];
/// The share of votes in favour in a table or matrix on the page.
pub const IN_FAVOUR: [u8; 3] = [120, 184, 240];

/// Colours of lines on the page: Okabe and Ito's that are dark enough, and some more.
const LINES: [u32; 12] = [
    0x0072b2, 0xd55e00, 0x009e73, 0xcc79a7, 0x6e6e6e, 0xb08300, 0x2d2d2d, 0x966edc, 0x008c96,
    0x961e3c, 0x5a6e1e, 0x3c3ca0,
];

/// Colour of a chart's line by its place.
pub fn line_colour(place: usize) -> Colour {
    opaque(rgb(LINES[place % LINES.len()]))
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

/// A heading, from its left end.
pub fn heading() -> TextStyle {
    text(HEADING, Weight::Medium, INK, Anchor::Start)
}

/// The title of a panel, from its left end.
pub fn title() -> TextStyle {
    text(TITLE, Weight::Medium, INK, Anchor::Start)
}

/// Small text of regular weight.
pub fn small(colour: Colour, anchor: Anchor) -> TextStyle {
    text(SMALL, Weight::Regular, colour, anchor)
}

/// Small text that should not be noticed first.
pub fn faint(anchor: Anchor) -> TextStyle {
    small(FAINT_INK, anchor)
}
