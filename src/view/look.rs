//! What panels look like: dark, so that all colours stand out, or light, for print.

use super::font::Weight;
use super::ramp;
use super::style::{Anchor, Colour, TextStyle, between, rgb};
use super::theme;

/// Which panels the figures on the white page have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Theme {
    /// Dark panels, for the screen.
    #[default]
    Dark,
    /// Light panels, for print.
    Light,
}

impl Theme {
    pub(super) fn look(self) -> &'static Look {
        match self {
            Theme::Dark => &DARK,
            Theme::Light => &LIGHT,
        }
    }
}

/// The colours of panels.
#[derive(Debug)]
pub struct Look {
    /// An empty panel.
    pub panel: [u8; 3],
    /// A line around panels.
    pub frame: Option<Colour>,
    /// Text and lines on a panel.
    pub on_panel: Colour,
    /// Lines on a panel that should not be noticed first.
    pub guide: Colour,
    /// Returns that are not objects: the farthest and the nearest.
    pub other_returns: [[u8; 3]; 2],
    /// Objects in a mask without classes.
    pub object: [u8; 3],
    /// Components that the vote joined: blue.
    pub merged: [u8; 3],
    /// Components that the vote kept apart: vermilion.
    pub apart: [u8; 3],
    /// Components that the vote kept apart and a later step joined: violet, in the background.
    pub rejoined: [u8; 3],
    /// The focus of a step of the merge, and points that are explained.
    pub focus: [u8; 3],
    /// Components that the merge has not asked yet.
    pub waiting: [u8; 3],
    /// Nodes of the tree of merges that are no objects or parts of one.
    pub node: [u8; 3],
    /// By how much lines in the colour of an instance are darker than its points.
    darker: f64,
    /// The least and the greatest intensity.
    intensities: [u32; 2],
    classes: [u32; 8],
}

/// Dark panels.
pub static DARK: Look = Look {
    panel: [19, 21, 26],
    frame: None,
    on_panel: [232, 234, 238, 255],
    guide: [255, 255, 255, 34],
    other_returns: [[44, 48, 56], [104, 110, 120]],
    object: [240, 226, 178],
    merged: [104, 190, 255],
    apart: [255, 120, 64],
    rejoined: [150, 122, 214],
    focus: [255, 214, 64],
    waiting: [138, 144, 158],
    node: [206, 210, 218],
    darker: 0.0,
    // The least is lighter than a panel.
    intensities: [0x26282e, 0xffffff],
    // Okabe and Ito's, brighter.
    classes: [0x56b4e9, 0xf0e442, 0xe69f00, 0x00be8c, 0xcc97dc, 0xff785a, 0xa0dc6e, 0xebebf0],
};

/// Light panels.
pub static LIGHT: Look = Look {
    panel: [255, 255, 255],
    frame: Some([176, 180, 188, 255]),
    on_panel: [24, 26, 30, 255],
    guide: [0, 0, 0, 36],
    other_returns: [[232, 234, 238], [184, 189, 198]],
    object: [196, 140, 40],
    merged: [0, 114, 178],
    apart: [213, 94, 0],
    rejoined: [124, 92, 196],
    focus: [214, 0, 110],
    waiting: [150, 156, 168],
    node: [112, 118, 130],
    darker: 0.3,
    // The greatest is ink; the least is darker than a panel.
    intensities: [0xe6e8ec, 0x16181c],
    // The same hues, dark enough on white.
    classes: [0x2a8fd0, 0xd2b800, 0xd98200, 0x009e73, 0xb06cc6, 0xe8523a, 0x6fae36, 0x7a7a86],
};

impl Look {
    /// Colour of a class by its place among the things.
    pub fn class_colour(&self, place: usize) -> [u8; 3] {
        rgb(self.classes[place % self.classes.len()])
    }

    /// The colour of a line for an instance's colour.
    pub fn line_colour(&self, colour: [u8; 3]) -> [u8; 3] {
        between(colour, [0; 3], self.darker)
    }

    /// Colour of an intensity: 0 the least, 1 the greatest.
    pub fn intensity(&self, part: f64) -> [u8; 3] {
        ramp::between_stops(&self.intensities, part)
    }

    /// Text over a panel.
    pub fn label(&self, size: f64, colour: Colour, anchor: Anchor) -> TextStyle {
        let [r, g, b] = self.panel;
        let style = theme::text(size, Weight::Medium, colour, anchor);
        TextStyle { halo: Some([r, g, b, 215]), ..style }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::palette::{INSTANCE_COLOURS, instance_colour};

    /// Relative luminance of sRGB (WCAG 2.2).
    fn luminance(colour: [u8; 3]) -> f64 {
        let linear = |part: u8| {
            let part = f64::from(part) / 255.0;
            if part <= 0.04045 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) }
        };
        let [r, g, b] = colour.map(linear);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }

    fn contrast(a: [u8; 3], b: [u8; 3]) -> f64 {
        let [a, b] = [a, b].map(|colour| luminance(colour) + 0.05);
        (a / b).max(b / a)
    }

    #[test]
    fn signs_stand_out_from_their_panel() {
        for look in [&DARK, &LIGHT] {
            for colour in [look.object, look.merged, look.apart, look.rejoined, look.focus] {
                assert!(contrast(colour, look.panel) > 2.8, "{colour:?} on {:?}", look.panel);
            }
            for place in 0..look.classes.len() {
                assert!(contrast(look.class_colour(place), look.panel) > 1.9, "{place}");
            }
            for instance in 1..=INSTANCE_COLOURS as u32 {
                let line = look.line_colour(instance_colour(instance));
                assert!(contrast(line, look.panel) > 2.2, "{instance}: {line:?}");
            }
            let [far, near] = look.other_returns.map(|colour| contrast(colour, look.panel));
            assert!(near > far && far > 1.1, "{far} {near}");
        }
    }
}
