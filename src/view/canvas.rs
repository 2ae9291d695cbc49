//! A page of simple shapes, the same for every output format.
//!
//! Lengths are page units, 96 to the inch; x to the right, y down, the origin at the upper left.

use super::font::Weight;

/// sRGB with opacity.
pub type Colour = [u8; 4];

/// An opaque colour.
pub const fn opaque([r, g, b]: [u8; 3]) -> Colour {
    [r, g, b, 255]
}

/// A colour part of the way from one to another: 0 the first, 1 the second.
pub fn between(from: [u8; 3], to: [u8; 3], part: f64) -> [u8; 3] {
    let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * part).round() as u8;
    [mix(from[0], to[0]), mix(from[1], to[1]), mix(from[2], to[2])]
}

/// A rectangle with its sides along the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// Left edge.
    pub x: f64,
    /// Upper edge.
    pub y: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

impl Area {
    /// Right edge.
    pub fn right(&self) -> f64 {
        self.x + self.width
    }

    /// Lower edge.
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

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Colour.
    pub colour: Colour,
    /// Width.
    pub width: f64,
    /// Length of dashes and of the gaps between them; `None` for an unbroken line.
    pub dash: Option<[f64; 2]>,
}

impl Stroke {
    /// An unbroken line.
    pub fn solid(colour: Colour, width: f64) -> Self {
        Stroke { colour, width, dash: None }
    }
}

/// Which point of a text its place names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The left end of the baseline.
    Start,
    /// The middle of the baseline.
    Middle,
    /// The right end of the baseline.
    End,
}

/// How a text is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextStyle {
    /// Size of the font.
    pub size: f64,
    /// Weight of the font.
    pub weight: Weight,
    /// Colour.
    pub colour: Colour,
    /// Which point of the text its place names.
    pub anchor: Anchor,
    /// Colour of a rim around the letters, for text over a picture.
    pub halo: Option<Colour>,
}

/// Pixels in rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Raster {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// width x height, opaque sRGB.
    pub pixels: Vec<[u8; 3]>,
}

impl Raster {
    /// All of one colour.
    pub fn filled(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Raster { width, height, pixels: vec![colour; width * height] }
    }
}

/// Something drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Straight lines from point to point, or the region they enclose.
    Path {
        /// The corners.
        points: Vec<[f64; 2]>,
        /// Whether the last is joined to the first.
        closed: bool,
        /// Colour of the inside.
        fill: Option<Colour>,
        /// The line itself.
        stroke: Option<Stroke>,
    },
    /// A disc.
    Circle {
        /// Its centre.
        centre: [f64; 2],
        /// Its radius.
        radius: f64,
        /// Colour of the inside.
        fill: Option<Colour>,
        /// The line around it.
        stroke: Option<Stroke>,
    },
    /// One line of text.
    Text {
        /// Where its anchor is.
        at: [f64; 2],
        /// The text.
        text: String,
        /// How it looks.
        style: TextStyle,
    },
    /// Pixels stretched over an area, without smoothing.
    Picture {
        /// Where.
        area: Area,
        /// The pixels.
        raster: Raster,
    },
    /// Shapes of which only what lies within an area is seen.
    Clip {
        /// The area.
        area: Area,
        /// The shapes.
        shapes: Vec<Shape>,
    },
}

/// A page.
#[derive(Debug, Clone, PartialEq)]
pub struct Canvas {
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
    /// Colour of the page.
    pub background: Colour,
    /// What is on it, the first at the bottom.
    pub shapes: Vec<Shape>,
}

impl Canvas {
    /// An empty page.
    pub fn new(width: f64, height: f64, background: Colour) -> Self {
        Canvas { width, height, background, shapes: Vec::new() }
    }

    /// A rectangle.
    pub fn rect(&mut self, area: Area, fill: Option<Colour>, stroke: Option<Stroke>) {
        let Area { x, y, .. } = area;
        let (right, bottom) = (area.right(), area.bottom());
        self.polygon(vec![[x, y], [right, y], [right, bottom], [x, bottom]], fill, stroke);
    }

    /// A closed path.
    pub fn polygon(&mut self, points: Vec<[f64; 2]>, fill: Option<Colour>, stroke: Option<Stroke>) {
        self.shapes.push(Shape::Path { points, closed: true, fill, stroke });
    }

    /// A straight line.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], stroke: Stroke) {
        let points = vec![from, to];
        self.shapes.push(Shape::Path { points, closed: false, fill: None, stroke: Some(stroke) });
    }

    /// A disc.
    pub fn circle(
        &mut self,
        centre: [f64; 2],
        radius: f64,
        fill: Option<Colour>,
        stroke: Option<Stroke>,
    ) {
        self.shapes.push(Shape::Circle { centre, radius, fill, stroke });
    }

    /// One line of text.
    pub fn text(&mut self, at: [f64; 2], text: impl Into<String>, style: TextStyle) {
        self.shapes.push(Shape::Text { at, text: text.into(), style });
    }

    /// Pixels stretched over an area.
    pub fn picture(&mut self, area: Area, raster: Raster) {
        self.shapes.push(Shape::Picture { area, raster });
    }

    /// Everything that `draw` puts on the page is seen within an area alone.
    pub fn clipped(&mut self, area: Area, draw: impl FnOnce(&mut Canvas)) {
        let below = std::mem::take(&mut self.shapes);
        draw(self);
        let shapes = std::mem::replace(&mut self.shapes, below);
        self.shapes.push(Shape::Clip { area, shapes });
    }
}
