//! Supervoxels: voxel cloud connectivity segmentation (Papon, Abramov, Schoeler and Woergoetter
//! 2013).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use divmerge_core::cluster::{Method, MethodInput, Segmentation};
use nalgebra::{Matrix3, Vector3};
use rustc_hash::FxHashMap;

use super::shared::{Cell, cell_of, key_of, per_class, stepped};

/// Seeds on a coarse grid of voxels grow over occupied neighbours, ring by ring; a voxel belongs to
/// the supervoxel that is nearest by position and normal. Class by class.
///
/// The distance of a voxel from a supervoxel is sqrt(w_s d^2 / (3 R^2) + w_n (1 - |n . n'|)^2) with
/// the distance d of their centroids and the seeds' grid R (eq. 3 of the paper, of whose features
/// colour is absent in a LiDAR and the histogram of normals is the normal itself). Seeds with less
/// around them than half a plane would leave are left out, as in the paper; what no seed reaches
/// has no instance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Supervoxel {
    /// Side of a voxel, metres. Default 0.5 (Zhao, Zhang and Huang's survey, arXiv 2108.09522, as
    /// the next ones).
    #[schemars(range(min = 0.01, max = 100.0), extend("unit" = "m", "slider" = [0.1, 2.0]))]
    #[schemars(extend("source" = "Zhao, Zhang and Huang 2021, arXiv 2108.09522"))]
    pub voxel: f64,
    /// Grid of the seeds, metres. Default 8.
    #[schemars(range(min = 0.01, max = 1000.0), extend("unit" = "m", "slider" = [0.5, 20.0]))]
    #[schemars(extend("source" = "Zhao, Zhang and Huang 2021, arXiv 2108.09522"))]
    pub seeds: f64,
    /// Weight of the position. Default 1.
    #[schemars(range(min = 0.0), extend("slider" = [0.0, 2.0]))]
    #[schemars(extend("source" = "Zhao, Zhang and Huang 2021, arXiv 2108.09522"))]
    pub spatial_weight: f64,
    /// Weight of the normal. Default 0.
    #[schemars(range(min = 0.0), extend("slider" = [0.0, 2.0]))]
    #[schemars(extend("source" = "Zhao, Zhang and Huang 2021, arXiv 2108.09522"))]
    pub normal_weight: f64,
}

impl Default for Supervoxel {
    fn default() -> Self {
        Supervoxel { voxel: 0.5, seeds: 8.0, spatial_weight: 1.0, normal_weight: 0.0 }
    }
}

impl Method for Supervoxel {
    fn name(&self) -> &'static str {
        "supervoxel"
    }

    parameters_are_fields!();

    fn segment(&self, input: &MethodInput) -> Segmentation {
        per_class(input, |_, points| {
            let voxels = Voxels::new(points, self.voxel);
            let of_voxel = self.grow(&voxels, &self.seed(&voxels));
            voxels.of_point.iter().map(|&voxel| of_voxel[voxel as usize]).collect()
        })
    }
}

impl Supervoxel {
    /// In each cell of the seeds' grid, which begins at the lowest corner, the voxel nearest to its
    /// centre, if enough voxels are around it.
    fn seed(&self, voxels: &Voxels) -> Vec<usize> {
        let Some(corner) = voxels.centroid.iter().copied().reduce(|a, b| a.inf(&b)) else {
            return Vec::new();
        };
        let cell = |at: &Vector3<f64>| ((at - corner) / self.seeds).map(f64::floor);
        let off_centre = |voxel: usize| {
            let at = &voxels.centroid[voxel];
            (at - corner - (cell(at).add_scalar(0.5) * self.seeds)).norm_squared()
        };
        let mut nearest: FxHashMap<[u64; 3], usize> = FxHashMap::default();
        for voxel in 0..voxels.centroid.len() {
            let key = key_of(cell(&voxels.centroid[voxel]).into());
            let best = nearest.entry(key).or_insert(voxel);
            if off_centre(voxel) < off_centre(*best) {
                *best = voxel;
            }
        }
        let mut seeds: Vec<usize> = nearest.into_values().collect();
        seeds.sort_unstable();
        // A plane through half of the search volume, whose radius is half the seeds' grid.
        let radius = self.seeds / 2.0;
        let least = PLANE_SHARE * std::f64::consts::PI * (radius / self.voxel).powi(2);
        seeds.retain(|&seed| voxels.around(seed, radius) as f64 > least);
        seeds
    }

    /// The supervoxel of each voxel from 1, or 0. Ring by ring each supervoxel offers itself to the
    /// neighbours of its voxels, which take the nearest; then its centroid and normal are those of
    /// its voxels.
    fn grow(&self, voxels: &Voxels, seeds: &[usize]) -> Vec<u32> {
        let mut owner = vec![0_u32; voxels.centroid.len()];
        let mut distance = vec![f64::INFINITY; owner.len()];
        let mut centre: Vec<(Vector3<f64>, Vector3<f64>)> =
            seeds.iter().map(|&seed| (voxels.centroid[seed], voxels.normal[seed])).collect();
        for (&seed, number) in seeds.iter().zip(1..) {
            owner[seed] = number;
            distance[seed] = 0.0;
        }
        let rings = (REACH * self.seeds / self.voxel).ceil() as usize;
        for _ in 0..rings {
            let before = owner.clone();
            for (voxel, &number) in before.iter().enumerate().filter(|&(_, &number)| number != 0) {
                for &other in &voxels.neighbours[voxel] {
                    let away = self.distance(&centre[number as usize - 1], voxels, other);
                    if away < distance[other] {
                        (owner[other], distance[other]) = (number, away);
                    }
                }
            }
            if owner == before {
                break;
            }
            centre = centres(voxels, &owner, &centre);
        }
        owner
    }

    fn distance(
        &self,
        (position, normal): &(Vector3<f64>, Vector3<f64>),
        voxels: &Voxels,
        voxel: usize,
    ) -> f64 {
        let spatial =
            (voxels.centroid[voxel] - position).norm_squared() / (3.0 * self.seeds.powi(2));
        let bend = 1.0 - voxels.normal[voxel].dot(normal).abs();
        (self.spatial_weight * spatial + self.normal_weight * bend * bend).sqrt()
    }
}

/// Share of a full disc of voxels that must be around a seed (that of the reference implementation
/// in PCL).
const PLANE_SHARE: f64 = 0.05;

/// How many grids a supervoxel may reach from its seed (PCL's).
const REACH: f64 = 1.8;

/// Mean position and normal of each supervoxel's voxels; one that has lost all of them stays where
/// it was.
fn centres(
    voxels: &Voxels,
    owner: &[u32],
    before: &[(Vector3<f64>, Vector3<f64>)],
) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let mut sums = vec![(Vector3::zeros(), Vector3::zeros(), 0.0); before.len()];
    for (voxel, &number) in owner.iter().enumerate().filter(|&(_, &number)| number != 0) {
        let (position, normal, count) = &mut sums[number as usize - 1];
        *position += voxels.centroid[voxel];
        let own: Vector3<f64> = voxels.normal[voxel];
        *normal += if normal.dot(&own) < 0.0 { -own } else { own };
        *count += 1.0;
    }
    let of_sums = |((position, normal, count), before): (_, &(Vector3<f64>, Vector3<f64>))| {
        let normal: Vector3<f64> = normal;
        match count {
            0.0 => *before,
            count => (position / count, normal.try_normalize(1e-9).unwrap_or(before.1)),
        }
    };
    sums.into_iter().zip(before).map(of_sums).collect()
}

/// The occupied voxels of some points, linked with the occupied ones of the 26 around them.
struct Voxels {
    /// By point.
    of_point: Vec<u32>,
    centroid: Vec<Vector3<f64>>,
    normal: Vec<Vector3<f64>>,
    neighbours: Vec<Vec<usize>>,
}

impl Voxels {
    fn new(points: &[[f64; 3]], side: f64) -> Self {
        let mut number: FxHashMap<[u64; 3], u32> = FxHashMap::default();
        let mut place: Vec<Cell> = Vec::new();
        let mut sums: Vec<(Vector3<f64>, f64)> = Vec::new();
        let mut of_point = Vec::with_capacity(points.len());
        for point in points {
            let cell = cell_of(*point, side);
            let voxel = *number.entry(key_of(cell)).or_insert(place.len() as u32);
            if voxel as usize == place.len() {
                place.push(cell);
                sums.push((Vector3::zeros(), 0.0));
            }
            sums[voxel as usize].0 += Vector3::from(*point);
            sums[voxel as usize].1 += 1.0;
            of_point.push(voxel);
        }
        let centroid: Vec<Vector3<f64>> = sums.into_iter().map(|(sum, n)| sum / n).collect();
        let number = &number;
        let around = |(own, cell): (usize, &Cell)| {
            let cell = *cell;
            let steps =
                (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [i, j, k])));
            steps
                .filter_map(move |by| number.get(&key_of(stepped(cell, by))))
                .map(|&n| n as usize)
                .filter(move |&n| n != own)
        };
        let neighbours: Vec<Vec<usize>> =
            place.iter().enumerate().map(|at| around(at).collect()).collect();
        let normal = (0..centroid.len()).map(|voxel| normal(&centroid, &neighbours[voxel], voxel));
        Voxels { of_point, normal: normal.collect(), centroid, neighbours }
    }

    /// Voxels no farther from one than a radius in metres, itself among them.
    fn around(&self, voxel: usize, radius: f64) -> usize {
        let at = &self.centroid[voxel];
        self.centroid.iter().filter(|other| (*other - at).norm_squared() <= radius * radius).count()
    }
}

/// The direction in which a voxel and its neighbours spread the least; zero for fewer than three.
fn normal(centroid: &[Vector3<f64>], neighbours: &[usize], voxel: usize) -> Vector3<f64> {
    if neighbours.len() < 2 {
        return Vector3::zeros();
    }
    let all = || std::iter::once(&voxel).chain(neighbours).map(|&voxel| centroid[voxel]);
    let mean = all().sum::<Vector3<f64>>() / (neighbours.len() + 1) as f64;
    let spread: Matrix3<f64> = all().map(|at| (at - mean) * (at - mean).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    eigen.eigenvectors.column(eigen.eigenvalues.imin()).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn supervoxels(params: Supervoxel, points: &[[f64; 3]]) -> Vec<u32> {
        let voxels = Voxels::new(points, params.voxel);
        let of_voxel = params.grow(&voxels, &params.seed(&voxels));
        voxels.of_point.iter().map(|&voxel| of_voxel[voxel as usize]).collect()
    }

    /// A sheet of 0.1 m between points in the plane x, y or x, z.
    fn sheet(length: f64, width: f64, place: impl Fn(f64, f64) -> [f64; 3]) -> Vec<[f64; 3]> {
        let steps = |length: f64| (0..(length / 0.1) as usize).map(|step| step as f64 * 0.1);
        steps(length)
            .flat_map(|a| steps(width).map(move |b| (a, b)))
            .map(|(a, b)| place(a, b))
            .collect()
    }

    #[test]
    fn a_long_sheet_is_cut_half_way_between_its_seeds() {
        let points = sheet(16.0, 4.0, |a, b| [a, b + 2.0, 0.1]);
        let found = supervoxels(Supervoxel::default(), &points);
        assert_eq!(found.iter().max(), Some(&2));
        for (point, &found) in points.iter().zip(&found) {
            assert!(found == if point[0] < 8.0 { 1 } else { 2 } || (point[0] - 8.0).abs() < 1.0);
        }
    }

    #[test]
    fn what_is_not_connected_is_not_reached_and_small_things_have_no_seed() {
        let mut points = sheet(5.0, 4.0, |a, b| [a + 1.0, b + 2.0, 0.1]);
        let sheet = points.len();
        points.extend([[7.0, 3.0, 0.1], [7.1, 3.0, 0.1]]);
        let found = supervoxels(Supervoxel::default(), &points);
        assert!(found[..sheet].iter().all(|&found| found == 1));
        assert_eq!(found[sheet..], [0, 0]);
    }

    #[test]
    fn normals_part_floor_and_wall() {
        let mut points = sheet(4.0, 4.0, |a, b| [a, b, 0.1]);
        let floor = points.len();
        points.extend(sheet(4.0, 4.0, |a, b| [4.3, a, b + 0.1]));
        let params = Supervoxel { seeds: 4.0, spatial_weight: 0.1, normal_weight: 1.0, voxel: 0.5 };
        let found = supervoxels(params, &points);
        // Half way up the wall, and in the middle of the floor.
        let middle = 20 * 40 + 20;
        let (on_floor, on_wall) = (found[middle], found[floor + middle]);
        assert_ne!(on_floor, on_wall);
        let share = |part: &[u32], own| {
            part.iter().filter(|&&f| f == own).count() as f64 / part.len() as f64
        };
        assert!(share(&found[..floor], on_floor) > 0.8);
        assert!(share(&found[floor..], on_wall) > 0.8);
    }
}
