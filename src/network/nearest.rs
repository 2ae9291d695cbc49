//! From pixels back to points: the k nearest neighbours of RangeNet++ (Milioto et al. 2019, algorithm 1).
//!
//! A point that lies behind another in its pixel, or beside the border of an object, is given the class that most of its
//! neighbours have, where neighbours are those pixels of a window whose ranges differ least from its own.
//!
//! Departures: pixels outside of the image are no neighbours (there they have range 0 and class 0), and a point none of whose
//! neighbours votes for a class has class 0 (there class 1).

use serde::Deserialize;

use super::picture::Picture;
use super::scores::Scores;
use crate::range_image::NOWHERE;

/// How neighbours are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct NearestParams {
    /// Neighbours that vote. Default: 5.
    #[serde(rename = "knn")]
    pub nearest: usize,
    /// Side of the square window in pixels, odd. Default: 5.
    pub search: usize,
    /// Standard deviation in pixels of the Gaussian by which pixels close by count as nearer. Default: 1.
    pub sigma: f64,
    /// Weighted difference of ranges in metres beyond which a neighbour does not vote; 0: none is too far. Default: 1.
    pub cutoff: f64,
}

impl Default for NearestParams {
    fn default() -> Self {
        NearestParams { nearest: 5, search: 5, sigma: 1.0, cutoff: 1.0 }
    }
}

/// Most pixels on a side of the window.
const WIDEST: usize = 31;

impl NearestParams {
    /// Refuses what makes no sense.
    pub(super) fn checked(self) -> Result<Self, String> {
        let NearestParams { nearest, search, sigma, cutoff } = self;
        if search.is_multiple_of(2) || search > WIDEST {
            return Err(format!("KNN: `search` is {search}; it is odd, and at most {WIDEST}"));
        }
        if !(1..=search * search).contains(&nearest) {
            return Err(format!(
                "KNN: `knn` is {nearest}; 1 to {} fit the window",
                search * search
            ));
        }
        if !(sigma > 0.0 && sigma.is_finite() && cutoff >= 0.0) {
            return Err(format!("KNN: `sigma` is {sigma} and `cutoff` {cutoff}"));
        }
        Ok(self)
    }

    /// One less the Gaussian, whose values over the window sum to 1, for each pixel of the window.
    fn weights(&self) -> Vec<f32> {
        let half = (self.search / 2) as f64;
        let offsets = || (0..self.search).map(move |i| i as f64 - half);
        let bell = |squared: f64| (-squared / (2.0 * self.sigma * self.sigma)).exp();
        let gauss: Vec<f64> =
            offsets().flat_map(|y| offsets().map(move |x| bell(x * x + y * y))).collect();
        let sum: f64 = gauss.iter().sum();
        gauss.into_iter().map(|value| (1.0 - value / sum) as f32).collect()
    }
}

/// Class number, confidence and entropy of a point.
pub(super) type Verdict = (u16, f32, f32);

/// Where nothing is known.
pub(super) const NOTHING: Verdict = (0, 0.0, 1.0);

/// The class of each of N points, how sure it is, and the entropy: the mean distribution of the neighbours that vote.
/// Of points without a pixel [`NOTHING`] is known.
pub(super) fn classify(
    picture: &Picture,
    scores: &Scores,
    params: Option<&NearestParams>,
) -> Vec<Verdict> {
    let mut voters = Voters::new(picture, scores, params);
    (0..picture.pixel_of_point.len()).map(|point| voters.verdict(point)).collect()
}

struct Voters<'a> {
    picture: &'a Picture,
    scores: &'a Scores,
    params: Option<&'a NearestParams>,
    /// By place in the window.
    weights: Vec<f32>,
    /// H x W: the range seen in each pixel, infinite where there is none.
    seen: Vec<f32>,
    /// The nearest pixels in order: the bits of the weighted difference of ranges, which are ordered as it is, in front of the
    /// number of the pixel. Without branches this takes half the time of pairs that are put in their places.
    nearest: Vec<u64>,
    /// By class.
    votes: Vec<u32>,
    mean: Vec<f32>,
}

impl<'a> Voters<'a> {
    fn new(picture: &'a Picture, scores: &'a Scores, params: Option<&'a NearestParams>) -> Self {
        Voters {
            picture,
            scores,
            params,
            weights: params.map_or(Vec::new(), NearestParams::weights),
            seen: ranges(picture),
            nearest: vec![0; params.map_or(1, |params| params.nearest)],
            votes: vec![0; scores.classes],
            mean: vec![0.0; scores.classes],
        }
    }

    fn verdict(&mut self, point: usize) -> Verdict {
        let pixel = self.picture.pixel_of_point[point];
        if pixel == NOWHERE {
            return NOTHING;
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
        let class = most(&self.votes);
        (class, self.mean[usize::from(class)].clamp(0.0, 1.0), entropy(&self.mean))
    }

    /// Finds the neighbours, and how many of them vote: at least the point's own pixel.
    fn look_around(&mut self, point: usize, pixel: usize, params: &NearestParams) -> usize {
        let (columns, half) = (self.picture.columns, params.search / 2);
        let (row, column) = (pixel / columns, pixel % columns);
        let own = self.picture.range[point];
        let span = column.saturating_sub(half)..(column + half + 1).min(columns);
        self.nearest.fill(u64::MAX);
        for near_row in row.saturating_sub(half)..(row + half + 1).min(self.picture.rows) {
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
fn ranges(picture: &Picture) -> Vec<f32> {
    let range = |&point: &u32| match point {
        NOWHERE => f32::INFINITY,
        point => picture.range[point as usize],
    };
    picture.point_of_pixel.iter().map(range).collect()
}

/// The class with most votes, of several the lowest; 0, "no class", only where no other has any.
fn most(votes: &[u32]) -> u16 {
    let best = votes.iter().enumerate().skip(1).filter(|&(_, &votes)| votes > 0);
    best.reduce(|best, next| if next.1 > best.1 { next } else { best })
        .map_or(0, |(class, _)| class as u16)
}

/// Entropy of a distribution, as a share of the most that one over so many classes can have.
pub(super) fn entropy(shares: &[f32]) -> f32 {
    let nats: f32 =
        shares.iter().filter(|&&share| share > 0.0).map(|share| -share * share.ln()).sum();
    match shares.len() {
        0 | 1 => 0.0,
        classes => (nats / (classes as f32).ln()).clamp(0.0, 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of pixels with a range each, and points with a pixel and a range.
    fn picture(seen: &[f32], points: &[(u32, f32)]) -> Picture {
        let first = points.len() as u32;
        let seen_in =
            |(pixel, range): (u32, &f32)| if *range > 0.0 { first + pixel } else { NOWHERE };
        Picture {
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
    fn scores(best: &[u16]) -> Scores {
        let shares = best
            .iter()
            .flat_map(|&best| (0..3).map(move |class| if class == best { 0.8 } else { 0.1 }));
        Scores { classes: 3, shares: shares.collect(), best: best.to_vec() }
    }

    #[test]
    fn a_point_behind_an_object_gets_the_class_of_those_beside_it_in_range() {
        // A pole 5 m off in front of a wall 20 m off; the point is behind the pole, in its pixel.
        let picture = picture(&[20.0, 20.1, 5.0, 20.0, 19.9], &[(2, 20.05)]);
        let found = classify(&picture, &scores(&[2, 2, 1, 2, 2]), Some(&NearestParams::default()));
        // Its own pixel votes for the pole's class, four others for the wall's.
        assert_eq!(found[0].0, 2);
        assert!((found[0].1 - (4.0 * 0.8 + 0.1) / 5.0).abs() < 1e-6, "{found:?}");
        let own = classify(&picture, &scores(&[2, 2, 1, 2, 2]), None);
        assert_eq!((own[0].0, own[0].1), (1, 0.8));
    }

    #[test]
    fn what_is_too_far_does_not_vote_and_no_class_never_wins() {
        let picture = picture(&[9.0, 20.0, 5.0, 0.0, 30.0], &[(2, 5.0)]);
        let nearest = NearestParams::default();
        let alone = classify(&picture, &scores(&[2, 2, 1, 2, 2]), Some(&nearest));
        assert_eq!((alone[0].0, alone[0].1), (1, 0.8));
        let nobody = classify(&picture, &scores(&[2, 2, 0, 2, 2]), Some(&nearest));
        assert_eq!(nobody[0].0, 0);
        let all = NearestParams { cutoff: 0.0, ..nearest };
        assert_eq!(classify(&picture, &scores(&[2, 2, 1, 2, 2]), Some(&all))[0].0, 2);
        assert_eq!(classify(&picture, &scores(&[0, 0, 0, 0, 2]), Some(&all))[0].0, 2);
    }

    #[test]
    fn entropy_is_a_share_of_the_most() {
        assert_eq!(entropy(&[1.0, 0.0, 0.0]), 0.0);
        assert!((entropy(&[1.0 / 3.0; 3]) - 1.0).abs() < 1e-6);
        assert_eq!(entropy(&[1.0]), 0.0);
    }

    #[test]
    fn the_gaussian_sums_to_one() {
        let sum: f32 = NearestParams::default().weights().iter().map(|weight| 1.0 - weight).sum();
        assert!((sum - 1.0).abs() < 1e-5);
    }
}
