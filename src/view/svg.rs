//! A page as SVG: its font inside, pictures as pixels, nothing loaded from outside.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::canvas::{Anchor, Area, Canvas, Colour, Drawing, Stroke, TextStyle};
use super::font::{self, Weight};
use super::png::raster_png;
use super::visible::{Polyline, Visible};

/// Draws a page.
pub fn svg(canvas: &Canvas) -> String {
    let (width, height) = (number(canvas.width), number(canvas.height));
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" xml:space=\"preserve\" \
         font-family=\"'Divmerge Roboto', Roboto, sans-serif\">\n<style>\n"
    );
    for weight in [Weight::Regular, Weight::Medium] {
        let _ = writeln!(
            out,
            "@font-face {{ font-family: 'Divmerge Roboto'; font-weight: {}; src: \
             url(data:font/ttf;base64,{}); }}",
            weight.css(),
            STANDARD.encode(weight.bytes())
        );
    }
    out += "</style>\n";
    content(&mut out, canvas);
    out
}

/// Draws a page as an element of an HTML page, whose width it takes: with a label for those who do
/// not see it, and without the font, which every page would repeat.
pub fn inline_svg(canvas: &Canvas, label: &str) -> String {
    let (width, height) = (number(canvas.width), number(canvas.height));
    let mut out = format!(
        "<svg role=\"img\" viewBox=\"0 0 {width} {height}\" xml:space=\"preserve\" \
         font-family=\"Roboto, system-ui, sans-serif\">\n<title>{}</title>\n",
        escaped(label)
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
                     href=\"data:image/png;base64,{png}\"/>",
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

fn text(out: &mut String, at: [f64; 2], text: &str, style: &TextStyle) -> std::fmt::Result {
    let [x, y] = at.map(number);
    let anchor = match style.anchor {
        Anchor::Start => "",
        Anchor::Middle => " text-anchor=\"middle\"",
        Anchor::End => " text-anchor=\"end\"",
    };
    let rim = style.halo.map(|halo| {
        let line = line(Some(Stroke::solid(halo, style.size / 4.0)));
        format!("{line} paint-order=\"stroke\"")
    });
    // The text keeps its width where a viewer takes another font.
    let width = number(font::width(text, style.size, style.weight));
    writeln!(
        out,
        "<text x=\"{x}\" y=\"{y}\" textLength=\"{width}\" lengthAdjust=\"spacingAndGlyphs\" \
         font-size=\"{}\" font-weight=\"{}\"{anchor}{}{}>{}</text>",
        number(style.size),
        style.weight.css(),
        paint("fill", Some(style.colour)),
        rim.unwrap_or_default(),
        escaped(text)
    )
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

/// Text as content of an element; characters that XML forbids are replaced.
fn escaped(text: &str) -> String {
    let is_forbidden = |c: char| c.is_control() || c == '\u{fffe}' || c == '\u{ffff}';
    let text = text.replace(is_forbidden, "\u{fffd}");
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_text_is_escaped() {
        assert_eq!(
            [0.0, -1.5, 2.0, 1.0 / 3.0, 100.0].map(number),
            ["0", "-1.5", "2", "0.33", "100"]
        );
        assert_eq!(escaped("a<b & c>\u{1}"), "a&lt;b &amp; c&gt;\u{fffd}");
    }
}
