//! Fragments of one object found together by size: the merge that preset `best` makes on the bird's-eye
//! plane in place of the paper's overlap test (section III.E).
//!
//! An occluded or dark object comes out of the votes in pieces. Two pieces of one class belong together
//! when they all but touch, or when the rectangle around both still fits an object of that class; a wide
//! gap between them asks for a tight fit. The pair with the least evidence against it goes first, and
//! outlines grow as pieces join.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use serde::Serialize;

use super::params::FragmentMerge;
use crate::footprint::{PlanePoint, Rectangle, convex_hull, distance, minimum_area_rectangle};
use crate::taxonomy::ClassSize;

/// One piece: its class, that class's usual size, and its outline on the bird's-eye plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Fragment {
    /// Class number.
    pub class: u16,
    /// Usual size of the class; pieces of a class without one are left alone.
    pub size: Option<ClassSize>,
    /// Convex hull in metres; empty for a piece without points.
    pub hull: Vec<PlanePoint>,
}

/// Two groups of pieces became one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Join {
    /// First piece (from 1) of the group that stays.
    pub target: u32,
    /// First piece (from 1) of the group that joined it.
    pub query: u32,
    /// Distance between their outlines in metres.
    pub gap: f64,
    /// Sides of the rectangle around both in metres, the longer first.
    pub union: [f64; 2],
    /// The longest sides accepted across that gap in metres.
    pub limit: [f64; 2],
    /// Why they became one.
    pub evidence: Evidence,
}

/// Why two groups of pieces became one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Evidence {
    /// They all but touch.
    Touching,
    /// The rectangle around both fits an object of their class.
    Fits,
}

/// For each piece (from 0) the group it belongs to, groups numbered from 1 in the order of their first
/// pieces, and the joins in the order in which they were made.
///
/// Time O(p log p) in the pairs of pieces nearer than their class is wide.
pub fn assemble(fragments: &[Fragment], params: &FragmentMerge) -> (Vec<u32>, Vec<Join>) {
    let mut assembly = Assembly::new(fragments, params);
    assembly.run();
    (assembly.numbered(), assembly.joins)
}

/// A group of pieces.
struct Group {
    hull: Vec<PlanePoint>,
    low: PlanePoint,
    high: PlanePoint,
    /// How often it has grown; a candidate that knew it smaller is out of date.
    version: u32,
}

struct Candidate {
    cost: f64,
    groups: [usize; 2],
    versions: [u32; 2],
    gap: f64,
    union: Rectangle,
}

struct Assembly<'a> {
    fragments: &'a [Fragment],
    params: &'a FragmentMerge,
    groups: Vec<Group>,
    parent: Vec<usize>,
    /// Groups of one class by the place of their low x, so that near ones are found without trying all.
    cells: super::cells::Cells,
    queue: BinaryHeap<Candidate>,
    joins: Vec<Join>,
}

impl<'a> Assembly<'a> {
    fn new(fragments: &'a [Fragment], params: &'a FragmentMerge) -> Self {
        let groups: Vec<Group> = fragments.iter().map(|f| Group::new(f.hull.clone())).collect();
        let widest = fragments.iter().filter_map(|f| f.size).map(|size| size.width);
        let cell = widest.fold(1.0, f64::max);
        let mut assembly = Assembly {
            fragments,
            params,
            parent: (0..groups.len()).collect(),
            cells: super::cells::Cells::new(cell),
            groups,
            queue: BinaryHeap::new(),
            joins: Vec::new(),
        };
        for number in 0..fragments.len() {
            assembly.propose(number);
            assembly.enter(number);
        }
        assembly
    }

    fn enter(&mut self, number: usize) {
        if self.fragments[number].size.is_some() && !self.groups[number].hull.is_empty() {
            let group = &self.groups[number];
            self.cells.insert(number, group.low, group.high);
        }
    }

    /// Queues the pairs of a group with the groups entered so far that are near.
    fn propose(&mut self, number: usize) {
        let fragment = &self.fragments[number];
        let Some(size) = fragment.size.filter(|_| !self.groups[number].hull.is_empty()) else {
            return;
        };
        let group = &self.groups[number];
        let near = self.cells.near(group.low, group.high, size.width);
        for other in near {
            if other == number
                || self.parent[other] != other
                || self.fragments[other].class != fragment.class
            {
                continue;
            }
            if let Some(candidate) = self.candidate(number, other, size) {
                self.queue.push(candidate);
            }
        }
    }

    fn candidate(&self, a: usize, b: usize, size: ClassSize) -> Option<Candidate> {
        let (a, b) = (a.min(b), a.max(b));
        let (one, two) = (&self.groups[a], &self.groups[b]);
        let boxes_apart = (0..2).any(|axis| {
            one.low[axis].max(two.low[axis]) - one.high[axis].min(two.high[axis]) >= size.width
        });
        if boxes_apart {
            return None;
        }
        let gap = distance(&one.hull, &two.hull);
        if gap >= size.width {
            return None;
        }
        let union = minimum_area_rectangle(&convex_hull(&[&one.hull[..], &two.hull].concat()))?;
        let excess = (union.size[0] - size.length).max(0.0) + (union.size[1] - size.width).max(0.0);
        let perimeter = 2.0 * (union.size[0] + union.size[1]);
        let cost =
            gap + self.params.perimeter_weight * perimeter + self.params.excess_weight * excess;
        let versions = [one.version, two.version];
        Some(Candidate { cost, groups: [a, b], versions, gap, union })
    }

    fn run(&mut self) {
        while let Some(candidate) = self.queue.pop() {
            let [a, b] = candidate.groups;
            let is_current = [a, b].iter().zip(candidate.versions).all(|(&group, version)| {
                self.parent[group] == group && self.groups[group].version == version
            });
            if !is_current {
                continue;
            }
            if let Some(join) = self.judge(&candidate) {
                self.join(a, b, join);
            }
        }
    }

    /// Whether a pair belongs together, and why.
    fn judge(&self, candidate: &Candidate) -> Option<Join> {
        let [a, b] = candidate.groups;
        let size = self.fragments[a].size?;
        let params = self.params;
        let touching = (params.touching_share * size.width).min(params.touching);
        let scale = params.slack - (params.slack - 1.0) * candidate.gap / size.width;
        let limit = [size.length * scale, size.width * scale];
        let union = candidate.union.size;
        let evidence = if candidate.gap <= touching {
            Evidence::Touching
        } else if union[0] <= limit[0] && union[1] <= limit[1] {
            Evidence::Fits
        } else {
            return None;
        };
        let (target, query) = (a as u32 + 1, b as u32 + 1);
        Some(Join { target, query, gap: candidate.gap, union, limit, evidence })
    }

    /// The later group joins the earlier one, whose pairs are proposed anew.
    fn join(&mut self, a: usize, b: usize, join: Join) {
        self.parent[b] = a;
        let hull = convex_hull(&[&self.groups[a].hull[..], &self.groups[b].hull].concat());
        let version = self.groups[a].version + 1;
        self.groups[a] = Group { version, ..Group::new(hull) };
        self.joins.push(join);
        self.enter(a);
        self.propose(a);
    }

    fn numbered(&self) -> Vec<u32> {
        let root = |mut piece: usize| {
            while self.parent[piece] != piece {
                piece = self.parent[piece];
            }
            piece
        };
        let mut number = vec![0; self.parent.len()];
        let mut count = 0;
        let numbers = (0..self.parent.len()).map(|piece| {
            let root = root(piece);
            if number[root] == 0 {
                count += 1;
                number[root] = count;
            }
            number[root]
        });
        numbers.collect()
    }
}

impl Group {
    fn new(hull: Vec<PlanePoint>) -> Self {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for corner in &hull {
            for axis in 0..2 {
                low[axis] = low[axis].min(corner[axis]);
                high[axis] = high[axis].max(corner[axis]);
            }
        }
        Group { hull, low, high, version: 0 }
    }
}

/// The cheapest candidate is the greatest, ties going to the earlier groups.
impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then_with(|| other.groups.cmp(&self.groups))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cluster::params::ClusterParams;

    const CAR: ClassSize = ClassSize { length: 4.5, width: 1.9 };

    /// A piece of a car: the box between two corners.
    fn piece(low: PlanePoint, high: PlanePoint) -> Fragment {
        let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
        Fragment { class: 1, size: Some(CAR), hull: convex_hull(&corners) }
    }

    fn groups(fragments: &[Fragment]) -> Vec<u32> {
        let params = ClusterParams::best().fragments.expect("best assembles fragments");
        assemble(fragments, &params).0
    }

    #[test]
    fn the_halves_of_a_car_behind_a_pole_are_one() {
        let halves = [piece([0.0, 0.0], [1.6, 1.8]), piece([2.3, 0.0], [4.3, 1.8])];
        assert_eq!(groups(&halves), [1, 1]);
    }

    #[test]
    fn two_whole_cars_end_to_end_are_two() {
        let cars = [piece([0.0, 0.0], [4.4, 1.8]), piece([5.0, 0.0], [9.4, 1.8])];
        assert_eq!(groups(&cars), [1, 2]);
    }

    #[test]
    fn cars_side_by_side_in_bays_are_two() {
        let cars = [piece([0.0, 0.0], [4.4, 1.8]), piece([0.0, 2.4], [4.4, 4.2])];
        assert_eq!(groups(&cars), [1, 2]);
    }

    #[test]
    fn other_classes_and_unknown_sizes_stay_apart() {
        let mut pieces = [piece([0.0, 0.0], [1.0, 1.0]), piece([1.1, 0.0], [2.0, 1.0])];
        assert_eq!(groups(&pieces), [1, 1]);
        pieces[1].class = 2;
        assert_eq!(groups(&pieces), [1, 2]);
        pieces[1].class = 1;
        pieces[1].size = None;
        assert_eq!(groups(&pieces), [1, 2]);
    }

    #[test]
    fn a_growing_group_reaches_farther_pieces() {
        let pieces = [
            piece([0.0, 0.0], [1.0, 1.8]),
            piece([3.2, 0.0], [4.2, 1.8]),
            piece([1.2, 0.0], [3.0, 1.8]),
        ];
        assert_eq!(groups(&pieces), [1, 1, 1]);
    }

    #[test]
    fn nothing_and_pieces_without_points() {
        assert_eq!(groups(&[]), []);
        let empty = Fragment { class: 1, size: Some(CAR), hull: Vec::new() };
        assert_eq!(groups(&[empty.clone(), piece([0.0, 0.0], [1.0, 1.0]), empty]), [1, 2, 3]);
    }
}
