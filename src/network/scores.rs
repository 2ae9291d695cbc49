//! The output of a network: a distribution over its classes for each pixel of an image.

use divmerge_core::cloud::PointClasses;
use divmerge_core::geometry::statistics::most_voted;

/// Probabilities of C classes in H x W pixels.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct PixelScores {
    /// Classes C.
    pub classes: usize,
    /// H x W x C: the probability of each class, pixel by pixel.
    pub shares: Vec<f32>,
    /// H x W: the class of highest probability, of several the lowest.
    pub best: Vec<u16>,
}

/// How far sums of probabilities may be from 1.
const SUM_WITHIN: f32 = 1e-2;

impl PixelScores {
    /// From the output of a network for one image, C x H x W. Values that are probabilities at
    /// every pixel (none below 0, all summing to 1) are taken as they are. Others are taken for
    /// logits: a softmax makes them probabilities.
    ///
    /// # Errors
    /// The first value that is no number.
    pub fn of_output(values: &[f32], classes: usize) -> Result<Self, f32> {
        let pixels = values.len() / classes.max(1);
        let mut shares = vec![0.0; values.len()];
        for (class, plane) in values.chunks_exact(pixels.max(1)).enumerate() {
            for (to, &value) in shares.iter_mut().skip(class).step_by(classes).zip(plane) {
                *to = value;
            }
        }
        Self::of_pixels(shares, classes)
    }

    /// From values that lie pixel by pixel, H x W x C; see [`of_output`](Self::of_output).
    pub fn of_pixels(mut shares: Vec<f32>, classes: usize) -> Result<Self, f32> {
        if let Some(&odd) = shares.iter().find(|value| value.is_nan() || **value == f32::INFINITY) {
            return Err(odd);
        }
        let is_distribution = |pixel: &[f32]| {
            pixel.iter().all(|&share| share >= 0.0)
                && (pixel.iter().sum::<f32>() - 1.0).abs() < SUM_WITHIN
        };
        if !shares.chunks_exact(classes).all(is_distribution) {
            shares.chunks_exact_mut(classes).for_each(softmax);
        }
        let best = shares.chunks_exact(classes).map(highest).collect();
        Ok(PixelScores { classes, shares, best })
    }

    /// The distribution at a pixel.
    pub fn of_pixel(&self, pixel: usize) -> &[f32] {
        &self.shares[pixel * self.classes..][..self.classes]
    }
}

fn softmax(values: &mut [f32]) {
    let most = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    if most == f32::NEG_INFINITY {
        values.fill(1.0 / values.len() as f32);
        return;
    }
    let mut sum = 0.0;
    for value in values.iter_mut() {
        *value = (*value - most).exp();
        sum += *value;
    }
    values.iter_mut().for_each(|value| *value /= sum);
}

fn highest(shares: &[f32]) -> u16 {
    most_voted((0_u16..).zip(shares)).unwrap_or(0)
}

/// Entropy of a distribution, as a share of the greatest that one over so many classes can have.
pub(super) fn entropy(shares: &[f32]) -> f32 {
    let nats: f32 =
        shares.iter().filter(|&&share| share > 0.0).map(|share| -share * share.ln()).sum();
    match shares.len() {
        0 | 1 => 0.0,
        classes => (nats / (classes as f32).ln()).clamp(0.0, 1.0),
    }
}

/// Class numbers, confidence and entropy from N x C scores, point by point: probabilities or
/// logits.
///
/// # Errors
/// The first score that is no number.
pub(crate) fn distributions(
    scores: &[f32],
    classes: usize,
) -> std::result::Result<PointClasses, f32> {
    let scores = PixelScores::of_pixels(scores.to_vec(), classes)?;
    let shares = || scores.shares.chunks_exact(classes);
    Ok(PointClasses {
        confidence: Some(
            shares().zip(&scores.best).map(|(shares, &best)| shares[usize::from(best)]).collect(),
        ),
        entropy: Some(shares().map(entropy).collect()),
        class: scores.best,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_stay_and_logits_become_some() {
        let given = PixelScores::of_output(&[0.25, 0.5, 0.75, 0.5], 2).unwrap();
        assert_eq!(given.shares, [0.25, 0.75, 0.5, 0.5]);
        assert_eq!(given.best, [1, 0]);
        let logits = PixelScores::of_output(&[0.0, 3.0, 0.0, f32::NEG_INFINITY], 2).unwrap();
        assert_eq!(logits.of_pixel(0), [0.5, 0.5]);
        assert_eq!(logits.of_pixel(1), [1.0, 0.0]);
        let logarithms: Vec<f32> = given.shares.iter().map(|share| share.ln()).collect();
        let planes = [logarithms[0], logarithms[2], logarithms[1], logarithms[3]];
        let back = PixelScores::of_output(&planes, 2).unwrap();
        assert!(back.shares.iter().zip(&given.shares).all(|(a, b)| (a - b).abs() < 1e-6));
    }

    #[test]
    fn what_is_no_number_is_refused() {
        assert!(PixelScores::of_output(&[0.0, f32::NAN], 2).unwrap_err().is_nan());
        assert_eq!(PixelScores::of_output(&[f32::INFINITY, 0.0], 2), Err(f32::INFINITY));
        assert_eq!(PixelScores::of_output(&[f32::NEG_INFINITY; 2], 2).unwrap().shares, [0.5; 2]);
    }

    #[test]
    fn entropy_is_a_share_of_the_most() {
        assert_eq!(entropy(&[1.0, 0.0, 0.0]), 0.0);
        assert!((entropy(&[1.0 / 3.0; 3]) - 1.0).abs() < 1e-6);
        assert_eq!(entropy(&[1.0]), 0.0);
    }

    #[test]
    fn probabilities_and_logits_of_points() {
        let found = distributions(&[0.1, 0.9, 5.0, -5.0], 2).unwrap();
        assert_eq!(found.class, [1, 0]);
        assert!(found.confidence.unwrap()[1] > 0.999);
        assert!(distributions(&[f32::NAN; 2], 2).is_err());
    }
}
