//! Colours of instances, and of the points that belong to none.

use std::ops::RangeInclusive;
use std::sync::LazyLock;

/// Colours of instances before they repeat.
pub const INSTANCE_COLOURS: usize = 1024;
/// Degrees between the hues of neighbouring ids: the golden angle leaves no two early ids close.
const GOLDEN_ANGLE: f64 = 137.507_764_050_037_85;
/// OKLCH lightness of neighbouring ids, or the nearest at which sRGB has enough chroma.
const LIGHTNESS: [f64; 3] = [0.76, 0.64, 0.87];
/// OKLCH chroma: the most that sRGB has of this range.
const CHROMA: RangeInclusive<f64> = 0.13..=0.19;
const CHROMA_STEP: f64 = 0.0025;

static TABLE: LazyLock<Vec<[u8; 3]>> =
    LazyLock::new(|| (0..INSTANCE_COLOURS).map(colour).collect());

/// sRGB colour of instance `id`: bright, never grey, the same in every frame and recording,
/// neighbouring ids far apart. Repeats after 1024.
pub fn instance_colour(id: u32) -> [u8; 3] {
    TABLE[id.wrapping_sub(1) as usize % INSTANCE_COLOURS]
}

/// sRGB colour of an instance of background.
pub const BACKGROUND_COLOUR: [u8; 3] = [136; 3];

/// sRGB colour of a point without an instance, by the code of the reason: greys, those
/// of objects (4 to 6) tinted so that they can be seen.
///
/// 0 none, 1 no return, 2 not an object, 3 ground, 4 shadowed without a match, 5 unreached,
/// 6 too small, 7 cropped.
pub fn reason_colour(reason: u8) -> [u8; 3] {
    match reason {
        1 => [56, 56, 56],
        2 => [104, 104, 104],
        3 => [80, 80, 80],
        4 => [168, 138, 104],
        5 => [104, 144, 158],
        6 => [158, 116, 152],
        7 => [68, 68, 68],
        _ => [136, 136, 136],
    }
}

fn colour(index: usize) -> [u8; 3] {
    let hue = (index as f64 * GOLDEN_ANGLE).to_radians();
    let wanted = LIGHTNESS[index % LIGHTNESS.len()];
    (0..100)
        .flat_map(|step| [-1.0, 1.0].map(|sign| wanted + sign * 0.01 * f64::from(step)))
        .find_map(|lightness| most_colourful(lightness, hue))
        .unwrap_or([255; 3])
}

/// The most colourful sRGB colour of a lightness and hue, unless that is greyish.
fn most_colourful(lightness: f64, hue: f64) -> Option<[u8; 3]> {
    let steps = ((CHROMA.end() - CHROMA.start()) / CHROMA_STEP) as u32;
    (0..=steps)
        .map(|step| oklch_to_linear(lightness, CHROMA.end() - f64::from(step) * CHROMA_STEP, hue))
        .find(|linear| linear.iter().all(|value| (0.0..=1.0).contains(value)))
        .map(|linear| linear.map(|value| (gamma(value) * 255.0).round() as u8))
}

/// Björn Ottosson's OKLab, in polar coordinates, to linear sRGB.
fn oklch_to_linear(lightness: f64, chroma: f64, hue: f64) -> [f64; 3] {
    let (a, b) = (chroma * hue.cos(), chroma * hue.sin());
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
}

fn gamma(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance(a: [u8; 3], b: [u8; 3]) -> i32 {
        (0..3).map(|i| (i32::from(a[i]) - i32::from(b[i])).pow(2)).sum()
    }

    #[test]
    fn instances_are_bright_and_never_grey() {
        for id in 1..=INSTANCE_COLOURS as u32 {
            let colour = instance_colour(id);
            let (low, high) = (colour.iter().min().unwrap(), colour.iter().max().unwrap());
            assert!(*high >= 140 && high - low >= 70, "{id}: {colour:?}");
        }
    }

    #[test]
    fn neighbours_are_far_apart_and_hundreds_differ() {
        for id in 1..INSTANCE_COLOURS as u32 {
            let gap = distance(instance_colour(id), instance_colour(id + 1));
            assert!(gap > 80 * 80, "{id}: {gap}");
        }
        let mut first: Vec<_> = (1..=300).map(instance_colour).collect();
        first.sort_unstable();
        first.dedup();
        assert!(first.len() >= 298, "{}", first.len());
    }

    #[test]
    fn colours_are_stable() {
        assert_eq!(instance_colour(1), instance_colour(1 + INSTANCE_COLOURS as u32));
        assert_eq!(
            [1, 2, 3].map(instance_colour),
            [[254, 131, 173], [74, 165, 18], [147, 163, 254]]
        );
        instance_colour(u32::MAX);
    }

    #[test]
    fn reasons_can_be_told_apart() {
        for a in 0..=6 {
            for b in 0..a {
                assert!(distance(reason_colour(a), reason_colour(b)) > 300);
            }
        }
    }
}
