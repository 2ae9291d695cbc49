//! Over- and under-segmentation entropy of instances without classes, as the code of
//! continuous_clustering computes them (Reich and Wuensche, arXiv 2311.13976), so that figures
//! compare with those that it reports for itself and for TRAVEL (Oh et al., RA-L 2022, arXiv
//! 2206.03190).
//!
//! With n(o) the points of a true part o, m(s) those of a found instance s, and n(o, s) those of
//! both, a frame has
//!
//! - OSE = sum over o of H(o), where H(o) = - sum over s of p ln p and p = n(o, s) / n(o): 0 for a
//!   part found in one piece, ln k for one found in k equal pieces;
//! - USE = sum over s of H(s), where H(s) = - sum over o of q ln q and q = n(o, s) / m(s): 0 for an
//!   instance that holds one part, ln k for one that holds k equal ones.
//!
//! Both are sums, not means, in nats: a frame with more objects has more of either, and figures
//! compare only over the same frames. Of several frames the mean is stated.
//!
//! - True parts ([`true_parts`]): of each class and instance id the connected parts by distances
//!   below [`TOLERANCE`]; data sets number the instances of things only, so that all houses of a
//!   scan are one id. Classes are raw ids: a moving car and a parked one are two classes.
//! - Points of class 0 and of ground (road, lane marking, parking, sidewalk, other ground, terrain)
//!   are of [`NO_PART`], and so are parts of fewer than [`MIN_POINTS`] points.
//! - OSE is over the true parts but [`NO_PART`]; points without an instance count as one instance
//!   more. USE is over the found instances that hold a point of a part; points of [`NO_PART`] count
//!   as one part more.

use rustc_hash::{FxHashMap, FxHashSet};
use serde::Serialize;

use divmerge_core::cloud::PointCloud;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::geometry::disjoint_sets::DisjointSets;

/// Points of one class and id nearer than this, metres, are of one true part.
pub const TOLERANCE: f64 = 1.0;

/// True parts of fewer points count as [`NO_PART`].
pub const MIN_POINTS: usize = 10;

/// True part of a point of no object, or of too small a part.
pub const NO_PART: u32 = 0;

/// The entropies of one frame, in nats.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Entropies {
    /// OSE: sum over the true parts.
    pub over: f64,
    /// USE: sum over the found instances.
    pub under: f64,
}

/// The entropies of a frame: for each point its true part ([`NO_PART`] or a number) and its found
/// instance (0 for none).
///
/// # Panics
/// If the two differ in length.
pub fn entropies(truth: &[u32], found: &[u32]) -> Entropies {
    assert_eq!(truth.len(), found.len(), "one true part and one instance per point");
    let points = || truth.iter().copied().zip(found.iter().copied());
    let on_parts = || points().filter(|&(truth, _)| truth != NO_PART);
    let holds_part: FxHashSet<u32> = on_parts().map(|(_, found)| found).collect();
    let of_found = points().filter(|(_, found)| *found != 0 && holds_part.contains(found));
    Entropies {
        over: total_entropy(on_parts()),
        under: total_entropy(of_found.map(|(truth, found)| (found, truth))),
    }
}

/// The sum over all wholes of the entropy of their parts, given (whole, part) of each point.
fn total_entropy(points: impl Iterator<Item = (u32, u32)>) -> f64 {
    let mut pairs: Vec<(u32, u32)> = points.collect();
    pairs.sort_unstable();
    let wholes = pairs.chunk_by(|a, b| a.0 == b.0);
    let parts =
        |whole: &[(u32, u32)]| entropy(whole.len(), whole.chunk_by(|a, b| a == b).map(<[_]>::len));
    wholes.map(parts).fold(0.0, |sum, entropy| sum + entropy)
}

/// Entropy in nats of parts that make up a whole.
fn entropy(whole: usize, parts: impl Iterator<Item = usize>) -> f64 {
    let share = |part: usize| part as f64 / whole as f64;
    let terms = parts.filter(|&part| part < whole).map(|part| -share(part) * share(part).ln());
    terms.fold(0.0, |sum, term| sum + term)
}

/// N: the true part of each point. `segment` tells class and instance id apart, a number for each
/// pair; `raw` are the classes in the recording's ids and `class` the same as class numbers of the
/// taxonomy, which knows the ground.
///
/// # Panics
/// If columns differ in length or a class number is not the taxonomy's.
pub fn true_parts(
    cloud: &PointCloud,
    segment: &[u32],
    (raw, class): (&[u16], &[u16]),
    taxonomy: &Taxonomy,
) -> Vec<u32> {
    assert_eq!(raw.len(), cloud.len(), "one class per point");
    assert_eq!(segment.len(), cloud.len(), "one segment per point");
    let is_ground: Vec<bool> = taxonomy.classes().iter().map(|class| class.is_ground()).collect();
    let group = |(&segment, (&raw, &class)): (&u32, (&u16, &u16))| {
        (raw != 0 && !is_ground[usize::from(class)]).then_some(segment)
    };
    let group: Vec<Option<u32>> = segment.iter().zip(raw.iter().zip(class)).map(group).collect();
    let mut parts = euclidean_clusters(cloud, &group, TOLERANCE);
    let mut points = vec![0; parts.iter().max().map_or(0, |&last| last as usize) + 1];
    for &part in &parts {
        points[part as usize] += 1;
    }
    for part in &mut parts {
        if points[*part as usize] < MIN_POINTS {
            *part = NO_PART;
        }
    }
    parts
}

/// Euclidean clusters (single linkage) of the points of each group: numbers from 1 in the order of
/// the points, 0 for points of no group.
///
/// Points of a group nearer than `tolerance` metres are one cluster, transitively. Cells are so
/// small that all points of a group within one belong together; cells are then compared with those
/// in reach. Time O(N) for bounded density.
pub fn euclidean_clusters(cloud: &PointCloud, group: &[Option<u32>], tolerance: f64) -> Vec<u32> {
    let side = tolerance / 3_f64.sqrt();
    let mut cells: FxHashMap<(u32, [u64; 3]), Vec<u32>> = FxHashMap::default();
    let mut cell_of = Vec::with_capacity(cloud.len());
    for point in 0..cloud.len() {
        let key = group[point].filter(|_| cloud.is_return(point)).map(|group| {
            let position = cloud.position(point).map(f64::from);
            (group, position.map(|x| cell_bits((x / side).floor())))
        });
        if let Some(key) = key {
            cells.entry(key).or_default().push(point as u32);
        }
        cell_of.push(key);
    }
    let mut sets = DisjointSets::new(cloud.len());
    for (&(group, [x, y, z]), points) in &cells {
        for &other in &points[1..] {
            sets.join(points[0] as usize, other as usize);
        }
        for [i, j, k] in half_of_reach() {
            let other = [(x, i), (y, j), (z, k)];
            let other = other.map(|(bits, by)| cell_bits(f64::from_bits(bits) + f64::from(by)));
            let Some(others) = cells.get(&(group, other)) else { continue };
            if sets.root(points[0] as usize) != sets.root(others[0] as usize)
                && are_near(cloud, points, others, tolerance)
            {
                sets.join(points[0] as usize, others[0] as usize);
            }
        }
    }
    let mut number = vec![0; cloud.len()];
    let mut count = 0;
    let mut cluster = |point: usize| {
        let root = sets.root(point);
        if number[root] == 0 {
            count += 1;
            number[root] = count;
        }
        number[root]
    };
    (0..cloud.len()).map(|point| cell_of[point].map_or(0, |_| cluster(point))).collect()
}

/// The whole number of a cell along an axis, however large it is, as a key; both zeros are one.
/// Where numbers are so large that a step is lost, it leads to the cell itself.
fn cell_bits(along: f64) -> u64 {
    (along + 0.0).to_bits()
}

/// The cells within two of a cell on each axis, each pair once.
fn half_of_reach() -> impl Iterator<Item = [i8; 3]> {
    let steps = (-2..=2).flat_map(|i| (-2..=2).flat_map(move |j| (-2..=2).map(move |k| [i, j, k])));
    steps.filter(|step| *step > [0, 0, 0])
}

fn are_near(cloud: &PointCloud, points: &[u32], others: &[u32], tolerance: f64) -> bool {
    let position = |point: u32| cloud.position(point as usize).map(f64::from);
    points.iter().any(|&point| {
        let p = position(point);
        others.iter().any(|&other| {
            let q = position(other);
            (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum::<f64>() < tolerance * tolerance
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_are_found_however_far_away() {
        let x = vec![1e12, 1e12, 3e25, 3.4e38, -3.4e38, -0.1, 0.1];
        let cloud = PointCloud::new(x, vec![0.0; 7], vec![0.0; 7]).unwrap();
        let found = euclidean_clusters(&cloud, &[Some(1); 7], 0.5);
        assert_eq!(found, [1, 1, 2, 3, 4, 5, 5]);
    }

    #[test]
    fn an_object_in_one_piece_has_no_entropy() {
        let found = entropies(&[1, 1, 1, 2], &[7, 7, 7, 9]);
        assert_eq!(found, Entropies::default());
    }

    #[test]
    fn entropies_by_hand() {
        // Object 1: two points in 5, one in 6, one in none: - (1/2 ln 1/2 + 2 * 1/4 ln 1/4) = 1.5
        // ln 2. Object 2: whole in 6. Instance 6: one point of object 1, three of object 2.
        let truth = [1, 1, 1, 1, 2, 2, 2];
        let found = entropies(&truth, &[5, 5, 6, 0, 6, 6, 6]);
        let ln2 = 2_f64.ln();
        assert!((found.over - 1.5 * ln2).abs() < 1e-12, "{found:?}");
        let under = 0.25 * 4_f64.ln() + 0.75 * (4.0 / 3_f64).ln();
        assert!((found.under - under).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn sums_over_objects_and_not_means() {
        let truth: Vec<u32> = (0..30).map(|point| 1 + point / 2).collect();
        let found: Vec<u32> = (1..=30).collect();
        let entropies = entropies(&truth, &found);
        assert!((entropies.over - 15.0 * 2_f64.ln()).abs() < 1e-12);
        assert_eq!(entropies.under, 0.0);
    }

    #[test]
    fn what_is_no_part_is_one_part_more_of_an_instance_and_nothing_of_its_own() {
        let truth = [1, 1, NO_PART, NO_PART, NO_PART];
        // Instance 5 holds a part and as much that is none; instance 6 holds no part.
        let found = entropies(&truth, &[5, 5, 5, 5, 6]);
        assert_eq!(found.over, 0.0);
        assert!((found.under - 2_f64.ln()).abs() < 1e-12, "{found:?}");
    }

    /// Points on the x axis.
    fn row(x: &[f32]) -> PointCloud {
        PointCloud::new(x.to_vec(), vec![1.0; x.len()], vec![0.0; x.len()]).unwrap()
    }

    #[test]
    fn clusters_hang_together_by_the_tolerance_within_a_group() {
        let cloud = row(&[0.0, 0.4, 0.8, 1.4, 0.6]);
        let group = [Some(1), Some(1), Some(1), Some(1), Some(2)];
        assert_eq!(euclidean_clusters(&cloud, &group, 0.5), [1, 1, 1, 2, 3]);
        assert_eq!(euclidean_clusters(&cloud, &group, 0.7), [1, 1, 1, 1, 2]);
        assert_eq!(euclidean_clusters(&cloud, &[None; 5], 0.7), [0; 5]);
    }

    #[test]
    fn true_parts_of_each_kind() {
        let taxonomy = Taxonomy::semantic_kitti();
        let x: Vec<f32> = (0..60).map(|point| point as f32 * 0.9).collect();
        let cloud = row(&x);
        // Two cars one behind the other, nothing, road, and a post of too few points.
        let word = |point: usize| match point {
            0..15 => 10 | 1 << 16,
            15..30 => 10 | 2 << 16,
            30..40 => 0,
            40..55 => 40,
            _ => 80,
        };
        let segment: Vec<u32> = (0..60).map(word).collect();
        let raw: Vec<u16> = segment.iter().map(|&word| word as u16).collect();
        let class = taxonomy.known_class_numbers(&raw).unwrap();
        let parts = true_parts(&cloud, &segment, (&raw, &class), &taxonomy);
        assert!(parts[..15].iter().all(|&part| part == 1));
        assert!(parts[15..30].iter().all(|&part| part == 2));
        assert!(parts[30..].iter().all(|&part| part == NO_PART));
    }

    proptest::proptest! {
        /// Against all pairs.
        #[test]
        fn cells_find_what_all_pairs_find(
            points in proptest::collection::vec((-9..9_i8, -9..9_i8, -4..4_i8, 0..2_u32), 1..60),
        ) {
            let column = |get: fn(&(i8, i8, i8, u32)) -> i8| {
                points.iter().map(|p| f32::from(get(p)) * 0.25 + 0.1).collect::<Vec<_>>()
            };
            let cloud = PointCloud::new(column(|p| p.0), column(|p| p.1), column(|p| p.2)).unwrap();
            let group: Vec<Option<u32>> = points.iter().map(|p| Some(p.3)).collect();
            let mut expected = DisjointSets::new(points.len());
            for a in 0..points.len() {
                for b in 0..a {
                    if group[a] == group[b] && are_near(&cloud, &[a as u32], &[b as u32], 0.5) {
                        expected.join(a, b);
                    }
                }
            }
            let found = euclidean_clusters(&cloud, &group, 0.5);
            for a in 0..points.len() {
                for b in 0..a {
                    let same = expected.root(a) == expected.root(b);
                    assert_eq!(same, found[a] == found[b]);
                }
            }
        }
    }
}
