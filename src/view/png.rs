//! A page as PNG.

use tiny_skia::{
    FillRule, FilterQuality, LineCap, LineJoin, Mask, Paint, Path, PathBuilder, Pixmap,
    PixmapPaint, Rect, StrokeDash, Transform,
};

use super::canvas::{Area, Canvas, Colour, Drawing, Raster, Stroke, TextStyle};
use super::font;
use super::visible::{Polyline, Visible};

/// Page units to the inch.
const UNITS_PER_INCH: f64 = 96.0;
const METRES_PER_INCH: f64 = 0.0254;

/// Size in pixels of a page at a resolution.
pub fn size_in_pixels(canvas: &Canvas, dpi: f64) -> [u32; 2] {
    let pixels = |length: f64| (length * dpi / UNITS_PER_INCH).round().max(1.0) as u32;
    [pixels(canvas.width), pixels(canvas.height)]
}

/// Draws a page at a resolution in dots per inch. `None` if it would not fit into memory.
pub fn png(canvas: &Canvas, dpi: f64) -> Option<Vec<u8>> {
    let [width, height] = size_in_pixels(canvas, dpi);
    let mut pixmap = Pixmap::new(width, height)?;
    let [r, g, b, _] = canvas.background;
    pixmap.fill(tiny_skia::Color::from_rgba8(r, g, b, 255));
    let scale = (dpi / UNITS_PER_INCH) as f32;
    let transform = Transform::from_scale(scale, scale);
    let mut brush = Brush { pixmap, transform, mask: None, visible: canvas.visible() };
    brush.shapes(&canvas.shapes);
    let rgb: Vec<u8> =
        brush.pixmap.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    encode(width, height, &rgb, Some(dpi))
}

/// Pixels as PNG.
pub fn raster_png(raster: &Raster) -> Option<Vec<u8>> {
    encode(raster.width as u32, raster.height as u32, raster.pixels.as_flattened(), None)
}

fn encode(width: u32, height: u32, rgb: &[u8], dpi: Option<f64>) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    if let Some(dpi) = dpi {
        let per_metre = (dpi / METRES_PER_INCH).round() as u32;
        let unit = png::Unit::Meter;
        encoder.set_pixel_dims(Some(png::PixelDimensions {
            xppu: per_metre,
            yppu: per_metre,
            unit,
        }));
    }
    let mut writer = encoder.write_header().ok()?;
    writer.write_image_data(rgb).ok()?;
    writer.finish().ok()?;
    Some(bytes)
}

struct Brush {
    pixmap: Pixmap,
    transform: Transform,
    mask: Option<Mask>,
    visible: Visible,
}

impl Brush {
    fn shapes(&mut self, shapes: &[Drawing]) {
        for shape in shapes {
            match shape {
                Drawing::Path { points, closed, fill, stroke } => {
                    self.polylines(&self.visible.path(points, *closed), *fill, *stroke);
                }
                Drawing::Circle { centre, radius, fill, stroke } => {
                    if let Some(parts) = self.visible.circle(*centre, *radius) {
                        self.polylines(&parts, *fill, *stroke);
                        continue;
                    }
                    let [x, y] = centre.map(|c| c as f32);
                    if let Some(path) = PathBuilder::from_circle(x, y, *radius as f32) {
                        self.path(&path, *fill, *stroke);
                    }
                }
                Drawing::Text { at, .. } if !self.visible.holds(*at) => {}
                Drawing::Text { at, text, style } => self.text(*at, text, style),
                Drawing::Picture { area, raster } => self.picture(area, raster),
                Drawing::Clip { area, shapes } => {
                    let outer = self.mask.take();
                    self.mask = self.mask_of(area);
                    self.shapes(shapes);
                    self.mask = outer;
                }
            }
        }
    }

    fn mask_of(&self, area: &Area) -> Option<Mask> {
        let mut mask = Mask::new(self.pixmap.width(), self.pixmap.height())?;
        let path = PathBuilder::from_rect(rect(area)?);
        mask.fill_path(&path, FillRule::Winding, false, self.transform);
        Some(mask)
    }

    fn polylines(&mut self, parts: &[Polyline], fill: Option<Colour>, stroke: Option<Stroke>) {
        for part in parts {
            if let Some(path) = polyline(&part.points, part.closed) {
                self.path(&path, fill, stroke);
            }
        }
    }

    fn path(&mut self, path: &Path, fill: Option<Colour>, stroke: Option<Stroke>) {
        let (mask, transform) = (self.mask.as_ref(), self.transform);
        if let Some(colour) = fill {
            self.pixmap.fill_path(path, &paint(colour), FillRule::Winding, transform, mask);
        }
        if let Some(stroke) = stroke {
            let dash = stroke.dash.map(|dash| dash.map(|length| length as f32).to_vec());
            let line = tiny_skia::Stroke {
                width: stroke.width as f32,
                line_cap: if stroke.dash.is_some() { LineCap::Butt } else { LineCap::Round },
                line_join: LineJoin::Round,
                dash: dash.and_then(|dash| StrokeDash::new(dash, 0.0)),
                ..tiny_skia::Stroke::default()
            };
            self.pixmap.stroke_path(path, &paint(stroke.colour), &line, transform, mask);
        }
    }

    fn text(&mut self, at: [f64; 2], text: &str, style: &TextStyle) {
        let x = style.left_end(at[0], text);
        let unit = style.size / font::UNITS_PER_EM;
        let mut letters = Letters { path: PathBuilder::new(), x, y: at[1], unit };
        font::outlines(text, style.weight, &mut letters);
        let Some(path) = letters.path.finish() else {
            return;
        };
        let rim = style.halo.map(|colour| Stroke::solid(colour, style.size * font::RIM));
        self.path(&path, None, rim);
        self.path(&path, Some(style.colour), None);
    }

    /// Without smoothing: each pixel of the page takes that of the raster under its centre.
    fn picture(&mut self, area: &Area, raster: &Raster) {
        let Some(mut pixels) = Pixmap::new(raster.width as u32, raster.height as u32) else {
            return;
        };
        for (to, &[r, g, b]) in pixels.pixels_mut().iter_mut().zip(&raster.pixels) {
            *to = tiny_skia::ColorU8::from_rgba(r, g, b, 255).premultiply();
        }
        let [sx, sy] = [area.width / raster.width as f64, area.height / raster.height as f64]
            .map(|s| s as f32);
        let transform =
            self.transform.pre_translate(area.x as f32, area.y as f32).pre_scale(sx, sy);
        let paint = PixmapPaint { quality: FilterQuality::Nearest, ..PixmapPaint::default() };
        self.pixmap.draw_pixmap(0, 0, pixels.as_ref(), &paint, transform, self.mask.as_ref());
    }
}

fn rect(area: &Area) -> Option<Rect> {
    Rect::from_xywh(area.x as f32, area.y as f32, area.width as f32, area.height as f32)
}

fn paint([r, g, b, a]: Colour) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, a);
    paint.anti_alias = true;
    paint
}

fn polyline(points: &[[f64; 2]], closed: bool) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (i, point) in points.iter().enumerate() {
        let [x, y] = point.map(|c| c as f32);
        if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
    }
    if closed {
        path.close();
    }
    path.finish()
}

/// Turns letters' outlines in font units, y up, into a path on the page.
struct Letters {
    path: PathBuilder,
    x: f64,
    y: f64,
    unit: f64,
}

impl Letters {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        ((self.x + f64::from(x) * self.unit) as f32, (self.y - f64::from(y) * self.unit) as f32)
    }
}

impl ttf_parser::OutlineBuilder for Letters {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.at(x1, y1), self.at(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}
