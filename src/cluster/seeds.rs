//! Seeds: the first object pixel of every voxel (ALGORITHM section 4).

use rustc_hash::FxHashSet;

use super::objects::ObjectPixels;
use super::params::{ClusterParams, Rounding};

/// The seeds in row-major order, as object pixel numbers: seed k carries label k + 1. Where neighbours
/// must be of one class, so must the pixels of a voxel.
pub fn seeds(objects: &ObjectPixels, params: &ClusterParams) -> Vec<u32> {
    let mut taken = FxHashSet::with_capacity_and_hasher(objects.len() / 4, Default::default());
    let class = |object: usize| {
        if params.same_class_neighbours { objects.family[object] } else { 0 }
    };
    (0..objects.len())
        .filter(|&object| taken.insert((voxel(objects.position[object], params), class(object))))
        .map(|object| object as u32)
        .collect()
}

fn voxel(position: [f32; 3], params: &ClusterParams) -> [i64; 3] {
    position.map(|coordinate| {
        let cells = f64::from(coordinate) / params.voxel;
        match params.rounding {
            Rounding::Floor => cells.floor() as i64,
            Rounding::Nearest => cells.round() as i64,
        }
    })
}
