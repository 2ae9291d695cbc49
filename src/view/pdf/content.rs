//! The operations that draw a page.

use std::collections::{BTreeMap, BTreeSet};

use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content as Operations, Name, Str};

use crate::view::canvas::{Area, Canvas, Colour, Drawing, Raster, Stroke, TextStyle};
use crate::view::font::{self, Weight};
use crate::view::visible::{Polyline, Visible};

/// Points, 72 to the inch, to the page unit.
pub const POINTS_PER_UNIT: f64 = 0.75;

/// The letters of a page by weight: the number in the font, and the character.
pub type Glyphs = BTreeMap<Weight, BTreeMap<u16, char>>;

/// What a page's operations are, and what they name.
pub struct Content<'a> {
    pub operations: Vec<u8>,
    pub glyphs: Glyphs,
    pub pictures: Vec<(Area, &'a Raster)>,
    pub opacities: BTreeSet<u8>,
}

pub fn font_name(weight: Weight) -> Name<'static> {
    match weight {
        Weight::Regular => Name(b"Regular"),
        Weight::Medium => Name(b"Medium"),
    }
}

pub fn picture_name(number: usize) -> String {
    format!("P{number}")
}

pub fn opacity_name(alpha: u8) -> String {
    format!("A{alpha}")
}

impl<'a> Content<'a> {
    /// Draws a page.
    pub fn of(canvas: &'a Canvas) -> Self {
        let mut pen = Pen {
            operations: Operations::new(),
            visible: canvas.visible(),
            alpha: None,
            glyphs: Glyphs::new(),
            pictures: Vec::new(),
            opacities: BTreeSet::new(),
        };
        let unit = POINTS_PER_UNIT as f32;
        // Page units with y down, as on the canvas.
        let up = (canvas.height * POINTS_PER_UNIT) as f32;
        pen.operations.transform([unit, 0.0, 0.0, -unit, 0.0, up]);
        pen.operations.set_line_join(LineJoinStyle::RoundJoin);
        let page = Area { x: 0.0, y: 0.0, width: canvas.width, height: canvas.height };
        pen.fill_with(canvas.background);
        pen.rect(&page);
        pen.operations.fill_nonzero();
        pen.shapes(&canvas.shapes);
        let Pen { operations, glyphs, pictures, opacities, .. } = pen;
        Content { operations: operations.finish().to_vec(), glyphs, pictures, opacities }
    }
}

struct Pen<'a> {
    operations: Operations,
    visible: Visible,
    /// The opacity that is set.
    alpha: Option<u8>,
    glyphs: Glyphs,
    pictures: Vec<(Area, &'a Raster)>,
    opacities: BTreeSet<u8>,
}

impl<'a> Pen<'a> {
    fn shapes(&mut self, shapes: &'a [Drawing]) {
        for shape in shapes {
            match shape {
                Drawing::Path { points, closed, fill, stroke } => {
                    let parts = self.visible.path(points, *closed);
                    self.painted(*fill, *stroke, |pen| pen.polylines(&parts));
                }
                Drawing::Circle { centre, radius, fill, stroke } => {
                    match self.visible.circle(*centre, *radius) {
                        Some(parts) => self.painted(*fill, *stroke, |pen| pen.polylines(&parts)),
                        None => self.painted(*fill, *stroke, |pen| pen.circle(*centre, *radius)),
                    }
                }
                Drawing::Text { at, .. } if !self.visible.holds(*at) => {}
                Drawing::Text { at, text, style } => self.text(*at, text, style),
                Drawing::Picture { area, raster } => self.picture(*area, raster),
                Drawing::Clip { area, shapes } => {
                    let alpha = self.alpha;
                    self.operations.save_state();
                    self.rect(area);
                    self.operations.clip_nonzero().end_path();
                    self.shapes(shapes);
                    self.operations.restore_state();
                    self.alpha = alpha;
                }
            }
        }
    }

    /// Fills and strokes a path.
    fn painted(
        &mut self,
        fill: Option<Colour>,
        stroke: Option<Stroke>,
        path: impl Fn(&mut Pen<'a>),
    ) {
        if let Some(colour) = fill {
            self.fill_with(colour);
            path(self);
            self.operations.fill_nonzero();
        }
        if let Some(stroke) = stroke {
            self.stroke_with(stroke);
            path(self);
            self.operations.stroke();
        }
    }

    fn fill_with(&mut self, colour: Colour) {
        let [r, g, b] = self.opaque(colour);
        self.operations.set_fill_rgb(r, g, b);
    }

    fn stroke_with(&mut self, stroke: Stroke) {
        let [r, g, b] = self.opaque(stroke.colour);
        self.operations.set_stroke_rgb(r, g, b).set_line_width(number(stroke.width));
        let (cap, dash) = match stroke.dash {
            Some(dash) => (LineCapStyle::ButtCap, dash.map(number).to_vec()),
            None => (LineCapStyle::RoundCap, Vec::new()),
        };
        self.operations.set_line_cap(cap).set_dash_pattern(dash, 0.0);
    }

    /// Sets the opacity of a colour and returns the rest of it.
    fn opaque(&mut self, [r, g, b, alpha]: Colour) -> [f32; 3] {
        if self.alpha != Some(alpha) {
            self.alpha = Some(alpha);
            self.opacities.insert(alpha);
            self.operations.set_parameters(Name(opacity_name(alpha).as_bytes()));
        }
        [r, g, b].map(|part| number(f64::from(part) / 255.0))
    }

    fn rect(&mut self, area: &Area) {
        let [x, y, width, height] = [area.x, area.y, area.width, area.height].map(number);
        self.operations.rect(x, y, width, height);
    }

    fn polylines(&mut self, parts: &[Polyline]) {
        for Polyline { points, closed } in parts {
            for (place, point) in points.iter().enumerate() {
                let [x, y] = point.map(number);
                match place {
                    0 => self.operations.move_to(x, y),
                    _ => self.operations.line_to(x, y),
                };
            }
            if *closed {
                self.operations.close_path();
            }
        }
    }

    /// Four curves.
    fn circle(&mut self, [x, y]: [f64; 2], radius: f64) {
        /// Where the inner points of the curve of a quarter lie, so that it passes through the
        /// middle of the arc.
        const ALONG: f64 = 0.552_284_75;
        let place = |across: f64, down: f64| [x + across * radius, y + down * radius].map(number);
        let [left, top] = place(1.0, 0.0);
        self.operations.move_to(left, top);
        for [ax, ay] in [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]] {
            let [bx, by] = [-ay, ax];
            let [x1, y1] = place(ax + ALONG * bx, ay + ALONG * by);
            let [x2, y2] = place(bx + ALONG * ax, by + ALONG * ay);
            let [x3, y3] = place(bx, by);
            self.operations.cubic_to(x1, y1, x2, y2, x3, y3);
        }
        self.operations.close_path();
    }

    /// Text over its rim. The rim is of outlines, so that the words are in the file once.
    fn text(&mut self, at: [f64; 2], text: &str, style: &TextStyle) {
        let x = style.left_end(at[0], text);
        if let Some(halo) = style.halo {
            self.stroke_with(Stroke::solid(halo, style.size * font::RIM));
            let unit = style.size / font::UNITS_PER_EM;
            let operations = &mut self.operations;
            let mut letters = Letters { operations, corner: [x, at[1]], unit, last: [0.0; 2] };
            font::outlines(text, style.weight, &mut letters);
            self.operations.stroke();
        }
        self.fill_with(style.colour);
        let used = self.glyphs.entry(style.weight).or_default();
        let mut bytes = Vec::new();
        for (glyph, character) in font::glyphs(text, style.weight) {
            used.insert(glyph, if glyph == 0 { '\u{fffd}' } else { character });
            bytes.extend(glyph.to_be_bytes());
        }
        self.operations
            .begin_text()
            .set_font(font_name(style.weight), number(style.size))
            .set_text_matrix([1.0, 0.0, 0.0, -1.0, number(x), number(at[1])])
            .show(Str(&bytes))
            .end_text();
    }

    fn picture(&mut self, area: Area, raster: &'a Raster) {
        if raster.width == 0 || raster.height == 0 {
            return;
        }
        let name = picture_name(self.pictures.len());
        self.pictures.push((area, raster));
        let [x, width, height, bottom] =
            [area.x, area.width, area.height, area.bottom()].map(number);
        self.operations.save_state();
        self.operations.transform([width, 0.0, 0.0, -height, x, bottom]);
        self.operations.x_object(Name(name.as_bytes())).restore_state();
    }
}

/// A number with three decimals at most.
fn number(value: f64) -> f32 {
    ((value * 1000.0).round() / 1000.0) as f32
}

/// Turns outlines in font units, y up, into a path on the page.
struct Letters<'a> {
    operations: &'a mut Operations,
    corner: [f64; 2],
    unit: f64,
    /// Where the last line ended, font units.
    last: [f32; 2],
}

impl Letters<'_> {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        let [left, base] = self.corner;
        (number(left + f64::from(x) * self.unit), number(base - f64::from(y) * self.unit))
    }
}

impl ttf_parser::OutlineBuilder for Letters<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        let (on_x, on_y) = self.at(x, y);
        self.operations.move_to(on_x, on_y);
        self.last = [x, y];
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (on_x, on_y) = self.at(x, y);
        self.operations.line_to(on_x, on_y);
        self.last = [x, y];
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        // The same curve of the third degree.
        let toward = |from: f32, to: f32| from + (to - from) * 2.0 / 3.0;
        let [from_x, from_y] = self.last;
        self.curve_to(toward(from_x, x1), toward(from_y, y1), toward(x, x1), toward(y, y1), x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let [(x1, y1), (x2, y2), (on_x, on_y)] = [self.at(x1, y1), self.at(x2, y2), self.at(x, y)];
        self.operations.cubic_to(x1, y1, x2, y2, on_x, on_y);
        self.last = [x, y];
    }

    fn close(&mut self) {
        self.operations.close_path();
    }
}
