//! Colour ramps for quantities.

/// Viridis from its bright end: 0 (near) yellow, 1 (far) dark blue. Matplotlib's (CC0), interpolated
/// between eleven of its colours.
pub fn near_to_far(part: f64) -> [u8; 3] {
    const VIRIDIS: [[u8; 3]; 11] = [
        [253, 231, 37],
        [189, 223, 38],
        [122, 209, 81],
        [68, 191, 112],
        [34, 168, 132],
        [33, 145, 140],
        [42, 120, 142],
        [53, 95, 141],
        [65, 68, 135],
        [72, 36, 117],
        [68, 1, 84],
    ];
    between_stops(&VIRIDIS, part)
}

/// Grey: 0 dark, but not as dark as a panel, 1 white.
pub fn grey(part: f64) -> [u8; 3] {
    between_stops(&[[38, 40, 46], [255, 255, 255]], part)
}

fn between_stops(stops: &[[u8; 3]], part: f64) -> [u8; 3] {
    let part = if part.is_nan() { 0.0 } else { part.clamp(0.0, 1.0) };
    let place = part * (stops.len() - 1) as f64;
    let from = (place as usize).min(stops.len() - 2);
    super::canvas::between(stops[from], stops[from + 1], place - from as f64)
}

/// The value below which a share of the finite values lies; 0 of none.
pub fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    if values.is_empty() {
        return 0.0;
    }
    let place = ((values.len() - 1) as f64 * share).round() as usize;
    *values.select_nth_unstable_by(place, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_out_of_range() {
        assert_eq!(near_to_far(0.0), [253, 231, 37]);
        assert_eq!(near_to_far(7.0), [68, 1, 84]);
        assert_eq!(grey(-1.0), grey(0.0));
        assert_eq!(near_to_far(f64::NAN), near_to_far(0.0));
        assert_eq!(quantile([3.0, f64::NAN, 1.0, 2.0].into_iter(), 0.5), 2.0);
    }
}
