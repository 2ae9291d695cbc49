//! Quantiles, extents and round steps: the numbers behind axes, ramps and scale bars.

/// The value below which a share of the finite values lies; 0 if there is none.
pub fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    if values.is_empty() {
        return 0.0;
    }
    let place = ((values.len() - 1) as f64 * share).round() as usize;
    *values.select_nth_unstable_by(place, f64::total_cmp).1
}

/// The least and the greatest value; `None` if there is none.
pub fn extent(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values.fold(None, |ends, value| {
        let [low, high] = ends.unwrap_or([value; 2]);
        Some([low.min(value), high.max(value)])
    })
}

/// 1, 2, 5 and 10 times the greatest power of ten up to a length.
pub fn round_steps(length: f64) -> [f64; 4] {
    let power = 10_f64.powf(length.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|multiple| multiple * power)
}

/// Multiples of a step from the first not below `low` on, up to `high`.
pub fn steps([low, high]: [f64; 2], step: f64) -> impl Iterator<Item = f64> {
    let first = (low / step - 1e-9).ceil();
    let count = (high / step + 1e-9).floor() - first;
    (0..=count.max(0.0) as usize).map(move |tick| (first + tick as f64) * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_that_are_not_finite_have_no_quantile() {
        assert_eq!(quantile([3.0, f64::NAN, 1.0, 2.0].into_iter(), 0.5), 2.0);
        assert_eq!(quantile([f64::NAN].into_iter(), 0.5), 0.0);
    }

    #[test]
    fn extents_and_steps() {
        assert_eq!(extent([2.0, -1.0, 3.0].into_iter()), Some([-1.0, 3.0]));
        assert_eq!(extent(std::iter::empty()), None);
        assert_eq!(round_steps(64.0), [10.0, 20.0, 50.0, 100.0]);
    }
}
