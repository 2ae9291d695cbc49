//! A page as SVG: letters as outlines, so that every viewer draws the same; pictures as pixels;
//! nothing loaded from outside. The words of a text are its `aria-label`.

use std::collections::BTreeMap;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::canvas::{Area, Canvas, Colour, Drawing, Raster, Stroke, TextStyle};
use super::font::{self, Weight};
use super::png::raster_png;
use super::visible::{Polyline, Visible};

/// Draws a page. Its title is its first text, the heading.
pub fn svg(canvas: &Canvas) -> String {
    let (width, height) = (number(canvas.width), number(canvas.height));
    let size = format!(
        "xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" \
         width=\"{width}\" height=\"{height}\""
    );
    element(canvas, &size, canvas.heading().unwrap_or_default(), Letters::Shared(BTreeMap::new()))
}

/// Draws a page as an element of an HTML page, whose width it takes, with a label for those who do
/// not see it. It has no ids, which are those of the whole HTML page.
pub fn inline_svg(canvas: &Canvas, label: &str) -> String {
    element(canvas, "role=\"img\"", label, Letters::Apart)
}

fn element(canvas: &Canvas, attributes: &str, title: &str, letters: Letters) -> String {
    let (width, height) = (number(canvas.width), number(canvas.height));
    let mut page = Page { out: String::new(), letters };
    page.shapes(&canvas.shapes, &canvas.visible());
    let Page { out: shapes, letters } = page;
    let fill = paint("fill", Some(canvas.background));
    format!(
        "<svg {attributes} viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n{}\
         <rect width=\"{width}\" height=\"{height}\"{fill}/>\n{shapes}</svg>\n",
        escaped(title),
        letters.definitions()
    )
}

/// How the letters of a page are written.
enum Letters {
    /// Each text with its own outlines.
    Apart,
    /// Texts refer to the outlines of their letters, which are here, by weight and number in the
    /// font: a fraction of the bytes.
    Shared(BTreeMap<(Weight, u16), String>),
}

impl Letters {
    fn definitions(&self) -> String {
        let Letters::Shared(outlines) = self else { return String::new() };
        let path = |(&(weight, glyph), data): (&(Weight, u16), &String)| {
            format!("<path id=\"{}\" d=\"{data}\"/>\n", glyph_id(weight, glyph))
        };
        let seen = outlines.iter().filter(|(_, data)| !data.is_empty());
        format!("<defs>\n{}</defs>\n", seen.map(path).collect::<String>())
    }

    /// The elements of a text, in font units with y up.
    fn elements(&mut self, text: &str, weight: Weight) -> String {
        let Letters::Shared(outlines) = self else {
            let mut letters = PathData::default();
            font::outlines(text, weight, &mut letters);
            let is_blank = letters.data.is_empty();
            return if is_blank {
                String::new()
            } else {
                format!("<path d=\"{}\"/>", letters.data)
            };
        };
        let mut elements = String::new();
        let mut x = 0;
        for (glyph, _) in font::glyphs(text, weight) {
            let outline = outlines.entry((weight, glyph)).or_insert_with(|| {
                let mut letter = PathData::default();
                font::outline(glyph, weight, &mut letter);
                letter.data
            });
            if !outline.is_empty() {
                let place = if x == 0 { String::new() } else { format!(" x=\"{x}\"") };
                let id = glyph_id(weight, glyph);
                elements += &format!("<use{place} xlink:href=\"#{id}\"/>");
            }
            x += i32::from(font::advance(glyph, weight));
        }
        elements
    }
}

fn glyph_id(weight: Weight, glyph: u16) -> String {
    let letter = match weight {
        Weight::Regular => 'r',
        Weight::Medium => 'm',
    };
    format!("{letter}{glyph}")
}

/// A page in the making.
struct Page {
    out: String,
    letters: Letters,
}

impl Page {
    fn shapes(&mut self, all: &[Drawing], visible: &Visible) {
        for shape in all {
            let out = &mut self.out;
            match shape {
                Drawing::Path { points, closed, fill, stroke } => {
                    polylines(out, &visible.path(points, *closed), *fill, *stroke);
                }
                Drawing::Circle { centre, radius, fill, stroke } => {
                    match visible.circle(*centre, *radius) {
                        Some(parts) => polylines(out, &parts, *fill, *stroke),
                        None => circle(out, *centre, *radius, (*fill, *stroke)),
                    }
                }
                Drawing::Text { at, .. } if !visible.holds(*at) => {}
                Drawing::Text { at, text, style } => {
                    let letters = self.letters.elements(text, style.weight);
                    if !letters.is_empty() {
                        self::text(out, *at, (text, &letters), style);
                    }
                }
                Drawing::Picture { area, raster } => picture(out, area, raster),
                Drawing::Clip { area, shapes } => {
                    // A nested page clips at its edges.
                    let [x, y, width, height] =
                        [area.x, area.y, area.width, area.height].map(number);
                    let view = format!("viewBox=\"{x} {y} {width} {height}\"");
                    *out += &format!("<svg {} {view}>\n", place(area));
                    self.shapes(shapes, visible);
                    self.out += "</svg>\n";
                }
            }
        }
    }
}

fn circle(out: &mut String, centre: [f64; 2], radius: f64, look: (Option<Colour>, Option<Stroke>)) {
    let [cx, cy, r] = [centre[0], centre[1], radius].map(number);
    let (fill, line) = (paint("fill", look.0), line(look.1));
    *out += &format!("<circle cx=\"{cx}\" cy=\"{cy}\" r=\"{r}\"{fill}{line}/>\n");
}

fn picture(out: &mut String, area: &Area, raster: &Raster) {
    let png = STANDARD.encode(raster_png(raster).unwrap_or_default());
    *out += &format!(
        "<image {} preserveAspectRatio=\"none\" image-rendering=\"optimizeSpeed\" \
         style=\"image-rendering: pixelated\" xlink:href=\"data:image/png;base64,{png}\"/>\n",
        place(area)
    );
}

fn polylines(out: &mut String, parts: &[Polyline], fill: Option<Colour>, stroke: Option<Stroke>) {
    for Polyline { points, closed } in parts {
        let name = if *closed { "polygon" } else { "polyline" };
        let points: Vec<String> =
            points.iter().map(|&[x, y]| format!("{},{}", number(x), number(y))).collect();
        let (points, fill, line) = (points.join(" "), paint("fill", fill), line(stroke));
        *out += &format!("<{name} points=\"{points}\"{fill}{line}/>\n");
    }
}

/// A text of words and letters; a rim lies below the letters.
fn text(out: &mut String, at: [f64; 2], (words, letters): (&str, &str), style: &TextStyle) {
    let [x, y] = [number(style.left_end(at[0], words)), number(at[1])];
    let scale = style.size / font::UNITS_PER_EM;
    let place = format!("transform=\"translate({x} {y}) scale({scale:.6} {:.6})\"", -scale);
    if let Some(halo) = style.halo {
        let rim = line(Some(Stroke::solid(halo, font::UNITS_PER_EM * font::RIM)));
        *out += &format!("<g {place} fill=\"none\"{rim}>{letters}</g>\n");
    }
    let (fill, label) = (paint("fill", Some(style.colour)), escaped(words));
    *out += &format!("<g role=\"img\" aria-label=\"{label}\" {place}{fill}>{letters}</g>\n");
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
        // The rim and the letters, of which only these have a label; each letter is there once.
        assert_eq!(drawn.matches("<g ").count(), 2);
        assert_eq!(drawn.matches("aria-label=\"V+ &gt; &quot;V−&quot;\"").count(), 1);
        assert_eq!(drawn.matches("<path id=").count(), 5, "{drawn}");
        // On an HTML page ids are those of the page.
        let inline = inline_svg(&page, "a figure");
        assert!(!inline.contains("id=") && !inline.contains("xmlns"), "{inline}");
        assert_eq!(inline.matches("<path ").count(), 2);
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
