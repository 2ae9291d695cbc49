//! Seeds: the first object pixel of every voxel (ALGORITHM section 4).

use rustc_hash::FxHashSet;

use crate::cloud::point_cloud::wide;
use crate::cluster::objects::ObjectPixels;
use crate::cluster::params::{ClusterParams, Rounding};

/// The seeds in row-major order, as object pixel numbers: seed k carries label k + 1. Where
/// neighbours must be of one class, so must the pixels of a voxel.
pub fn seeds(objects: &ObjectPixels, params: &ClusterParams) -> Vec<u32> {
    let mut taken = Voxels::with_capacity(objects.len() / 8);
    let mut seeds = Vec::new();
    // Most pixels lie in the voxel of the one before them.
    let mut before = None;
    for (object, &position) in (0_u32..).zip(&objects.position) {
        let class = if params.same_class_neighbours { objects.family[object as usize] } else { 0 };
        let [x, y, z] = voxel(position, params);
        let place = (x, y, z, class);
        if before != Some(place) && taken.insert(place) {
            seeds.push(object);
        }
        before = Some(place);
    }
    seeds
}

/// A set of voxels, each with a class.
struct Voxels {
    /// Those whose numbers have 16 bits, which nearly all have, in one number each.
    near: FxHashSet<u64>,
    far: FxHashSet<(i64, i64, i64, u16)>,
}

impl Voxels {
    fn with_capacity(near: usize) -> Self {
        Voxels {
            near: FxHashSet::with_capacity_and_hasher(near, Default::default()),
            far: FxHashSet::default(),
        }
    }

    /// Adds a voxel; whether it was not there.
    fn insert(&mut self, place: (i64, i64, i64, u16)) -> bool {
        let (x, y, z, class) = place;
        match [x, y, z].map(i16::try_from) {
            [Ok(x), Ok(y), Ok(z)] => {
                let [x, y, z] = [x, y, z].map(|part| u64::from(part as u16));
                self.near.insert(x << 48 | y << 32 | z << 16 | u64::from(class))
            }
            _ => self.far.insert(place),
        }
    }
}

fn voxel(position: [f32; 3], params: &ClusterParams) -> [i64; 3] {
    let cells = wide(position).map(|coordinate| coordinate / params.voxel);
    match params.rounding {
        Rounding::Floor => cells.map(floor),
        Rounding::Nearest => cells.map(|cells| cells.round() as i64),
    }
}

/// The largest integer not above a number, without a call; numbers beyond the integers give the
/// last of them.
#[inline]
fn floor(x: f64) -> i64 {
    let truncated = x as i64;
    truncated.saturating_sub(i64::from(truncated as f64 > x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_far_and_near_are_all_different() {
        let numbers = [0, 1, -1, 32_767, 32_768, -32_768, -32_769, 1 << 40, i64::MIN];
        let places =
            numbers.iter().flat_map(|&x| numbers.map(|y| [0, 7].map(|class| (x, y, x, class))));
        let places: Vec<_> = places.flatten().collect();
        let mut voxels = Voxels::with_capacity(0);
        assert!(places.iter().all(|&place| voxels.insert(place)));
        assert!(!places.iter().any(|&place| voxels.insert(place)));
    }

    #[test]
    fn floor_is_the_library_s() {
        let odd = [0.0, 0.5, 1.0, 1.5, 1e-300, 4e9, 1e15 + 0.5, 9e18, 1e19, 1e300];
        for x in odd.into_iter().flat_map(|x: f64| [x, -x, x.next_up(), -x.next_up()]) {
            assert_eq!(floor(x), x.floor() as i64, "{x}");
        }
        assert_eq!(floor(f64::INFINITY), i64::MAX);
        assert_eq!(floor(f64::NEG_INFINITY), i64::MIN);
    }
}
