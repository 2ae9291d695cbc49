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

use super::cells::{Cells, Layer};
use super::params::FragmentMerge;
use crate::footprint::{
    PlanePoint, Rectangle, area, convex_hull, distance, minimum_area_rectangle,
};
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
    /// Distance between their outlines in metres; without classes that of the two pixels which joined
    /// them.
    pub gap: f64,
    /// Why they became one.
    pub evidence: Evidence,
}

/// Why two groups of pieces became one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Evidence {
    /// They all but touch.
    Touching,
    /// The rectangle around both fits an object of their class.
    Fits {
        /// Its sides in metres, the longer first.
        union: [f64; 2],
        /// The longest sides that are accepted across their gap, metres.
        limit: [f64; 2],
    },
    /// One of them is a leftover, and the other is the nearest to it (objects without a class).
    Leftover {
        /// Pixels of the leftover.
        pixels: usize,
    },
}

/// For each piece (from 0) the group it belongs to, groups numbered from 1 in the order of their first
/// pieces, and the joins in the order in which they were made.
///
/// Steps: pieces that touch join until none do; then of all pairs that belong together the one with the
/// least evidence against it joins, and what that group has become is compared with its neighbours anew.
/// Time grows with the pairs of pieces nearer than their class is wide.
pub fn assemble(fragments: &[Fragment], params: &FragmentMerge) -> (Vec<u32>, Vec<Join>) {
    let mut assembly = Assembly::new(fragments, params);
    assembly.join_touching();
    assembly.join_fitting();
    (assembly.numbered(), assembly.joins)
}

/// A group of pieces, under the number of its first piece.
struct Group {
    hull: Vec<PlanePoint>,
    low: PlanePoint,
    high: PlanePoint,
    /// Square metres within the hull.
    area: f64,
    /// How often it has grown; a candidate that knew it smaller is out of date.
    version: u32,
}

/// A pair of groups that belong together.
struct Candidate {
    cost: f64,
    groups: [usize; 2],
    versions: [u32; 2],
    join: Join,
}

struct Assembly<'a> {
    fragments: &'a [Fragment],
    params: &'a FragmentMerge,
    groups: Vec<Group>,
    parent: Vec<usize>,
    cells: Cells,
    /// Whether the pieces that touch have been put together.
    has_grown: bool,
    queue: BinaryHeap<Candidate>,
    joins: Vec<Join>,
}

impl<'a> Assembly<'a> {
    fn new(fragments: &'a [Fragment], params: &'a FragmentMerge) -> Self {
        let mut assembly = Assembly {
            fragments,
            params,
            groups: fragments.iter().map(|f| Group::new(f.hull.clone())).collect(),
            parent: (0..fragments.len()).collect(),
            cells: Cells::default(),
            has_grown: false,
            queue: BinaryHeap::new(),
            joins: Vec::new(),
        };
        for number in 0..fragments.len() {
            assembly.enter(number);
        }
        assembly
    }

    /// Size of a group's class, if it can join others at all.
    fn size(&self, group: usize) -> Option<ClassSize> {
        self.fragments[group].size.filter(|_| !self.groups[group].hull.is_empty())
    }

    /// Where the groups of a class lie by their place: while only touching counts in cells of that reach,
    /// then in cells of the class's width.
    fn layer(&self, number: usize, size: ClassSize) -> Layer {
        let side = if self.has_grown { size.width } else { 2.0 * self.params.touching_gap(size) };
        Layer { number: self.fragments[number].class, side }
    }

    fn enter(&mut self, number: usize) {
        if let Some(size) = self.size(number) {
            let layer = self.layer(number, size);
            let group = &self.groups[number];
            self.cells.insert(layer, number, group.low, group.high);
        }
    }

    /// The groups of the same class whose boxes are within `reach` metres of a group's.
    fn near(&self, number: usize, size: ClassSize, reach: f64) -> Vec<usize> {
        let group = &self.groups[number];
        let layer = self.layer(number, size);
        let mut near = self.cells.near(layer, group.low, group.high, reach);
        near.retain(|&other| {
            let other = (other != number).then(|| &self.groups[other]);
            other.is_some_and(|other| {
                (0..2).all(|axis| {
                    let from = group.low[axis].max(other.low[axis]);
                    from - group.high[axis].min(other.high[axis]) <= reach
                })
            })
        });
        near
    }

    fn is_group(&self, number: usize) -> bool {
        self.parent[number] == number
    }

    /// Pieces that touch are one whatever their size, so their order does not matter: first those that
    /// touch as they are, then those that touch the outlines of what has grown together.
    fn join_touching(&mut self) {
        self.join_touching_pieces();
        let mut waiting: Vec<usize> = (0..self.groups.len()).rev().collect();
        while let Some(number) = waiting.pop() {
            let Some(size) = self.size(number).filter(|_| self.is_group(number)) else {
                continue;
            };
            let touching = self.params.touching_gap(size);
            let mut own = number;
            let before = self.joins.len();
            for other in self.near(number, size, touching) {
                if !self.is_group(other) || other == own {
                    continue;
                }
                let gap = distance(&self.groups[own].hull, &self.groups[other].hull);
                if gap <= touching {
                    let (a, b) = (own.min(other), own.max(other));
                    let (target, query) = (a as u32 + 1, b as u32 + 1);
                    self.join(Join { target, query, gap, evidence: Evidence::Touching });
                    own = a;
                }
            }
            if self.joins.len() > before {
                waiting.push(own);
            }
        }
    }

    /// Joins the pieces that touch as they are, outlines not growing meanwhile.
    fn join_touching_pieces(&mut self) {
        for number in 0..self.groups.len() {
            let Some(size) = self.size(number) else {
                continue;
            };
            let touching = self.params.touching_gap(size);
            for other in self.near(number, size, touching) {
                let (one, two) = (self.root(number), self.root(other));
                if other > number || one == two {
                    continue;
                }
                let gap = distance(&self.groups[number].hull, &self.groups[other].hull);
                if gap <= touching {
                    let (a, b) = (one.min(two), one.max(two));
                    let (target, query) = (a as u32 + 1, b as u32 + 1);
                    self.parent[b] = a;
                    self.joins.push(Join { target, query, gap, evidence: Evidence::Touching });
                }
            }
        }
        self.outline_groups();
    }

    /// Gives every group the outline of its pieces.
    fn outline_groups(&mut self) {
        let mut corners: Vec<Vec<PlanePoint>> = vec![Vec::new(); self.groups.len()];
        for number in 0..self.groups.len() {
            let root = self.root(number);
            corners[root].extend(&self.groups[number].hull);
        }
        self.cells = Cells::default();
        self.has_grown = true;
        for (number, corners) in corners.into_iter().enumerate() {
            if self.is_group(number) {
                self.groups[number] = Group::new(convex_hull(&corners));
                self.enter(number);
            }
        }
    }

    /// The group that a piece belongs to.
    fn root(&mut self, mut piece: usize) -> usize {
        while self.parent[piece] != piece {
            self.parent[piece] = self.parent[self.parent[piece]];
            piece = self.parent[piece];
        }
        piece
    }

    fn join_fitting(&mut self) {
        for number in 0..self.groups.len() {
            self.propose(number, |other| other < number);
        }
        while let Some(Candidate { groups: [a, b], versions, join, .. }) = self.queue.pop() {
            let is_current = [a, b].iter().zip(versions).all(|(&group, version)| {
                self.is_group(group) && self.groups[group].version == version
            });
            if is_current {
                self.join(join);
                self.propose(a, |_| true);
            }
        }
    }

    /// Queues the pairs of a group with its neighbours that belong together.
    fn propose(&mut self, number: usize, with: impl Fn(usize) -> bool) {
        let Some(size) = self.size(number).filter(|_| self.is_group(number)) else {
            return;
        };
        for other in self.near(number, size, size.width) {
            if with(other)
                && self.is_group(other)
                && let Some(candidate) = self.judge(number.min(other), number.max(other), size)
            {
                self.queue.push(candidate);
            }
        }
    }

    /// Whether the boxes of two groups are near enough for their outlines to touch.
    fn may_touch(&self, one: &Group, two: &Group, touching: f64) -> bool {
        (0..2).all(|axis| {
            one.low[axis].max(two.low[axis]) - one.high[axis].min(two.high[axis]) <= touching
        })
    }

    /// Whether no rectangle of an accepted size can hold two groups that do not touch: they reach farther
    /// than its diagonal, or cover more than its area.
    fn is_too_large(&self, one: &Group, two: &Group, size: ClassSize) -> bool {
        let [length, width] = self.params.longest_sides(size, 0.0);
        let reaches_beyond = (0..2).any(|axis| {
            let high = one.high[axis].max(two.high[axis]);
            high - one.low[axis].min(two.low[axis]) > length.hypot(width)
        });
        reaches_beyond || one.area + two.area > length * width
    }

    fn union(&self, a: usize, b: usize) -> Option<Rectangle> {
        let corners = [&self.groups[a].hull[..], &self.groups[b].hull].concat();
        minimum_area_rectangle(&convex_hull(&corners))
    }

    /// Whether a pair belongs together, and why.
    fn judge(&self, a: usize, b: usize, size: ClassSize) -> Option<Candidate> {
        let (one, two) = (&self.groups[a], &self.groups[b]);
        let touching = self.params.touching_gap(size);
        if !self.may_touch(one, two, touching) && self.is_too_large(one, two, size) {
            return None;
        }
        let gap = distance(&one.hull, &two.hull);
        let is_touching = gap <= touching;
        if gap >= size.width || (!is_touching && self.is_too_large(one, two, size)) {
            return None;
        }
        let union = self.union(a, b)?.size;
        let limit = self.params.longest_sides(size, gap);
        let evidence = if is_touching {
            Evidence::Touching
        } else if union[0] <= limit[0] && union[1] <= limit[1] {
            Evidence::Fits { union, limit }
        } else {
            return None;
        };
        let excess = (union[0] - size.length).max(0.0) + (union[1] - size.width).max(0.0);
        let perimeter = 2.0 * (union[0] + union[1]);
        let (target, query) = (a as u32 + 1, b as u32 + 1);
        Some(Candidate {
            cost: gap
                + self.params.perimeter_weight * perimeter
                + self.params.excess_weight * excess,
            groups: [a, b],
            versions: [one.version, two.version],
            join: Join { target, query, gap, evidence },
        })
    }

    /// The later group joins the earlier one.
    fn join(&mut self, join: Join) {
        let (a, b) = (join.target as usize - 1, join.query as usize - 1);
        let hull = convex_hull(&[&self.groups[a].hull[..], &self.groups[b].hull].concat());
        let version = self.groups[a].version + 1;
        self.groups[a] = Group { version, ..Group::new(hull) };
        self.parent[b] = a;
        self.enter(a);
        self.joins.push(join);
    }

    fn numbered(&mut self) -> Vec<u32> {
        let mut number = vec![0; self.parent.len()];
        let mut count = 0;
        let mut numbered = Vec::with_capacity(self.parent.len());
        for piece in 0..self.parent.len() {
            let root = self.root(piece);
            if number[root] == 0 {
                count += 1;
                number[root] = count;
            }
            numbered.push(number[root]);
        }
        numbered
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
        let area = area(&hull);
        Group { hull, low, high, area, version: 0 }
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
        assert!(groups(&[]).is_empty());
        let empty = Fragment { class: 1, size: Some(CAR), hull: Vec::new() };
        assert_eq!(groups(&[empty.clone(), piece([0.0, 0.0], [1.0, 1.0]), empty]), [1, 2, 3]);
    }
}
