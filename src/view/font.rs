//! The font of the figures, part of the program: Roboto (assets/fonts).

use std::sync::LazyLock;

use ttf_parser::{Face, OutlineBuilder};

/// Weight of the letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    /// For running text.
    Regular,
    /// For titles.
    Medium,
}

impl Weight {
    /// The weight as CSS counts it.
    pub fn css(self) -> u32 {
        match self {
            Weight::Regular => 400,
            Weight::Medium => 500,
        }
    }

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
    units * size / f64::from(face.units_per_em())
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

/// Gives the outlines of a text's letters to `builder` one after the other; `start` tells it where,
/// in ems, the next begins.
pub fn outlines<B: OutlineBuilder>(
    text: &str,
    weight: Weight,
    builder: &mut B,
    start: impl Fn(&mut B, f64),
) {
    let face = weight.face();
    let em = f64::from(face.units_per_em());
    let mut x = 0.0;
    for character in text.chars() {
        let glyph = face.glyph_index(character).unwrap_or_default();
        start(builder, x);
        face.outline_glyph(glyph, builder);
        x += f64::from(face.glyph_hor_advance(glyph).unwrap_or(0)) / em;
    }
}

/// Font units to the em.
pub fn units_per_em() -> f64 {
    f64::from(Weight::Regular.face().units_per_em())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sign_in_use_is_in_the_font() {
        for weight in [Weight::Regular, Weight::Medium] {
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
