//! A page as SVG: letters as outlines, so that every viewer draws the same; pictures as pixels;
//! nothing loaded from outside. The words of a text are its `aria-label`.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::canvas::{Area, Canvas, Colour, Drawing, Stroke, TextStyle};
use super::font;
use super::png::raster_png;
use super::visible::{Polyline, Visible};

/// Draws a page. Its title is its first text, the heading.
pub fn svg(canvas: &Canvas) -> String {
    let (width, height) = (number(canvas.width), number(canvas.height));
    let size = format!(
        "xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" \
         width=\"{width}\" height=\"{height}\""
    );
    let heading = canvas.heading().unwrap_or_default();
    element(canvas, &size, heading)
}

/// Draws a page as an element of an HTML page, whose width it takes, with a label for those who do
/// not see it.
pub fn inline_svg(canvas: &Canvas, label: &str) -> String {
    element(canvas, "role=\"img\"", label)
}

fn element(canvas: &Canvas, attributes: &str, title: &str) -> String {
    let (width, height) = (number(canvas.width), number(canvas.height));
    let mut out = format!(
        "<svg {attributes} viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n",
        escaped(title)
    );
    content(&mut out, canvas);
    out
}

/// The background and the shapes, to the end of the element.
fn content(out: &mut String, canvas: &Canvas) {
    let (width, height) = (number(canvas.width), number(canvas.height));
    let fill = paint("fill", Some(canvas.background));
    let _ = writeln!(out, "<rect width=\"{width}\" height=\"{height}\"{fill}/>");
    shapes(out, &canvas.shapes, &canvas.visible());
    *out += "</svg>\n";
}

fn shapes(out: &mut String, all: &[Drawing], visible: &Visible) {
    for shape in all {
        let _ = match shape {
            Drawing::Path { points, closed, fill, stroke } => {
                polylines(out, &visible.path(points, *closed), *fill, *stroke)
            }
            Drawing::Circle { centre, radius, fill, stroke } => {
                if let Some(parts) = visible.circle(*centre, *radius) {
                    let _ = polylines(out, &parts, *fill, *stroke);
                    continue;
                }
                let [cx, cy, r] = [centre[0], centre[1], *radius].map(number);
                let (fill, line) = (paint("fill", *fill), line(*stroke));
                writeln!(out, "<circle cx=\"{cx}\" cy=\"{cy}\" r=\"{r}\"{fill}{line}/>")
            }
            Drawing::Text { at, .. } if !visible.holds(*at) => continue,
            Drawing::Text { at, text, style } => self::text(out, *at, text, style),
            Drawing::Picture { area, raster } => {
                let png = STANDARD.encode(raster_png(raster).unwrap_or_default());
                writeln!(
                    out,
                    "<image {} preserveAspectRatio=\"none\" image-rendering=\"optimizeSpeed\" \
                     style=\"image-rendering: pixelated\" \
                     xlink:href=\"data:image/png;base64,{png}\"/>",
                    place(area)
                )
            }
            Drawing::Clip { area, shapes } => {
                // A nested page clips at its edges.
                let [x, y, width, height] = [area.x, area.y, area.width, area.height].map(number);
                let view = format!("viewBox=\"{x} {y} {width} {height}\"");
                let _ = writeln!(out, "<svg {} {view}>", place(area));
                self::shapes(out, shapes, visible);
                writeln!(out, "</svg>")
            }
        };
    }
}

fn polylines(
    out: &mut String,
    parts: &[Polyline],
    fill: Option<Colour>,
    stroke: Option<Stroke>,
) -> std::fmt::Result {
    for Polyline { points, closed } in parts {
        let name = if *closed { "polygon" } else { "polyline" };
        let points: Vec<String> =
            points.iter().map(|&[x, y]| format!("{},{}", number(x), number(y))).collect();
        let (points, fill, line) = (points.join(" "), paint("fill", fill), line(stroke));
        writeln!(out, "<{name} points=\"{points}\"{fill}{line}/>")?;
    }
    Ok(())
}

/// The outlines of a text, in font units with y up; a rim lies below the letters.
fn text(out: &mut String, at: [f64; 2], text: &str, style: &TextStyle) -> std::fmt::Result {
    let mut letters = PathData::default();
    font::outlines(text, style.weight, &mut letters);
    if letters.data.is_empty() {
        return Ok(());
    }
    let [x, y] = [number(style.left_end(at[0], text)), number(at[1])];
    let scale = style.size / font::UNITS_PER_EM;
    let place = format!("transform=\"translate({x} {y}) scale({scale:.6} {:.6})\"", -scale);
    let PathData { data, .. } = letters;
    if let Some(halo) = style.halo {
        let rim = line(Some(Stroke::solid(halo, font::UNITS_PER_EM * font::RIM)));
        writeln!(out, "<path {place} fill=\"none\"{rim} d=\"{data}\"/>")?;
    }
    let (fill, label) = (paint("fill", Some(style.colour)), escaped(text));
    writeln!(out, "<path role=\"img\" aria-label=\"{label}\" {place}{fill} d=\"{data}\"/>")
}

/// Outlines as the data of a path, with relative commands.
#[derive(Default)]
struct PathData {
    data: String,
    last: [f32; 2],
    first: [f32; 2],
}

impl PathData {
    fn command(&mut self, letter: char, points: &[[f32; 2]]) {
        self.data.push(letter);
        for (place, along) in
            points.iter().flat_map(|p| [p[0] - self.last[0], p[1] - self.last[1]]).enumerate()
        {
            let text = number(f64::from(along));
            if place > 0 && !text.starts_with('-') {
                self.data.push(' ');
            }
            self.data += &text;
        }
        self.last = points[points.len() - 1];
    }
}

impl ttf_parser::OutlineBuilder for PathData {
    fn move_to(&mut self, x: f32, y: f32) {
        self.command('m', &[[x, y]]);
        self.first = [x, y];
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.command('l', &[[x, y]]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.command('q', &[[x1, y1], [x, y]]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.command('c', &[[x1, y1], [x2, y2], [x, y]]);
    }

    fn close(&mut self) {
        self.data.push('z');
        self.last = self.first;
    }
}

fn place(area: &Area) -> String {
    let [x, y, width, height] = [area.x, area.y, area.width, area.height].map(number);
    format!("x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"")
}

fn paint(what: &str, colour: Option<Colour>) -> String {
    match colour {
        None => format!(" {what}=\"none\""),
        Some([r, g, b, 255]) => format!(" {what}=\"#{r:02x}{g:02x}{b:02x}\""),
        Some([r, g, b, a]) => {
            let opacity = number(f64::from(a) / 255.0);
            format!(" {what}=\"#{r:02x}{g:02x}{b:02x}\" {what}-opacity=\"{opacity}\"")
        }
    }
}

fn line(stroke: Option<Stroke>) -> String {
    let Some(stroke) = stroke else {
        return String::new();
    };
    let dash = match stroke.dash {
        Some([on, off]) => format!(" stroke-dasharray=\"{} {}\"", number(on), number(off)),
        None => " stroke-linecap=\"round\"".to_owned(),
    };
    let (colour, width) = (paint("stroke", Some(stroke.colour)), number(stroke.width));
    format!("{colour} stroke-width=\"{width}\" stroke-linejoin=\"round\"{dash}")
}

/// A number with two decimals at most, and without zeros at the end.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Text as content of an element or an attribute; characters that XML forbids are replaced.
fn escaped(text: &str) -> String {
    let is_forbidden = |c: char| c.is_control() || c == '\u{fffe}' || c == '\u{ffff}';
    let text = text.replace(is_forbidden, "\u{fffd}");
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    text.replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::canvas::Anchor;
    use crate::view::{look, theme};

    #[test]
    fn numbers_are_short_and_text_is_escaped() {
        assert_eq!(
            [0.0, -1.5, 2.0, 1.0 / 3.0, 100.0].map(number),
            ["0", "-1.5", "2", "0.33", "100"]
        );
        assert_eq!(escaped("a<b & \"c\">\u{1}"), "a&lt;b &amp; &quot;c&quot;&gt;\u{fffd}");
    }

    #[test]
    fn letters_are_outlines_whose_words_can_be_found() {
        let mut page = Canvas::new(90.0, 20.0, theme::PAGE);
        page.text([5.0, 15.0], "V+ > \"V−\"", look::DARK.label(10.0, theme::INK, Anchor::Start));
        let drawn = svg(&page);
        for lack in ["<text", "textLength", "font-face", "font-family"] {
            assert!(!drawn.contains(lack), "{lack}: {drawn}");
        }
        assert!(drawn.contains("<title>V+ &gt; &quot;V−&quot;</title>"), "{drawn}");
        // The rim and the letters, of which only these have a label.
        assert_eq!(drawn.matches("<path ").count(), 2);
        assert_eq!(drawn.matches("aria-label=\"V+ &gt; &quot;V−&quot;\"").count(), 1);
    }

    #[test]
    fn path_data_is_relative_and_begins_anew_where_a_contour_is_closed() {
        use ttf_parser::OutlineBuilder;
        let mut letters = PathData::default();
        letters.move_to(10.0, 20.0);
        letters.line_to(15.0, 10.0);
        letters.quad_to(15.5, 10.0, 30.0, 0.0);
        letters.close();
        letters.move_to(11.0, 20.0);
        assert_eq!(letters.data, "m10 20l5-10q0.5 0 15-10zm1 0");
    }
}
