//! Streams of random numbers that do not depend on what was drawn before them.

use rand::RngExt;
use rand_pcg::Pcg32;

/// What a stream is drawn for; streams of different purposes are unrelated.
#[derive(Debug, Clone, Copy)]
pub(super) enum Purpose {
    /// Slopes of the ground.
    Ground = 1,
    /// What stands on a tile of a layer.
    Tile = 2,
    /// Noise and chance of one column of one frame.
    Column = 3,
    /// Second returns of one column of one frame.
    Edge = 4,
    /// Those who move along ways of their own.
    Actors = 5,
}

/// The stream of `seed` for a purpose and two numbers, such as frame and column.
pub(super) fn stream(seed: u64, purpose: Purpose, first: u64, second: u64) -> Pcg32 {
    let state = [purpose as u64, first, second]
        .into_iter()
        .fold(mix(seed), |state, number| mix(state ^ mix(number)));
    Pcg32::new(state, mix(state))
}

/// A bijection of 64 bits in which every input bit reaches every output bit: add a constant, then
/// multiply and fold the upper half down, three times.
fn mix(value: u64) -> u64 {
    const ODD: [u64; 3] = [0xD6E8_FEB8_6659_FD93, 0xA3EC_6476_59F3_57AB, 0xC2B2_AE3D_27D4_EB4F];
    ODD.iter().fold(value.wrapping_add(0x632B_E59B_D9B4_E019), |value, &odd| {
        let product = value.wrapping_mul(odd);
        product ^ (product >> 32)
    })
}

/// A sample of the normal distribution with mean 0 and deviation 1 (Box and Muller).
pub(super) fn normal(rng: &mut Pcg32) -> f64 {
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    radius * (std::f64::consts::TAU * rng.random::<f64>()).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_by_each_number() {
        let draw = |seed, a, b| stream(seed, Purpose::Tile, a, b).random::<u64>();
        let draws = [draw(0, 0, 0), draw(1, 0, 0), draw(0, 1, 0), draw(0, 0, 1)];
        for (i, first) in draws.iter().enumerate() {
            assert!(draws[i + 1..].iter().all(|second| second != first));
        }
        assert_eq!(draw(7, 8, 9), draw(7, 8, 9));
    }

    #[test]
    fn normal_has_unit_deviation() {
        let mut rng = stream(0, Purpose::Column, 0, 0);
        let samples: Vec<f64> = (0..10_000).map(|_| normal(&mut rng)).collect();
        let mean = samples.iter().sum::<f64>() / 1e4;
        let variance = samples.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / 1e4;
        assert!(mean.abs() < 0.05 && (variance - 1.0).abs() < 0.05, "{mean} {variance}");
    }
}
