//! How likely a node of the cut is one of the body that it looks like most.
//!
//! Scores compare the nodes of one tree. They are no probabilities: on labelled drives most nodes
//! with a score of 0.6 are pieces of bushes and walls. A score does not tell leaves from surfaces,
//! so it is multiplied by how smooth the node is; the product is the *evidence*. For each body, a
//! logistic curve takes the evidence to a probability, which never falls as evidence rises.
//!
//! The curves were fitted to labelled drives by `examples/12_coarse_classes.rs`, which also
//! measures how far they are off on drives that they were not fitted to.

use super::score::Score;
use crate::cloud::Body;

/// The probability that a node is of the body of its score, given how smooth it is, 0 to 1
/// ([`ShapeMeasures::smoothness`](crate::cloud::shape::ShapeMeasures::smoothness)).
pub fn probability(score: &Score, smoothness: f64) -> f64 {
    let [without, with] = log_odds(score.body);
    let log_odds = without + (with - without) * evidence(score, smoothness);
    1.0 / (1.0 + (-log_odds).exp())
}

/// What the probability is a function of, 0 to 1.
pub fn evidence(score: &Score, smoothness: f64) -> f64 {
    score.total * smoothness
}

/// Logarithm of the odds without evidence and with full evidence; between them it is linear.
fn log_odds(body: Body) -> [f64; 2] {
    match body {
        Body::Car => [-4.410, 2.207],
        Body::Person => [-5.060, -0.484],
        // One of 474 nodes was a two-wheeler: no slope can be told from that.
        Body::TwoWheeler => [-6.159, -6.159],
        Body::LargeVehicle => [-4.535, -0.765],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn score(body: Body, total: f64) -> Score {
        let full = 1.0;
        Score {
            body,
            total,
            size: full,
            isolation: full,
            wholeness: full,
            standing: full,
            filled: full,
        }
    }

    #[test]
    fn more_evidence_is_never_less_likely() {
        for body in Body::ALL {
            let of = |step: i32| probability(&score(body, f64::from(step) / 10.0), 0.9);
            let all: Vec<f64> = (0..=10).map(of).collect();
            assert!(all.is_sorted() && all[0] > 0.0 && all[10] < 1.0, "{body:?}: {all:?}");
        }
    }

    #[test]
    fn leaves_of_the_size_of_a_car_are_hardly_a_car() {
        let car = score(Body::Car, 0.9);
        assert!(probability(&car, 1.0) > 0.5 && probability(&car, 0.1) < 0.1);
    }
}
