//! The font of the figures, part of the program: Roboto (assets/fonts).

use std::sync::LazyLock;

use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// Font units to the em, of both weights.
pub const UNITS_PER_EM: f64 = 2048.0;
/// Width of the rim around letters over a picture, ems.
pub const RIM: f64 = 0.25;

/// Weight of the letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Weight {
    /// For running text.
    Regular,
    /// For titles.
    Medium,
}

impl Weight {
    /// The font file.
    pub fn bytes(self) -> &'static [u8] {
        match self {
            Weight::Regular => include_bytes!("../../assets/fonts/Roboto-Regular-Latin.ttf"),
            Weight::Medium => include_bytes!("../../assets/fonts/Roboto-Medium-Latin.ttf"),
        }
    }

    fn face(self) -> &'static Face<'static> {
        static FACES: LazyLock<[Face<'static>; 2]> = LazyLock::new(|| {
            [Weight::Regular, Weight::Medium].map(|weight| {
                Face::parse(weight.bytes(), 0).expect("the font that comes with the program")
            })
        });
        &FACES[self as usize]
    }
}

/// Measures of a font in its units.
#[derive(Debug, Clone, Copy)]
pub struct Metrics {
    /// Left, lower, right and upper end of all letters.
    pub bounds: [i16; 4],
    pub ascent: i16,
    pub descent: i16,
    pub cap_height: i16,
    /// How thick an upright stroke is.
    pub stem: i16,
}

pub fn metrics(weight: Weight) -> Metrics {
    let face = weight.face();
    let bounds = face.global_bounding_box();
    let upright = face.glyph_index('l').and_then(|glyph| face.glyph_bounding_box(glyph));
    Metrics {
        bounds: [bounds.x_min, bounds.y_min, bounds.x_max, bounds.y_max],
        ascent: face.ascender(),
        descent: face.descender(),
        cap_height: face.capital_height().unwrap_or(face.ascender()),
        stem: upright.map_or(0, |upright| upright.width()),
    }
}

/// The letters of a text, each by its number in the font (0 for one that the font lacks) and with
/// its character.
pub fn glyphs(text: &str, weight: Weight) -> impl Iterator<Item = (u16, char)> {
    let face = weight.face();
    text.chars().map(|character| (face.glyph_index(character).unwrap_or_default().0, character))
}

/// From one letter to the next, font units.
pub fn advance(glyph: u16, weight: Weight) -> i16 {
    let units = weight.face().glyph_hor_advance(GlyphId(glyph)).unwrap_or(0);
    i16::try_from(units).unwrap_or(i16::MAX)
}

/// Width of a text in the unit of `size`. A character that the font lacks is as wide as its box.
pub fn width(text: &str, size: f64, weight: Weight) -> f64 {
    let units: f64 = glyphs(text, weight).map(|(glyph, _)| f64::from(advance(glyph, weight))).sum();
    units * size / UNITS_PER_EM
}

/// The text; where it is too wide, an ellipsis takes the place of its end.
pub fn fitted(text: &str, size: f64, weight: Weight, room: f64) -> String {
    if width(text, size, weight) <= room {
        return text.to_owned();
    }
    let mut kept: Vec<char> = text.chars().collect();
    while !kept.is_empty() {
        kept.pop();
        let shorter = kept.iter().collect::<String>().trim_end().to_owned() + "…";
        if width(&shorter, size, weight) <= room {
            return shorter;
        }
    }
    String::new()
}

/// Gives the outlines of a text's letters to `builder`, side by side in font units: x from the left
/// end of the text, y up from its baseline.
pub fn outlines(text: &str, weight: Weight, builder: &mut impl OutlineBuilder) {
    let face = weight.face();
    let mut beside = Beside { builder, x: 0.0 };
    for (glyph, _) in glyphs(text, weight) {
        face.outline_glyph(GlyphId(glyph), &mut beside);
        beside.x += f32::from(advance(glyph, weight));
    }
}

/// Gives the outline of one letter to `builder`, in font units.
pub fn outline(glyph: u16, weight: Weight, builder: &mut impl OutlineBuilder) {
    weight.face().outline_glyph(GlyphId(glyph), builder);
}

/// Moves outlines to the right.
struct Beside<'a, B> {
    builder: &'a mut B,
    x: f32,
}

impl<B: OutlineBuilder> OutlineBuilder for Beside<'_, B> {
    fn move_to(&mut self, x: f32, y: f32) {
        self.builder.move_to(self.x + x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.builder.line_to(self.x + x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.builder.quad_to(self.x + x1, y1, self.x + x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.builder.curve_to(self.x + x1, y1, self.x + x2, y2, self.x + x, y);
    }

    fn close(&mut self) {
        self.builder.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sign_in_use_is_in_the_font() {
        for weight in [Weight::Regular, Weight::Medium] {
            assert_eq!(f64::from(weight.face().units_per_em()), UNITS_PER_EM);
            for sign in ('!'..='~').chain("·×°–—…−≥≤²±µ".chars()) {
                assert!(weight.face().glyph_index(sign).is_some(), "{sign}");
            }
        }
    }

    #[test]
    fn widths_add_up_and_long_text_is_cut() {
        let [a, b, ab] = ["a", "b", "ab"].map(|text| width(text, 10.0, Weight::Regular));
        assert!((a + b - ab).abs() < 1e-9 && a > 4.0 && a < 7.0);
        let cut = fitted("/a/very/long/topic", 10.0, Weight::Regular, 50.0);
        assert!(cut.ends_with('…') && width(&cut, 10.0, Weight::Regular) <= 50.0, "{cut}");
        assert_eq!(fitted("ab", 10.0, Weight::Regular, 50.0), "ab");
    }
}
