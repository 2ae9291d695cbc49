//! A page of simple shapes, the same for every output format.
//!
//! Lengths are page units, 96 to the inch; x to the right, y down, the origin at the upper left.

use super::look::{Look, Theme};
use super::visible::Visible;

pub use super::style::{Anchor, Colour, Stroke, TextStyle, between, opaque};

/// A rectangle with its sides along the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    pub x: f64,
    pub y: f64,
    pub width: f64,
    pub height: f64,
}

impl Area {
    pub fn right(&self) -> f64 {
        self.x + self.width
    }

    pub fn bottom(&self) -> f64 {
        self.y + self.height
    }

    /// Whether two areas share a point.
    pub fn meets(&self, other: &Area) -> bool {
        self.x < other.right()
            && other.x < self.right()
            && self.y < other.bottom()
            && other.y < self.bottom()
    }

    /// Whether the other area lies inside.
    pub fn holds(&self, other: &Area) -> bool {
        other.x >= self.x
            && other.y >= self.y
            && other.right() <= self.right()
            && other.bottom() <= self.bottom()
    }
}

/// Pixels in rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Raster {
    pub width: usize,
    pub height: usize,
    /// width x height, opaque sRGB.
    pub pixels: Vec<[u8; 3]>,
}

impl Raster {
    pub fn filled(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Raster { width, height, pixels: vec![colour; width * height] }
    }

    /// Fills a square from its upper left pixel on, as far as it lies within.
    pub fn fill_square(&mut self, [left, top]: [usize; 2], side: usize, colour: [u8; 3]) {
        for y in top..top.saturating_add(side).min(self.height) {
            for x in left..left.saturating_add(side).min(self.width) {
                self.pixels[y * self.width + x] = colour;
            }
        }
    }
}

/// Something drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Drawing {
    /// Straight lines from point to point, or the region they enclose.
    Path {
        points: Vec<[f64; 2]>,
        closed: bool,
        fill: Option<Colour>,
        stroke: Option<Stroke>,
    },
    Circle {
        centre: [f64; 2],
        radius: f64,
        fill: Option<Colour>,
        stroke: Option<Stroke>,
    },
    Text {
        at: [f64; 2],
        text: String,
        style: TextStyle,
    },
    /// Pixels stretched over an area, without smoothing.
    Picture {
        area: Area,
        raster: Raster,
    },
    /// Shapes of which only what lies within an area is seen.
    Clip {
        area: Area,
        shapes: Vec<Drawing>,
    },
}

/// A page.
#[derive(Debug, Clone, PartialEq)]
pub struct Canvas {
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) background: Colour,
    /// Which panels are on it.
    pub(super) theme: Theme,
    /// What is on it, the first at the bottom.
    pub(super) shapes: Vec<Drawing>,
}

impl Canvas {
    /// An empty page.
    pub(super) fn new(width: f64, height: f64, background: Colour) -> Self {
        Canvas { width, height, background, theme: Theme::default(), shapes: Vec::new() }
    }

    /// The colours of its panels.
    pub(super) fn look(&self) -> &'static Look {
        self.theme.look()
    }

    /// The first text on it.
    pub(super) fn heading(&self) -> Option<&str> {
        self.shapes.iter().find_map(|shape| match shape {
            Drawing::Text { text, .. } => Some(text.as_str()),
            _ => None,
        })
    }

    /// What of its shapes is seen.
    pub(super) fn visible(&self) -> Visible {
        Visible::of_page(self.width, self.height)
    }

    pub(super) fn rect(&mut self, area: Area, fill: Option<Colour>, stroke: Option<Stroke>) {
        let Area { x, y, .. } = area;
        let (right, bottom) = (area.right(), area.bottom());
        self.polygon(vec![[x, y], [right, y], [right, bottom], [x, bottom]], fill, stroke);
    }

    pub(super) fn polygon(
        &mut self,
        points: Vec<[f64; 2]>,
        fill: Option<Colour>,
        stroke: Option<Stroke>,
    ) {
        self.shapes.push(Drawing::Path { points, closed: true, fill, stroke });
    }

    pub(super) fn line(&mut self, from: [f64; 2], to: [f64; 2], stroke: Stroke) {
        self.polyline(vec![from, to], stroke);
    }

    /// Straight lines from point to point.
    pub(super) fn polyline(&mut self, points: Vec<[f64; 2]>, stroke: Stroke) {
        self.shapes.push(Drawing::Path { points, closed: false, fill: None, stroke: Some(stroke) });
    }

    pub(super) fn circle(
        &mut self,
        centre: [f64; 2],
        radius: f64,
        fill: Option<Colour>,
        stroke: Option<Stroke>,
    ) {
        self.shapes.push(Drawing::Circle { centre, radius, fill, stroke });
    }

    pub(super) fn text(&mut self, at: [f64; 2], text: impl Into<String>, style: TextStyle) {
        self.shapes.push(Drawing::Text { at, text: text.into(), style });
    }

    /// Pixels stretched over an area.
    pub(super) fn picture(&mut self, area: Area, raster: Raster) {
        self.shapes.push(Drawing::Picture { area, raster });
    }

    /// Clips to an area what `draw` draws.
    pub(super) fn clipped(&mut self, area: Area, draw: impl FnOnce(&mut Canvas)) {
        let below = std::mem::take(&mut self.shapes);
        draw(self);
        let shapes = std::mem::replace(&mut self.shapes, below);
        self.shapes.push(Drawing::Clip { area, shapes });
    }
}
