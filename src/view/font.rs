//! The font of the figures, part of the program: Roboto (assets/fonts).

use std::sync::LazyLock;

use ttf_parser::{Face, OutlineBuilder};

/// Font units to the em, of both weights.
pub const UNITS_PER_EM: f64 = 2048.0;
/// Width of the rim around letters over a picture, ems.
pub const RIM: f64 = 0.25;

/// Weight of the letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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

/// Width of a text in the unit of `size`. A character that the font lacks is as wide as its box.
pub fn width(text: &str, size: f64, weight: Weight) -> f64 {
    let face = weight.face();
    let advance = |c| face.glyph_hor_advance(face.glyph_index(c).unwrap_or_default()).unwrap_or(0);
    let units: f64 = text.chars().map(|c| f64::from(advance(c))).sum();
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
    for character in text.chars() {
        let glyph = face.glyph_index(character).unwrap_or_default();
        face.outline_glyph(glyph, &mut beside);
        beside.x += f32::from(face.glyph_hor_advance(glyph).unwrap_or(0));
    }
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
