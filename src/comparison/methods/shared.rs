//! What several methods have in common.

use divmerge_core::cluster::back_projection::BackProjector;
use divmerge_core::cluster::{ClusterParams, MethodInput, ObjectPixels, Segmentation};

/// Clusters the object points class by class. `cluster` gets a class number and n positions in
/// metres, sensor frame, and returns n cluster numbers from 1, or 0 for what is in none.
pub(super) fn per_class(
    input: &MethodInput,
    cluster: impl Fn(u16, &[[f64; 3]]) -> Vec<u32>,
) -> Segmentation {
    let MethodInput { cloud, mask, .. } = *input;
    let mut objects: Vec<usize> = (0..cloud.len()).filter(|&p| mask.is_object[p]).collect();
    objects.sort_by_key(|&point| mask.class[point]);
    let mut instance = vec![0; cloud.len()];
    let mut before = 0;
    for points in objects.chunk_by(|&a, &b| mask.class[a] == mask.class[b]) {
        let positions = points.iter().map(|&point| cloud.position(point).map(f64::from));
        let found = cluster(mask.class[points[0]], &positions.collect::<Vec<_>>());
        for (&point, &cluster) in points.iter().zip(&found).filter(|&(_, &cluster)| cluster != 0) {
            instance[point] = before + cluster;
        }
        before += found.iter().max().copied().unwrap_or(0);
    }
    Segmentation::of_points(instance, input)
}

/// A cell of a grid in space: whole numbers, however far away.
pub(super) type Cell = [f64; 3];

/// The cell of cubes with a side that a position is in.
pub(super) fn cell_of(position: [f64; 3], side: f64) -> Cell {
    position.map(|along| (along / side).floor())
}

/// A cell some steps away.
pub(super) fn stepped(cell: Cell, steps: [i8; 3]) -> Cell {
    [0, 1, 2].map(|axis| cell[axis] + f64::from(steps[axis]))
}

/// A cell as the key of a table; both zeros are one.
pub(super) fn key_of(cell: Cell) -> [u64; 3] {
    cell.map(|along| (along + 0.0).to_bits())
}

/// The object pixels of a range image, their neighbours of the same class, and the angle condition
/// of the paper between them, for an angle in radians.
pub(super) fn object_pixels(input: &MethodInput, angle: f64) -> ObjectPixels {
    let mut params = ClusterParams { same_class_neighbours: true, ..ClusterParams::paper() };
    params.condition.angle = angle;
    ObjectPixels::new(input.cloud, input.image, input.mask, &params)
}

/// From the instances of the M object pixels to those of the N points: a shadowed point takes that
/// of the nearest pixel of its class in the window of the back-projection.
pub(super) fn to_points(
    input: &MethodInput,
    objects: &ObjectPixels,
    instance: &[u32],
) -> Segmentation {
    let input_of_pixels = MethodInput { objects, ..*input };
    let pixels = BackProjector::new(&input_of_pixels);
    let of_point = |point| pixels.source(point).map_or(0, |object| instance[object]);
    Segmentation::of_points((0..input.cloud.len()).map(of_point).collect(), input)
}
