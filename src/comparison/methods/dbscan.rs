//! Density-based clustering (Ester, Kriegel, Sander and Xu 1996).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use divmerge_core::cluster::{Method, MethodInput, Segmentation};
use divmerge_core::geometry::disjoint_sets::DisjointSets;
use rustc_hash::FxHashMap;

use super::shared::{Cell, cell_of, key_of, per_class, stepped};

/// DBSCAN in space, class by class.
///
/// A point with at least `min_points` points, itself among them, no farther than `reach` is a core
/// point. Core points no farther apart than that are one cluster; other points join the nearest
/// core point within reach (the original: the first that comes, so that the order of the points
/// matters), or are noise and get no instance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Dbscan {
    /// Epsilon, metres. Default 0.5.
    #[schemars(range(max = 100.0))]
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "m", "slider" = [0.05, 3.0]))]
    #[schemars(extend("source" = "Ester et al. 1996, the value ours"))]
    pub reach: f64,
    /// Points that make a point a core point. Default 5.
    #[schemars(range(min = 1, max = 1000000), extend("slider" = [1, 30]))]
    #[schemars(extend("source" = "Ester et al. 1996, the value ours"))]
    pub min_points: usize,
}

impl Default for Dbscan {
    fn default() -> Self {
        Dbscan { reach: 0.5, min_points: 5 }
    }
}

impl Method for Dbscan {
    fn name(&self) -> &'static str {
        "dbscan"
    }

    parameters_are_fields!();

    fn segment(&self, input: &MethodInput) -> Segmentation {
        per_class(input, |_, points| dbscan(points, *self))
    }
}

/// For each point its cluster from 1, or 0 for noise.
///
/// In cells whose diagonal is the reach (Gunawan 2013) all points of a cell are within reach of
/// each other, so that a full cell needs no search, and a pair of cells none after the first link.
pub(super) fn dbscan(points: &[[f64; 3]], params: Dbscan) -> Vec<u32> {
    let cells = Cells::new(points, params.reach);
    let is_core = core_points(&cells, params.min_points);
    let mut sets = DisjointSets::new(points.len());
    for (number, cell) in cells.points.iter().enumerate() {
        let core: Vec<u32> = cell.iter().copied().filter(|&p| is_core[p as usize]).collect();
        let Some(&first) = core.first() else { continue };
        for &point in &core {
            sets.join(first as usize, point as usize);
        }
        for other in cells.around(number).filter(|&other| other < number) {
            let others = cells.points[other].iter().copied().filter(|&p| is_core[p as usize]);
            let others: Vec<u32> = others.collect();
            let Some(&first_other) = others.first() else { continue };
            if sets.root(first as usize) != sets.root(first_other as usize)
                && cells.are_near((number, &core), (other, &others))
            {
                sets.join(first as usize, first_other as usize);
            }
        }
    }
    with_borders(&cells, &is_core, &sets.numbered())
}

fn core_points(cells: &Cells, min_points: usize) -> Vec<bool> {
    let mut is_core = vec![false; cells.position.len()];
    for (number, cell) in cells.points.iter().enumerate() {
        for &point in cell {
            let near = cells.around(number).flat_map(|other| &cells.points[other]);
            let near = near.filter(|&&other| cells.is_near(point, other));
            is_core[point as usize] = cell.len() >= min_points
                || cell.len() + near.take(min_points).count() >= min_points;
        }
    }
    is_core
}

/// The clusters of core points, renumbered, with the other points beside them.
fn with_borders(cells: &Cells, is_core: &[bool], set: &[u32]) -> Vec<u32> {
    let mut number: FxHashMap<u32, u32> = FxHashMap::default();
    let mut cluster = vec![0; set.len()];
    for point in (0..set.len()).filter(|&point| is_core[point]) {
        let next = number.len() as u32 + 1;
        cluster[point] = *number.entry(set[point]).or_insert(next);
    }
    for (own, cell) in cells.points.iter().enumerate() {
        for &point in cell.iter().filter(|&&point| !is_core[point as usize]) {
            let near = std::iter::once(own).chain(cells.around(own));
            let near = near.flat_map(|cell| &cells.points[cell]).copied();
            let core = near.filter(|&p| is_core[p as usize] && cells.is_near(point, p));
            let nearest = core.min_by(|&a, &b| {
                cells.squared(point, a).total_cmp(&cells.squared(point, b)).then(a.cmp(&b))
            });
            cluster[point as usize] = nearest.map_or(0, |core| cluster[core as usize]);
        }
    }
    cluster
}

/// Points in cubes whose diagonal is the reach.
struct Cells<'a> {
    position: &'a [[f64; 3]],
    squared_reach: f64,
    /// By cell, in the order of first points.
    points: Vec<Vec<u32>>,
    /// Around the points of each cell: the lowest and the highest corner.
    bounds: Vec<[[f64; 3]; 2]>,
    place: Vec<Cell>,
    number: FxHashMap<[u64; 3], usize>,
}

impl<'a> Cells<'a> {
    fn new(position: &'a [[f64; 3]], reach: f64) -> Self {
        let mut cells = Cells {
            position,
            squared_reach: reach * reach,
            points: Vec::new(),
            bounds: Vec::new(),
            place: Vec::new(),
            number: FxHashMap::default(),
        };
        let side = reach / 3_f64.sqrt();
        for (point, &position) in (0_u32..).zip(position) {
            let place = cell_of(position, side);
            let number = *cells.number.entry(key_of(place)).or_insert(cells.points.len());
            if number == cells.points.len() {
                cells.points.push(Vec::new());
                cells.bounds.push([position; 2]);
                cells.place.push(place);
            }
            cells.points[number].push(point);
            let [low, high] = &mut cells.bounds[number];
            for axis in 0..3 {
                low[axis] = low[axis].min(position[axis]);
                high[axis] = high[axis].max(position[axis]);
            }
        }
        cells
    }

    /// The other cells in which a point within reach of one of a cell's can lie.
    fn around(&self, cell: usize) -> impl Iterator<Item = usize> {
        let place = self.place[cell];
        let steps =
            (-2..=2).flat_map(|i| (-2..=2).flat_map(move |j| (-2..=2).map(move |k| [i, j, k])));
        let others = steps.filter_map(move |by| self.number.get(&key_of(stepped(place, by))));
        // Where numbers are so large that a step is lost, it leads back.
        others.copied().filter(move |&other| other != cell)
    }

    /// Whether a point of one cell is near one of another. Only those are compared that are near
    /// the bounds of the other cell, so that two heaps of points cost no more than their number.
    fn are_near(&self, (a, of_a): (usize, &[u32]), (b, of_b): (usize, &[u32])) -> bool {
        let reaching = |points: &[u32], cell: usize| -> Vec<u32> {
            points.iter().copied().filter(|&point| self.may_reach(point, cell)).collect()
        };
        let (of_a, of_b) = (reaching(of_a, b), reaching(of_b, a));
        of_a.iter().any(|&a| of_b.iter().any(|&b| self.is_near(a, b)))
    }

    fn may_reach(&self, point: u32, cell: usize) -> bool {
        let (position, [low, high]) = (self.position[point as usize], self.bounds[cell]);
        let away =
            |axis: usize| (low[axis] - position[axis]).max(position[axis] - high[axis]).max(0.0);
        (0..3).map(|axis| away(axis) * away(axis)).sum::<f64>() <= self.squared_reach
    }

    fn squared(&self, a: u32, b: u32) -> f64 {
        let (a, b) = (self.position[a as usize], self.position[b as usize]);
        (0..3).map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis])).sum()
    }

    fn is_near(&self, a: u32, b: u32) -> bool {
        self.squared(a, b) <= self.squared_reach
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn on_a_line(x: &[f64]) -> Vec<[f64; 3]> {
        x.iter().map(|&x| [x, 0.0, 0.0]).collect()
    }

    #[test]
    fn a_chain_is_one_and_a_wider_gap_parts() {
        let points = on_a_line(&[0.0, 0.45, 0.9, 1.5, 1.9]);
        assert_eq!(dbscan(&points, Dbscan { reach: 0.5, min_points: 1 }), [1, 1, 1, 2, 2]);
    }

    #[test]
    fn core_border_and_noise() {
        // 0 to 0.4: five within reach of the middle one; 0.7 reaches core points only; 2.0 is
        // alone.
        let points = on_a_line(&[0.0, 0.1, 0.2, 0.3, 0.4, 0.85, 2.0]);
        assert_eq!(dbscan(&points, Dbscan::default()), [1, 1, 1, 1, 1, 1, 0]);
        // Four points are not dense.
        assert_eq!(dbscan(&points[1..5], Dbscan::default()), [0; 4]);
    }

    proptest::proptest! {
        /// Against the definition: core points by counting all, clusters by joining all pairs.
        #[test]
        fn agrees_with_the_definition(
            grid in proptest::collection::vec((0..14_u8, 0..14_u8, 0..6_u8), 1..90),
            min_points in 1..6_usize,
        ) {
            let points: Vec<[f64; 3]> =
                grid.iter().map(|&(x, y, z)| [x, y, z].map(|v| f64::from(v) * 0.21)).collect();
            let near = |a: usize, b: usize| {
                (0..3).map(|i| (points[a][i] - points[b][i]).powi(2)).sum::<f64>() <= 0.25
            };
            let all = 0..points.len();
            let near_to = |a: usize| all.clone().filter(|&b| near(a, b)).count();
            let is_core: Vec<bool> = all.clone().map(|a| near_to(a) >= min_points).collect();
            let mut sets = DisjointSets::new(points.len());
            for a in all.clone() {
                for b in all.clone().filter(|&b| is_core[a] && is_core[b] && near(a, b)) {
                    sets.join(a, b);
                }
            }
            let found = dbscan(&points, Dbscan { reach: 0.5, min_points });
            for a in all.clone() {
                let reached = all.clone().any(|b| is_core[b] && near(a, b));
                assert_eq!(found[a] != 0, reached);
                for b in all.clone().filter(|&b| is_core[a] && is_core[b]) {
                    assert_eq!(found[a] == found[b], sets.root(a) == sets.root(b));
                }
            }
        }
    }
}
