//! The figures' font inside the file, with the characters that its letters stand for.

use std::collections::BTreeMap;

use pdf_writer::types::{CidFontType, FontFlags, SystemInfo, UnicodeCmap};
use pdf_writer::{Filter, Finish, Name, Pdf, Rect, Ref, Str};

use super::content::Glyphs;
use super::objects::{Refs, deflated};
use crate::view::font::{self, Metrics, UNITS_PER_EM, Weight};

/// The font of each weight that is used.
pub type FontRefs = Vec<(Weight, Ref)>;

/// Numbers of glyphs are those of the font file.
const IDENTITY: SystemInfo =
    SystemInfo { registry: Str(b"Adobe"), ordering: Str(b"Identity"), supplement: 0 };

/// Writes the fonts that are used.
pub fn write(file: &mut Pdf, refs: &mut Refs, glyphs: &Glyphs) -> FontRefs {
    glyphs.iter().map(|(&weight, used)| (weight, write_font(file, refs, weight, used))).collect()
}

fn write_font(file: &mut Pdf, refs: &mut Refs, weight: Weight, used: &BTreeMap<u16, char>) -> Ref {
    let [id, cid, descriptor, unicode, data] = std::array::from_fn(|_| refs.next());
    let name = match weight {
        Weight::Regular => Name(b"Roboto-Regular"),
        Weight::Medium => Name(b"Roboto-Medium"),
    };
    let mut font = file.type0_font(id);
    font.base_font(name).encoding_predefined(Name(b"Identity-H"));
    font.descendant_font(cid).to_unicode(unicode);
    font.finish();

    let mut font = file.cid_font(cid);
    font.subtype(CidFontType::Type2).base_font(name).system_info(IDENTITY);
    font.font_descriptor(descriptor).default_width(0.0);
    font.cid_to_gid_map_predefined(Name(b"Identity"));
    let mut widths = font.widths();
    for &glyph in used.keys() {
        widths.consecutive(glyph, [per_mille(font::advance(glyph, weight))]);
    }
    widths.finish();
    font.finish();

    let Metrics { bounds, ascent, descent, cap_height, stem } = font::metrics(weight);
    let [left, low, right, high] = bounds.map(per_mille);
    file.font_descriptor(descriptor)
        .name(name)
        .flags(FontFlags::NON_SYMBOLIC)
        .bbox(Rect::new(left, low, right, high))
        .italic_angle(0.0)
        .ascent(per_mille(ascent))
        .descent(per_mille(descent))
        .cap_height(per_mille(cap_height))
        .stem_v(per_mille(stem))
        .font_file2(data);

    let mut map = UnicodeCmap::<u16>::new(Name(b"Divmerge"), IDENTITY);
    used.iter().for_each(|(&glyph, &character)| map.pair(glyph, character));
    let map = deflated(&map.finish());
    file.stream(unicode, &map).filter(Filter::FlateDecode);

    let bytes = weight.bytes();
    let compressed = deflated(bytes);
    let mut stream = file.stream(data, &compressed);
    stream.filter(Filter::FlateDecode);
    stream.pair(Name(b"Length1"), bytes.len() as i32);
    id
}

/// Thousandths of an em.
fn per_mille(units: i16) -> f32 {
    (f64::from(units) / UNITS_PER_EM * 1000.0) as f32
}
