//! ALPINE (Sautier, Puy, Boulch, Marlet and Lepetit 2025, arXiv 2503.13203): "Clustering is back:
//! Reaching state-of-the-art LiDAR instance segmentation without training".

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::shared::per_class;
use divmerge_core::cloud::taxonomy::{ClassSize, Taxonomy};
use divmerge_core::cluster::{Method, MethodInput, Segmentation};
use divmerge_core::geometry::disjoint_sets::DisjointSets;
use divmerge_core::geometry::footprint::{PlanePoint, convex_hull, minimum_area_rectangle};
use divmerge_core::geometry::kd_tree::KdTree;

/// The points of a class on the bird's-eye plane, each linked with its k nearest as far as they are
/// nearer than the class is wide; connected components; components larger than the class's objects
/// split.
///
/// A component is split if the rectangle of least area around it is longer or wider than the
/// class's box times a margin: the longest link that still counts is lowered by bisection until the
/// component falls into two, and both are looked at again. Where the paper is silent we do as the
/// released code does (MIT): the bisection begins at half the length at which the component arose,
/// in steps that halve from a quarter of it; it gives up, and leaves the component whole, below a
/// millimetre; neighbours are looked for anew among the component's points.
///
/// One departure from the released code: in its version of March 2025 a loop overwrites k by the
/// number of the last class. Here k is 32, as the paper has it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Alpine {
    /// Neighbours of a point. Default 32 (the paper's).
    #[schemars(range(min = 1, max = 1000))]
    #[schemars(extend("slider" = [4, 64], "source" = "Sautier et al. 2025"))]
    pub neighbours: usize,
    /// How much longer and wider than its class's box a component may be. Default 1.3 (the
    /// paper's); infinite: nothing is split.
    #[schemars(range(min = 0.0), extend("slider" = [1.0, 3.0], "source" = "Sautier et al. 2025"))]
    pub margin: f64,
    /// Box by class number; classes without one are left without instances.
    #[schemars(skip)]
    pub boxes: Vec<Option<ClassSize>>,
}

/// The boxes that ALPINE takes from public statistics of each kind of object, metres.
const BOXES: &[(&str, f64, f64)] = &[
    ("car", 4.4, 1.8),
    ("bicycle", 1.75, 0.61),
    ("motorcycle", 2.2, 0.95),
    ("truck", 10.0, 3.0),
    ("other-vehicle", 10.0, 3.0),
    ("person", 0.94, 0.94),
    ("bicyclist", 1.75, 0.61),
    ("motorcyclist", 2.2, 0.95),
];

impl Alpine {
    /// With the boxes of the paper for the classes of SemanticKITTI's names, ours for the others.
    pub fn new(taxonomy: &Taxonomy) -> Self {
        let boxes = taxonomy.classes().iter().map(|class| {
            let theirs = BOXES.iter().find(|(name, ..)| *name == class.name);
            theirs.map(|&(_, length, width)| ClassSize { length, width }).or(class.size())
        });
        Alpine { neighbours: 32, margin: 1.3, boxes: boxes.collect() }
    }

    /// For each of n points of one class its cluster from 1.
    fn clusters(&self, points: &[PlanePoint], size: ClassSize) -> Vec<u32> {
        let graph = Graph::new(points, self.neighbours, size.width);
        let components = graph.components(points.len(), size.width);
        let mut cluster = vec![0; points.len()];
        let mut count = 0;
        for members in members(&components) {
            self.split(points, members, size, size.width, &mut |part| {
                count += 1;
                part.iter().for_each(|&point| cluster[point] = count);
            });
        }
        cluster
    }

    /// Calls `keep` with each part of a component, which arose from links shorter than `link`
    /// metres.
    fn split(
        &self,
        points: &[PlanePoint],
        members: Vec<usize>,
        size: ClassSize,
        link: f64,
        keep: &mut impl FnMut(&[usize]),
    ) {
        let own: Vec<PlanePoint> = members.iter().map(|&point| points[point]).collect();
        let halves = (!self.fits(&own, size)).then(|| self.halves(&own, link)).flatten();
        let Some((parts, link)) = halves else {
            return keep(&members);
        };
        for part in parts {
            let part = part.into_iter().map(|place| members[place]).collect();
            self.split(points, part, size, link, keep);
        }
    }

    fn fits(&self, points: &[PlanePoint], size: ClassSize) -> bool {
        minimum_area_rectangle(&convex_hull(points)).is_none_or(|rectangle| {
            let [length, width] = rectangle.size;
            length < size.length * self.margin && width < size.width * self.margin
        })
    }

    /// Two parts of a component, and the length of the links that were cut.
    fn halves(&self, points: &[PlanePoint], link: f64) -> Option<(Vec<Vec<usize>>, f64)> {
        const LEAST_STEP: f64 = 1e-3;
        let graph = Graph::new(points, self.neighbours, link);
        let (mut current, mut step) = (link / 2.0, link / 2.0);
        while step > LEAST_STEP {
            step /= 2.0;
            match graph.component_count(points.len(), current) {
                1 => current -= step,
                2 => return Some((members(&graph.components(points.len(), current)), current)),
                _ => current += step,
            }
        }
        None
    }
}

impl Method for Alpine {
    fn name(&self) -> &'static str {
        "alpine"
    }

    parameters_are_fields!();

    fn segment(&self, input: &MethodInput) -> Segmentation {
        per_class(input, |class, points| {
            let plane: Vec<PlanePoint> = points.iter().map(|&[x, y, _]| [x, y]).collect();
            match self.boxes.get(usize::from(class)).copied().flatten() {
                None => vec![0; points.len()],
                Some(size) => self.clusters(&plane, size),
            }
        })
    }
}

/// The points of each component, components in the order of their numbers.
fn members(component: &[u32]) -> Vec<Vec<usize>> {
    let count = component.iter().max().map_or(0, |&last| last as usize);
    let mut members = vec![Vec::new(); count];
    for (point, &component) in component.iter().enumerate() {
        members[component as usize - 1].push(point);
    }
    members
}

/// The links of a k-nearest-neighbour graph that a spanning forest needs: what hangs together by
/// links shorter than any length is the same with these alone (Kruskal 1956).
struct Graph {
    /// Squared length and the two points, ascending.
    links: Vec<(f64, u32, u32)>,
}

impl Graph {
    fn new(points: &[PlanePoint], neighbours: usize, reach: f64) -> Self {
        let tree = KdTree::new(points);
        let mut all: Vec<(f64, u32, u32)> = Vec::new();
        for (point, &at) in (0_u32..).zip(points) {
            let near = tree.nearest(at, neighbours + 1, reach);
            let others = near.iter().filter(|near| near.point != point).take(neighbours);
            all.extend(others.map(|near| (near.squared, point, near.point)));
        }
        all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut sets = DisjointSets::new(points.len());
        all.retain(|&(_, a, b)| sets.join(a as usize, b as usize));
        Graph { links: all }
    }

    /// Links shorter than a length in metres.
    fn shorter(&self, length: f64) -> &[(f64, u32, u32)] {
        let end = self.links.partition_point(|&(squared, ..)| squared < length * length);
        &self.links[..end]
    }

    fn component_count(&self, points: usize, length: f64) -> usize {
        points - self.shorter(length).len()
    }

    fn components(&self, points: usize, length: f64) -> Vec<u32> {
        let mut sets = DisjointSets::new(points);
        for &(_, a, b) in self.shorter(length) {
            sets.join(a as usize, b as usize);
        }
        sets.numbered()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAR: ClassSize = ClassSize { length: 4.4, width: 1.8 };

    /// The outline of a box, a point every 0.2 m.
    fn outline([x, y]: PlanePoint, length: f64, width: f64) -> Vec<PlanePoint> {
        let steps = |side: f64| (0..=(side / 0.2).round() as usize).map(|i| i as f64 * 0.2);
        let along = steps(length).flat_map(|t| [[x + t, y], [x + t, y + width]]);
        let across = steps(width).flat_map(|t| [[x, y + t], [x + length, y + t]]);
        along.chain(across).collect()
    }

    fn clusters(points: &[PlanePoint], margin: f64) -> Vec<u32> {
        let alpine = Alpine { margin, ..Alpine::new(&Taxonomy::semantic_kitti()) };
        alpine.clusters(points, CAR)
    }

    #[test]
    fn cars_nearer_than_a_car_is_wide_are_one_until_split_by_size() {
        let cars = [outline([0.0, 0.0], 4.2, 1.6), outline([0.0, 2.2], 4.2, 1.6)];
        let points = cars.concat();
        assert_eq!(clusters(&points, f64::INFINITY), vec![1; points.len()]);
        let expected = [vec![1; cars[0].len()], vec![2; cars[1].len()]].concat();
        assert_eq!(clusters(&points, 1.3), expected);
    }

    #[test]
    fn three_cars_in_a_row_of_uneven_gaps_are_three() {
        let cars = [
            outline([0.0, 0.0], 4.2, 1.6),
            outline([0.0, 2.2], 4.2, 1.6),
            outline([0.0, 4.7], 4.2, 1.6),
        ];
        let expected: Vec<u32> =
            cars.iter().zip(1..).flat_map(|(car, number)| vec![number; car.len()]).collect();
        assert_eq!(clusters(&cars.concat(), 1.3), expected);
    }

    #[test]
    fn cars_farther_apart_than_a_car_is_wide_need_no_split() {
        let cars = [outline([0.0, 0.0], 4.2, 1.6), outline([6.1, 0.0], 4.2, 1.6)];
        let expected = [vec![1; cars[0].len()], vec![2; cars[1].len()]].concat();
        assert_eq!(clusters(&cars.concat(), f64::INFINITY), expected);
    }

    #[test]
    fn what_cannot_be_parted_stays_whole() {
        let line: Vec<PlanePoint> = (0..60).map(|i| [f64::from(i) * 0.15, 0.0]).collect();
        assert_eq!(clusters(&line, 1.3), vec![1; 60]);
        assert!(clusters(&[], 1.3).is_empty());
        assert_eq!(clusters(&[[1.0, 1.0]], 1.3), [1]);
    }

    #[test]
    fn few_neighbours_leave_clumps_apart() {
        // Two clumps of 5 a metre apart: with 3 neighbours no link leaves a clump.
        let clump = |x: f64| (0..5).map(move |i| [x + f64::from(i) * 0.01, 0.0]);
        let points: Vec<PlanePoint> = clump(0.0).chain(clump(1.0)).collect();
        let mut alpine = Alpine::new(&Taxonomy::semantic_kitti());
        assert_eq!(alpine.clusters(&points, CAR), vec![1; 10]);
        alpine.neighbours = 3;
        assert_eq!(alpine.clusters(&points, CAR), [1, 1, 1, 1, 1, 2, 2, 2, 2, 2]);
    }
}
