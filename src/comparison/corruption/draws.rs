//! Random numbers by a seed: each purpose has a stream of its own.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use rustc_hash::FxHashMap;

use divmerge_core::cloud::PointCloud;

/// What a stream of random numbers is drawn for.
#[derive(Clone, Copy)]
pub(super) enum Purpose {
    Border = 1,
    People = 2,
    Flicker = 3,
    Dropped = 4,
    Inner = 5,
    Similar = 6,
    Ghosts = 7,
    Confidence = 8,
}

/// An odd number that spreads bits (2^64 over the golden ratio).
const APART: u64 = 0x9E37_79B9_7F4A_7C15;

pub(super) fn stream(seed: u64, purpose: Purpose) -> Pcg32 {
    Pcg32::seed_from_u64(seed ^ APART.wrapping_mul(purpose as u64))
}

/// A draw from 0 to 1 for each of N points.
pub(super) fn point_draws(count: usize, seed: u64, purpose: Purpose) -> Vec<f64> {
    let mut draw = stream(seed, purpose);
    (0..count).map(|_| draw.random()).collect()
}

/// A draw from 0 to 1 for each of N points, the same for all points of a cube of that side in
/// metres.
pub(super) fn patch_draws(cloud: &PointCloud, side: f64, seed: u64, purpose: Purpose) -> Vec<f64> {
    let cube =
        |point: usize| cloud.position(point).map(|along| (f64::from(along) / side).floor() as i32);
    let draw = |[x, y, z]: [i32; 3]| {
        let place = [x, y, z].iter().fold(seed, |mixed, &along| {
            mixed.wrapping_mul(APART).rotate_left(23) ^ u64::from(along as u32)
        });
        stream(place, purpose).random()
    };
    let mut known: FxHashMap<[i32; 3], f64> = FxHashMap::default();
    (0..cloud.len())
        .map(|point| *known.entry(cube(point)).or_insert_with_key(|at| draw(*at)))
        .collect()
}
