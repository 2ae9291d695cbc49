//! A page as PDF: shapes as shapes, text as text in the figures' own font, pictures lossless.
//!
//! The file has no date and no id, so that the same page gives the same bytes.

use pdf_writer::types::Predictor;
use pdf_writer::{Filter, Finish, Name, Pdf, Rect, Ref, TextStr};

use super::canvas::{Area, Canvas, Raster};
use content::{Content, POINTS_PER_UNIT};
use fonts::FontRefs;
use objects::{Refs, deflated};

mod content;
mod fonts;
mod objects;

/// Width and height of a pixel of a picture in page units, at most: 300 to the inch.
const LARGEST_PIXEL: f64 = 0.32;

/// Draws a page. Its title is its first text, the heading.
pub fn pdf(canvas: &Canvas) -> Vec<u8> {
    let drawn = Content::of(canvas);
    let mut refs = Refs::new();
    let [catalog, pages, page, content, info] = std::array::from_fn(|_| refs.next());
    let mut file = Pdf::new();
    file.set_version(1, 7);
    file.catalog(catalog).pages(pages).lang(TextStr("en"));
    file.pages(pages).kids([page]).count(1);
    let heading = canvas.heading().unwrap_or_default();
    file.document_info(info).title(TextStr(heading)).producer(TextStr("divmerge"));

    let fonts = fonts::write(&mut file, &mut refs, &drawn.glyphs);
    let pictures: Vec<Ref> = drawn.pictures.iter().map(|_| refs.next()).collect();
    for (&id, (area, raster)) in pictures.iter().zip(&drawn.pictures) {
        picture(&mut file, id, area, raster);
    }
    page_object(&mut file, canvas, [page, pages, content], (&fonts, &pictures, &drawn));
    let bytes = deflated(&drawn.operations);
    file.stream(content, &bytes).filter(Filter::FlateDecode);
    file.finish()
}

fn page_object(
    file: &mut Pdf,
    canvas: &Canvas,
    [page, pages, content]: [Ref; 3],
    (fonts, pictures, drawn): (&FontRefs, &[Ref], &Content),
) {
    let [width, height] = [canvas.width, canvas.height].map(|side| (side * POINTS_PER_UNIT) as f32);
    let mut page = file.page(page);
    page.media_box(Rect::new(0.0, 0.0, width, height)).parent(pages).contents(content);
    let mut resources = page.resources();
    let mut named = resources.fonts();
    for (weight, id) in fonts {
        named.pair(content::font_name(*weight), *id);
    }
    named.finish();
    let mut named = resources.x_objects();
    for (number, &id) in pictures.iter().enumerate() {
        named.pair(Name(content::picture_name(number).as_bytes()), id);
    }
    named.finish();
    let mut named = resources.ext_g_states();
    for &alpha in &drawn.opacities {
        let name = content::opacity_name(alpha);
        let part = f32::from(alpha) / 255.0;
        let mut state =
            named.insert(Name(name.as_bytes())).start::<pdf_writer::writers::ExtGraphicsState>();
        state.stroking_alpha(part).non_stroking_alpha(part);
    }
}

/// Writes a picture. Viewers blur pixels that they enlarge, so pixels are repeated until they are
/// small; rows that repeat cost next to nothing.
fn picture(file: &mut Pdf, id: Ref, area: &Area, raster: &Raster) {
    let times = |side: f64, pixels: usize| {
        (side / pixels as f64 / LARGEST_PIXEL).ceil().clamp(1.0, 64.0) as usize
    };
    let [across, down] = [times(area.width, raster.width), times(area.height, raster.height)];
    let [width, height] = [raster.width * across, raster.height * down];
    let bytes = deflated(&filtered(raster, across, down));
    let mut image = file.image_xobject(id, &bytes);
    image.filter(Filter::FlateDecode);
    image.width(width as i32).height(height as i32).bits_per_component(8).interpolate(false);
    image.color_space().device_rgb();
    let mut parms = image.decode_parms();
    parms.predictor(Predictor::PngUp).colors(3).bits_per_component(8).columns(width as i32);
}

/// The rows of a picture, each pixel repeated across and each row down, as differences from the row
/// above behind the number of that filter of PNG, 2.
fn filtered(raster: &Raster, across: usize, down: usize) -> Vec<u8> {
    const UP: u8 = 2;
    let length = raster.width * across * 3;
    let mut bytes = Vec::with_capacity((length + 1) * raster.height * down);
    let mut above = vec![0_u8; length];
    for pixels in raster.pixels.chunks(raster.width.max(1)) {
        let row: Vec<u8> =
            pixels.iter().flat_map(|&pixel| std::iter::repeat_n(pixel, across)).flatten().collect();
        bytes.push(UP);
        bytes.extend(row.iter().zip(&above).map(|(new, old)| new.wrapping_sub(*old)));
        for _ in 1..down {
            bytes.push(UP);
            bytes.resize(bytes.len() + length, 0);
        }
        above = row;
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::canvas::Anchor;
    use crate::view::theme;

    fn count(bytes: &[u8], part: &[u8]) -> usize {
        bytes.windows(part.len()).filter(|window| *window == part).count()
    }

    #[test]
    fn a_page_has_its_size_its_title_and_the_fonts_it_uses() {
        let mut page = Canvas::new(200.0, 100.0, theme::PAGE);
        let empty = pdf(&page);
        assert!(empty.starts_with(b"%PDF-1.7") && empty.ends_with(b"%%EOF"));
        assert_eq!(count(&empty, b"/FontFile2"), 0);
        page.text([5.0, 15.0], "frame 7", theme::faint(Anchor::Start));
        let drawn = pdf(&page);
        assert_eq!(count(&drawn, b"/MediaBox [0 0 150 75]"), 1);
        assert_eq!(count(&drawn, b"/Title (frame 7)"), 1);
        assert_eq!(count(&drawn, b"/FontFile2"), 1);
        assert_eq!(drawn, pdf(&page), "the same bytes");
    }

    #[test]
    fn pixels_are_repeated_and_rows_are_differences() {
        let pixels = vec![[1, 2, 3], [4, 5, 6], [9, 9, 9], [9, 9, 9]];
        let raster = Raster { width: 2, height: 2, pixels };
        let first = [2, 1, 2, 3, 1, 2, 3, 4, 5, 6, 4, 5, 6];
        let same = [2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        let second = [2, 8, 7, 6, 8, 7, 6, 5, 4, 3, 5, 4, 3];
        assert_eq!(filtered(&raster, 2, 2), [first, same, second, same].concat());
    }

    #[test]
    fn each_opacity_is_named_once() {
        let mut page = Canvas::new(20.0, 20.0, theme::PAGE);
        let area = Area { x: 1.0, y: 1.0, width: 5.0, height: 5.0 };
        for alpha in [128, 255, 128, 40] {
            page.rect(area, Some([1, 2, 3, alpha]), None);
        }
        let drawn = pdf(&page);
        assert_eq!([&b"/A128 "[..], b"/A40 ", b"/A255 "].map(|name| count(&drawn, name)), [1; 3]);
    }
}
