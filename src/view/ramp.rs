//! Colour ramps for quantities.

use super::style::{between, rgb};

/// Viridis from its bright end: matplotlib's (CC0), eleven of its colours.
const VIRIDIS: [u32; 11] = [
    0xfde725, 0xbddf26, 0x7ad151, 0x44bf70, 0x22a884, 0x21918c, 0x2a788e, 0x355f8d, 0x414487,
    0x482475, 0x440154,
];

/// Viridis: 0 (near) is yellow, 1 (far) dark blue.
pub fn near_to_far(part: f64) -> [u8; 3] {
    between_stops(&VIRIDIS, part)
}

/// Interpolates between evenly spaced colours; a part beyond the ends takes the colour of the end.
pub fn between_stops(stops: &[u32], part: f64) -> [u8; 3] {
    let part = if part.is_nan() { 0.0 } else { part.clamp(0.0, 1.0) };
    let place = part * (stops.len() - 1) as f64;
    let from = (place as usize).min(stops.len() - 2);
    between(rgb(stops[from]), rgb(stops[from + 1]), place - from as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_out_of_range() {
        assert_eq!(near_to_far(0.0), [253, 231, 37]);
        assert_eq!(near_to_far(7.0), [68, 1, 84]);
        assert_eq!(between_stops(&[0x102030, 0xffffff], -1.0), [16, 32, 48]);
        assert_eq!(near_to_far(f64::NAN), near_to_far(0.0));
    }
}
