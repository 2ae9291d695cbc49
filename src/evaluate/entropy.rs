//! Over- and under-segmentation entropy of instances without classes (TRAVEL: Oh et al., RA-L 2022,
//! arXiv 2206.03190; also reported by continuous_clustering: Reich and Wuensche, arXiv 2311.13976).
//!
//! With n(o) the points of a true object o, m(s) those of a found instance s, and n(o, s) those of
//! both, a frame has
//!
//! - OSE = sum over o of H(o), where H(o) = - sum over s of p ln p and p = n(o, s) / n(o): 0 for an
//!   object found in one piece, ln k for one found in k equal pieces;
//! - USE = sum over s of H(s), where H(s) = - sum over o of q ln q and q = n(o, s) / m(s): 0 for an
//!   instance that holds one object, ln k for one that holds k equal ones.
//!
//! Both are sums over objects, not means, in nats: a frame with more objects has more of either,
//! and figures compare only over the same frames. Of several frames the mean and the standard
//! deviation are stated.
//!
//! Truth: data sets number the instances of things only, so that houses, hedges and poles have
//! none. True objects are therefore the Euclidean clusters of the points of one class
//! ([`true_objects`]). What is fixed here, because the papers leave it open:
//!
//! - Points of ignored classes are left out on both sides, and so is ground (road, lane marking,
//!   parking, sidewalk, other ground, terrain), which no clustering is asked for;
//!   [`Entropies::under_with_ground`] counts it as one object more.
//! - Classes are compared by raw id: a moving car and a parked one are two classes.
//! - Points nearer than [`TOLERANCE`] belong to one object, and an object of fewer than
//!   [`MIN_POINTS`] points is left out: far away a sensor's rows lie farther apart than the
//!   tolerance, and what was one bush close by would be a dozen objects of a few points each. Both
//!   numbers matter: figures that were made with others do not compare.
//! - True object points without an instance (taken for ground, dropped, hidden) are one piece more
//!   of their object, and no instance themselves.

use rustc_hash::FxHashMap;
use serde::Serialize;

use divmerge_core::cloud::PointCloud;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::geometry::disjoint_sets::DisjointSets;

/// Points of one class no farther apart than this, metres, belong to one true object.
pub const TOLERANCE: f64 = 0.5;

/// True objects of fewer points are left out.
pub const MIN_POINTS: usize = 10;

/// True object of a point that is left out.
pub const LEFT_OUT: u32 = 0;

/// True object of a point on the ground.
pub const GROUND: u32 = u32::MAX;

/// The entropies of one frame, in nats.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Entropies {
    /// OSE: sum over the true objects.
    pub over: f64,
    /// USE: sum over the found instances, ground points left out.
    pub under: f64,
    /// USE with ground as one object more.
    pub under_with_ground: f64,
}

/// The entropies of a frame: for each point its true object ([`LEFT_OUT`], [`GROUND`] or a number)
/// and its found instance (0 for none).
///
/// # Panics
/// If the two differ in length.
pub fn entropies(truth: &[u32], found: &[u32]) -> Entropies {
    assert_eq!(truth.len(), found.len(), "one true object and one instance per point");
    let points = || truth.iter().copied().zip(found.iter().copied());
    let on_objects = || points().filter(|&(truth, _)| truth != LEFT_OUT && truth != GROUND);
    let found_points = points().filter(|&(truth, found)| truth != LEFT_OUT && found != 0);
    Entropies {
        over: total_entropy(on_objects()),
        under: total_entropy(on_objects().filter(|p| p.1 != 0).map(|(t, f)| (f, t))),
        under_with_ground: total_entropy(found_points.map(|(t, f)| (f, t))),
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

/// The number of true instances that were found whole, and their number in all: instances of
/// `min_points` points or more, found whole if one found instance has an IoU above a half with
/// them. Ids count from 1; 0 is none. Unlike the entropies it needs no clustered truth, so it is
/// for things only.
///
/// # Panics
/// If the two differ in length.
pub fn found_whole(truth: &[u32], found: &[u32], min_points: usize) -> (usize, usize) {
    assert_eq!(truth.len(), found.len(), "one true and one found instance per point");
    let mut sizes: FxHashMap<u32, usize> = FxHashMap::default();
    for &found in found.iter().filter(|&&found| found != 0) {
        *sizes.entry(found).or_default() += 1;
    }
    let pairs = truth.iter().copied().zip(found.iter().copied());
    let mut pairs: Vec<(u32, u32)> = pairs.filter(|pair| pair.0 != 0).collect();
    pairs.sort_unstable();
    let (mut whole, mut all) = (0, 0);
    for object in pairs.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() >= min_points) {
        let mut parts = object.chunk_by(|a, b| a == b).filter(|part| part[0].1 != 0);
        let is_half = |part: &[(u32, u32)]| {
            let union = object.len() + sizes[&part[0].1] - part.len();
            2 * part.len() > union
        };
        all += 1;
        whole += usize::from(parts.any(is_half));
    }
    (whole, all)
}

/// How a point counts in the true objects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PointRole {
    /// Of an ignored class, or no return.
    LeftOut,
    /// Ground.
    Ground,
    /// Of an object of this class.
    Object(u32),
}

/// How each of N points counts in the true objects. `raw` are their true classes in the recording's
/// ids, which tell objects apart; `class` are the same as class numbers of the taxonomy.
///
/// # Panics
/// If columns differ in length or a class number is not the taxonomy's.
pub fn point_roles(
    cloud: &PointCloud,
    raw: &[u16],
    class: &[u16],
    taxonomy: &Taxonomy,
) -> Vec<PointRole> {
    assert_eq!(raw.len(), cloud.len(), "one class per point");
    let of_class = taxonomy.classes().iter().map(|class| match class {
        class if class.is_ignored => Some(PointRole::LeftOut),
        class => class.is_ground().then_some(PointRole::Ground),
    });
    let of_class: Vec<Option<PointRole>> = of_class.collect();
    let role = |(point, (&raw, &class)): (usize, (&u16, &u16))| match of_class[usize::from(class)] {
        _ if !cloud.is_return(point) => PointRole::LeftOut,
        Some(role) => role,
        None => PointRole::Object(u32::from(raw)),
    };
    raw.iter().zip(class).enumerate().map(role).collect()
}

/// N: the true object of each point. Points of one class no farther apart than `tolerance` metres
/// belong to one object, transitively. Objects of fewer than `min_points` points are left out.
///
/// # Panics
/// If there is not one role per point.
pub fn true_objects(
    cloud: &PointCloud,
    roles: &[PointRole],
    tolerance: f64,
    min_points: usize,
) -> Vec<u32> {
    assert_eq!(cloud.len(), roles.len(), "one role per point");
    let group = roles.iter().map(|&role| match role {
        PointRole::Object(class) => Some(class),
        _ => None,
    });
    let mut objects = euclidean_clusters(cloud, &group.collect::<Vec<_>>(), tolerance);
    let mut points = vec![0; objects.iter().max().map_or(0, |&last| last as usize) + 1];
    for &object in &objects {
        points[object as usize] += 1;
    }
    for (object, &role) in objects.iter_mut().zip(roles) {
        if role == PointRole::Ground {
            *object = GROUND;
        } else if points[*object as usize] < min_points {
            *object = LEFT_OUT;
        }
    }
    objects
}

/// Euclidean clusters (single linkage) of the points of each group: numbers from 1 in the order of
/// the points, 0 for points of no group.
///
/// Points of a group within `tolerance` metres are one cluster, transitively. Cells are so small
/// that all points of a group within one belong together; cells are then compared with those in
/// reach. Time O(N) for bounded density.
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
            (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum::<f64>() <= tolerance * tolerance
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
        assert_eq!(found.under, found.under_with_ground);
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
    fn what_is_left_out_counts_nowhere_and_ground_only_where_asked() {
        let truth = [1, 1, LEFT_OUT, GROUND, GROUND];
        let found = entropies(&truth, &[5, 5, 5, 5, 5]);
        assert_eq!((found.over, found.under), (0.0, 0.0));
        let with_ground = 0.5 * 2_f64.ln() * 2.0;
        assert!((found.under_with_ground - with_ground).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn things_found_whole_by_hand() {
        // Instance 1: 3 of 4 points in 5, which holds one point more: IoU 3 / 5. Instance 2 in
        // halves: IoU 1 / 2 is not enough. Instance 3: one point, too small to count.
        let truth = [1, 1, 1, 1, 0, 2, 2, 2, 2, 3];
        let found = [5, 5, 5, 0, 5, 6, 6, 7, 7, 8];
        assert_eq!(found_whole(&truth, &found, 2), (1, 2));
        assert_eq!(found_whole(&truth, &found, 1), (2, 3));
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
    fn true_objects_of_each_kind() {
        let cloud = row(&[0.0, 0.3, 0.5, 0.6]);
        let roles =
            [PointRole::Object(10), PointRole::Object(10), PointRole::LeftOut, PointRole::Ground];
        assert_eq!(true_objects(&cloud, &roles, TOLERANCE, 2), [1, 1, LEFT_OUT, GROUND]);
        assert_eq!(true_objects(&cloud, &roles, 0.1, 2), [LEFT_OUT, LEFT_OUT, LEFT_OUT, GROUND]);
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
