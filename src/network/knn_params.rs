//! Which pixels are the neighbours of a point.

use serde::Deserialize;

/// How neighbours are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct KnnParams {
    /// Neighbours that vote. Default: 5.
    #[serde(rename = "knn")]
    pub neighbours: usize,
    /// Side of the square window in pixels, odd. Default: 5.
    pub search: usize,
    /// Standard deviation in pixels of the Gaussian by which pixels close by count as nearer.
    /// Default: 1.
    pub sigma: f64,
    /// Weighted difference of ranges in metres beyond which a neighbour does not vote; 0: none is
    /// too far. Default: 1.
    pub cutoff: f64,
}

impl Default for KnnParams {
    fn default() -> Self {
        KnnParams { neighbours: 5, search: 5, sigma: 1.0, cutoff: 1.0 }
    }
}

/// Most pixels on a side of the window.
const WIDEST: usize = 31;

impl KnnParams {
    /// Refuses values out of their limits.
    pub(super) fn checked(self) -> Result<Self, String> {
        let KnnParams { neighbours, search, sigma, cutoff } = self;
        if search.is_multiple_of(2) || search > WIDEST {
            return Err(format!("KNN: `search` is {search}; it is odd, and at most {WIDEST}"));
        }
        if !(1..=search * search).contains(&neighbours) {
            return Err(format!(
                "KNN: `knn` is {neighbours}; 1 to {} fit the window",
                search * search
            ));
        }
        if !(sigma > 0.0 && sigma.is_finite() && cutoff >= 0.0) {
            return Err(format!("KNN: `sigma` is {sigma} and `cutoff` {cutoff}"));
        }
        Ok(self)
    }

    /// One less the Gaussian, whose values over the window sum to 1, for each pixel of the window.
    pub(super) fn weights(&self) -> Vec<f32> {
        let half = (self.search / 2) as f64;
        let offsets = || (0..self.search).map(move |i| i as f64 - half);
        let bell = |squared: f64| (-squared / (2.0 * self.sigma * self.sigma)).exp();
        let gauss: Vec<f64> =
            offsets().flat_map(|y| offsets().map(move |x| bell(x * x + y * y))).collect();
        let sum: f64 = gauss.iter().sum();
        gauss.into_iter().map(|value| (1.0 - value / sum) as f32).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gaussian_sums_to_one() {
        let sum: f32 = KnnParams::default().weights().iter().map(|weight| 1.0 - weight).sum();
        assert!((sum - 1.0).abs() < 1e-5);
    }
}
