//! From pixels back to points: the k nearest neighbours of RangeNet++ (Milioto et al. 2019,
//! algorithm 1).
//!
//! A point that lies behind another in its pixel, or beside the border of an object, is given the
//! class that most of its neighbours have. Neighbours are the pixels of a window whose ranges
//! differ least from its own.
//!
//! Departures: pixels outside of the image are no neighbours (there they have range 0 and class 0),
//! and a point none of whose neighbours votes for a class has class 0 (there class 1).

use super::image::InputImage;
use super::knn_params::KnnParams;
use super::scores::{PixelScores, entropy};
use divmerge_core::geometry::statistics::most_voted;
use divmerge_core::range_image::NOWHERE;

/// The class of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ClassEstimate {
    /// Class number in the network's output.
    pub class: u16,
    /// Mean probability of the class among the neighbours that vote, 0 to 1.
    pub confidence: f32,
    /// Entropy of their mean distribution, 0 to 1.
    pub entropy: f32,
}

impl ClassEstimate {
    /// Of a point without a pixel.
    pub const UNKNOWN: Self = ClassEstimate { class: 0, confidence: 0.0, entropy: 1.0 };
}

/// N: the class of each point.
pub(super) fn classify(
    image: &InputImage,
    scores: &PixelScores,
    params: Option<&KnnParams>,
) -> Vec<ClassEstimate> {
    let mut votes = NeighbourVotes::new(image, scores, params);
    (0..image.pixel_of_point.len()).map(|point| votes.estimate(point)).collect()
}

/// The votes of the neighbours of one point after the other.
struct NeighbourVotes<'a> {
    image: &'a InputImage,
    scores: &'a PixelScores,
    params: Option<&'a KnnParams>,
    /// By place in the window.
    weights: Vec<f32>,
    /// H x W: the range seen in each pixel, infinite where there is none.
    seen: Vec<f32>,
    /// The nearest pixels in order. Each is the bits of the weighted difference of ranges, which
    /// are in the order of the differences, before the number of the pixel. Sorting these without
    /// branches takes half the time of sorting pairs.
    nearest: Vec<u64>,
    /// By class: the neighbours that vote for it.
    votes: Vec<u32>,
    /// By class: mean probability over the neighbours that vote.
    mean: Vec<f32>,
}

impl<'a> NeighbourVotes<'a> {
    fn new(image: &'a InputImage, scores: &'a PixelScores, params: Option<&'a KnnParams>) -> Self {
        NeighbourVotes {
            image,
            scores,
            params,
            weights: params.map_or(Vec::new(), KnnParams::weights),
            seen: ranges(image),
            nearest: vec![0; params.map_or(1, |params| params.neighbours)],
            votes: vec![0; scores.classes],
            mean: vec![0.0; scores.classes],
        }
    }

    fn estimate(&mut self, point: usize) -> ClassEstimate {
        let pixel = self.image.pixel_of_point[point];
        if pixel == NOWHERE {
            return ClassEstimate::UNKNOWN;
        }
        let voters = match self.params {
            None => {
                self.nearest[0] = u64::from(pixel);
                1
            }
            Some(params) => self.look_around(point, pixel as usize, params),
        };
        self.votes.fill(0);
        self.mean.fill(0.0);
        for &key in &self.nearest[..voters] {
            let pixel = key as u32 as usize;
            self.votes[usize::from(self.scores.best[pixel])] += 1;
            let shares = self.scores.of_pixel(pixel);
            self.mean.iter_mut().zip(shares).for_each(|(mean, share)| *mean += share);
        }
        let share = 1.0 / voters as f32;
        self.mean.iter_mut().for_each(|mean| *mean *= share);
        let class = winner(&self.votes);
        let confidence = self.mean[usize::from(class)].clamp(0.0, 1.0);
        ClassEstimate { class, confidence, entropy: entropy(&self.mean) }
    }

    /// Finds the neighbours, and how many of them vote: at least the point's own pixel.
    fn look_around(&mut self, point: usize, pixel: usize, params: &KnnParams) -> usize {
        let (columns, half) = (self.image.columns, params.search / 2);
        let (row, column) = (pixel / columns, pixel % columns);
        let own = self.image.range[point];
        let span = column.saturating_sub(half)..(column + half + 1).min(columns);
        self.nearest.fill(u64::MAX);
        for near_row in row.saturating_sub(half)..(row + half + 1).min(self.image.rows) {
            let place = (near_row + half - row) * params.search + span.start + half - column;
            let seen = &self.seen[near_row * columns..][span.clone()];
            let weights = &self.weights[place..][..span.len()];
            for (near, (seen, weight)) in
                (near_row * columns + span.start..).zip(seen.iter().zip(weights))
            {
                // The point itself stands in the middle, whoever is seen there.
                let away = if near == pixel { 0.0 } else { (seen - own).abs() * weight };
                let mut key = u64::from(away.to_bits()) << 32 | near as u64;
                for kept in &mut self.nearest {
                    (*kept, key) = ((*kept).min(key), (*kept).max(key));
                }
            }
        }
        let farthest = if params.cutoff > 0.0 { params.cutoff as f32 } else { f32::MAX };
        let limit = u64::from(farthest.to_bits()) << 32 | u64::from(u32::MAX);
        self.nearest.iter().take_while(|&&key| key <= limit).count()
    }
}

/// The range seen in each pixel, infinite where there is none.
fn ranges(image: &InputImage) -> Vec<f32> {
    let range = |&point: &u32| match point {
        NOWHERE => f32::INFINITY,
        point => image.range[point as usize],
    };
    image.point_of_pixel.iter().map(range).collect()
}

/// The class with most votes, of several the lowest; 0, "no class", only if no other has any.
fn winner(votes: &[u32]) -> u16 {
    let classes = (0_u16..).zip(votes).skip(1).filter(|&(_, &votes)| votes > 0);
    most_voted(classes).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of pixels with a range each, and points with a pixel and a range.
    fn image(seen: &[f32], points: &[(u32, f32)]) -> InputImage {
        let first = points.len() as u32;
        let seen_in =
            |(pixel, range): (u32, &f32)| if *range > 0.0 { first + pixel } else { NOWHERE };
        InputImage {
            rows: 1,
            columns: seen.len(),
            pixel_of_point: points
                .iter()
                .map(|point| point.0)
                .chain(0..seen.len() as u32)
                .collect(),
            point_of_pixel: (0..).zip(seen).map(seen_in).collect(),
            range: points.iter().map(|point| point.1).chain(seen.iter().copied()).collect(),
        }
    }

    /// Three classes, the one of each pixel with 0.8.
    fn scores(best: &[u16]) -> PixelScores {
        let shares = best
            .iter()
            .flat_map(|&best| (0..3).map(move |class| if class == best { 0.8 } else { 0.1 }));
        PixelScores { classes: 3, shares: shares.collect(), best: best.to_vec() }
    }

    #[test]
    fn a_point_behind_an_object_gets_the_class_of_those_beside_it_in_range() {
        // A pole 5 m off in front of a wall 20 m off; the point is behind the pole, in its pixel.
        let image = image(&[20.0, 20.1, 5.0, 20.0, 19.9], &[(2, 20.05)]);
        let found = classify(&image, &scores(&[2, 2, 1, 2, 2]), Some(&KnnParams::default()));
        // Its own pixel votes for the pole's class, four others for the wall's.
        assert_eq!(found[0].class, 2);
        assert!((found[0].confidence - (4.0 * 0.8 + 0.1) / 5.0).abs() < 1e-6, "{found:?}");
        let own = classify(&image, &scores(&[2, 2, 1, 2, 2]), None);
        assert_eq!((own[0].class, own[0].confidence), (1, 0.8));
    }

    #[test]
    fn what_is_too_far_does_not_vote_and_no_class_never_wins() {
        let image = image(&[9.0, 20.0, 5.0, 0.0, 30.0], &[(2, 5.0)]);
        let params = KnnParams::default();
        let alone = classify(&image, &scores(&[2, 2, 1, 2, 2]), Some(&params));
        assert_eq!((alone[0].class, alone[0].confidence), (1, 0.8));
        let nobody = classify(&image, &scores(&[2, 2, 0, 2, 2]), Some(&params));
        assert_eq!(nobody[0].class, 0);
        let all = KnnParams { cutoff: 0.0, ..params };
        assert_eq!(classify(&image, &scores(&[2, 2, 1, 2, 2]), Some(&all))[0].class, 2);
        assert_eq!(classify(&image, &scores(&[0, 0, 0, 0, 2]), Some(&all))[0].class, 2);
    }
}
