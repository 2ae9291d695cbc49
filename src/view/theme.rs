//! What figures look like: a white page, and dark panels on which the palette's colours stand out.

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
/// An empty panel.
pub const PANEL: [u8; 3] = [19, 21, 26];
/// Text and lines on a panel.
pub const ON_PANEL: Colour = [232, 234, 238, 255];
/// Lines on a panel that should not be noticed first.
pub const GUIDE: Colour = [255, 255, 255, 34];
/// Returns that are not objects: the farthest and the nearest.
pub const OTHER_RETURNS: [[u8; 3]; 2] = [[44, 48, 56], [104, 110, 120]];
/// Objects in a mask without classes.
pub const OBJECT: [u8; 3] = [240, 226, 178];
/// Components that the vote joined: blue.
pub const MERGED: [u8; 3] = [104, 190, 255];
/// Components that the vote kept apart: vermilion.
pub const APART: [u8; 3] = [255, 120, 64];
/// Components that the vote kept apart and a later step joined: violet, in the background.
pub const REJOINED: [u8; 3] = [150, 122, 214];
/// The focus of a step of the merge, and points that are explained.
pub const FOCUS: [u8; 3] = [255, 214, 64];
/// The share of votes in favour in a table or matrix on the page.
pub const IN_FAVOUR: [u8; 3] = [120, 184, 240];

/// Colours of classes on a panel: Okabe and Ito's, brighter.
const CLASSES: [u32; 8] =
    [0x56b4e9, 0xf0e442, 0xe69f00, 0x00be8c, 0xcc97dc, 0xff785a, 0xa0dc6e, 0xebebf0];

/// Colours of lines on the page: Okabe and Ito's that are dark enough, and some more.
const LINES: [u32; 12] = [
    0x0072b2, 0xd55e00, 0x009e73, 0xcc79a7, 0x6e6e6e, 0xb08300, 0x2d2d2d, 0x966edc, 0x008c96,
    0x961e3c, 0x5a6e1e, 0x3c3ca0,
];

/// Colour of a class by its place among the things.
pub fn class_colour(place: usize) -> [u8; 3] {
    rgb(CLASSES[place % CLASSES.len()])
}

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

/// Text over a panel.
pub fn label(size: f64, colour: Colour, anchor: Anchor) -> TextStyle {
    let [r, g, b] = PANEL;
    TextStyle { halo: Some([r, g, b, 215]), ..text(size, Weight::Medium, colour, anchor) }
}
