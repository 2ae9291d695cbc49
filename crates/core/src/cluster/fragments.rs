//! Fragments of one object found together by size: the merge that preset `best` makes on the
//! bird's-eye plane in place of the paper's overlap test (section III.E).
//!
//! An occluded or dark object comes out of the votes in pieces. Two pieces of one class, or of two
//! that are easily taken for each other, belong together when they all but touch, or when the
//! rectangle around both still fits an object of that class; a wide gap between them asks for a
//! tight fit. The pair with the least evidence against it goes first, and outlines grow as pieces
//! join. Classes that only look alike, a person and a rider, are cut apart, since the two do meet:
//! pieces of them must touch, and fit what the larger is. The outline of a few pixels says little:
//! they wait until the larger pieces around them have become what they are.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use serde::Serialize;

use super::cells::{Cells, Layer};
use super::params::FragmentMerge;
use crate::cloud::taxonomy::ClassSize;
use crate::geometry::disjoint_sets::DisjointSets;
use crate::geometry::footprint::{
    PlanePoint, Rectangle, area, convex_hull, distance, minimum_area_rectangle,
};

/// One piece: its class, that class's family and usual size, and its outline on the bird's-eye
/// plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Fragment {
    /// Class number.
    pub class: u16,
    /// Number of the family of classes that may be one object.
    pub family: u16,
    /// A bit for each group of look-alikes that the class is in; classes that share one may be one
    /// object where they touch.
    pub lookalikes: u8,
    /// Usual size of the class; pieces of a class without one are left alone.
    pub size: Option<ClassSize>,
    /// Convex hull in metres; empty for a piece without points.
    pub hull: Vec<PlanePoint>,
    /// Its pixels.
    pub pixels: u32,
}

/// Two groups of pieces became one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Join {
    /// First piece (from 1) of the group that stays.
    pub target: u32,
    /// First piece (from 1) of the group that joined it.
    pub query: u32,
    /// Distance between their outlines in metres; without classes that of the two pixels which
    /// joined them.
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

/// For each piece (from 0) the group it belongs to, groups numbered from 1 in the order of their
/// first pieces, and the joins in the order in which they were made.
///
/// Steps: pieces that touch join, in any order; then of all pairs that belong together the one with
/// the least evidence against it joins, and what that group has become is compared with its
/// neighbours anew. Time grows with the pairs of pieces nearer than their class is wide; of these
/// only the ones that come up before either has joined another are measured.
pub fn assemble(fragments: &[Fragment], params: &FragmentMerge) -> (Vec<u32>, Vec<Join>) {
    let mut assembly = Assembly::new(fragments, params);
    assembly.join_touching();
    assembly.join_belonging();
    (assembly.sets.numbered(), assembly.joins)
}

/// The layer of all classes that look like others; no class has this number.
const LOOKALIKES: u16 = u16::MAX;

/// A class and the usual size of its objects.
#[derive(Debug, Clone, Copy)]
struct Kind {
    class: u16,
    family: u16,
    lookalikes: u8,
    size: Option<ClassSize>,
}

/// A group of pieces, under the number of its first piece.
struct Group {
    hull: Vec<PlanePoint>,
    low: PlanePoint,
    high: PlanePoint,
    /// Square metres within the hull.
    area: f64,
    /// Pixels of its pieces.
    pixels: u32,
    /// What its larger part is.
    kind: Kind,
    /// How often it has grown; a candidate that knew it smaller is out of date.
    version: u32,
}

/// A pair of groups that may belong together.
struct Candidate {
    /// What it costs to join them; before they are measured no more than that.
    cost: f64,
    groups: [usize; 2],
    versions: [u32; 2],
    /// Once measured.
    join: Option<Join>,
}

struct Assembly<'a> {
    fragments: &'a [Fragment],
    params: &'a FragmentMerge,
    groups: Vec<Group>,
    sets: DisjointSets,
    cells: Cells,
    /// Whether the pieces that touch have been put together.
    has_grown: bool,
    queue: BinaryHeap<Candidate>,
    joins: Vec<Join>,
}

impl<'a> Assembly<'a> {
    fn new(fragments: &'a [Fragment], params: &'a FragmentMerge) -> Self {
        Assembly {
            fragments,
            params,
            groups: fragments.iter().map(Group::of_piece).collect(),
            sets: DisjointSets::new(fragments.len()),
            cells: Cells::default(),
            has_grown: false,
            queue: BinaryHeap::new(),
            joins: Vec::new(),
        }
    }

    /// Joins the pieces that touch as they are, outlines not growing meanwhile.
    fn join_touching(&mut self) {
        for number in 0..self.groups.len() {
            let Some(size) =
                self.groups[number].kind.size.filter(|_| !self.groups[number].hull.is_empty())
            else {
                continue;
            };
            let group = &self.groups[number];
            let reach = self.params.touching_gap(size);
            for other in self.cells.near(self.layer(number), group.low, group.high, reach) {
                let (one, two) = (self.sets.root(number), self.sets.root(other));
                if self.fragments[number].family != self.fragments[other].family {
                    continue;
                }
                if one == two || self.groups[number].least_distance(&self.groups[other]) > reach {
                    continue;
                }
                let gap = distance(&self.groups[number].hull, &self.groups[other].hull);
                if gap <= reach && !self.are_side_by_side(number, other, size) {
                    let (a, b) = (one.min(two), one.max(two));
                    let (target, query) = (a as u32 + 1, b as u32 + 1);
                    self.sets.join(a, b);
                    self.joins.push(Join { target, query, gap, evidence: Evidence::Touching });
                }
            }
            let group = &self.groups[number];
            self.cells.insert(self.layer(number), number, group.low, group.high);
        }
        self.outline_groups();
    }

    /// Gives every group the outline of its pieces.
    fn outline_groups(&mut self) {
        let mut corners: Vec<Vec<PlanePoint>> = vec![Vec::new(); self.groups.len()];
        let mut pixels = vec![0; self.groups.len()];
        let mut largest: Vec<usize> = (0..self.groups.len()).collect();
        for number in 0..self.groups.len() {
            let root = self.sets.root(number);
            let piece = &self.groups[number];
            corners[root].extend(&piece.hull);
            pixels[root] += piece.pixels;
            if piece.pixels > self.groups[largest[root]].pixels {
                largest[root] = number;
            }
        }
        let kinds: Vec<Kind> = largest.iter().map(|&piece| self.groups[piece].kind).collect();
        for (number, corners) in corners.into_iter().enumerate() {
            if self.sets.is_root(number) {
                self.groups[number] =
                    Group::new(convex_hull(&corners), pixels[number], kinds[number]);
            }
        }
    }

    /// Whether the rectangle around two groups that touch is too wide for one object.
    fn are_side_by_side(&self, a: usize, b: usize, size: ClassSize) -> bool {
        let (one, two) = (&self.groups[a], &self.groups[b]);
        let [x, y] = [0, 1].map(|axis: usize| {
            one.high[axis].max(two.high[axis]) - one.low[axis].min(two.low[axis])
        });
        let widest = self.params.widest(size);
        x.hypot(y) > widest && self.union(a, b).is_some_and(|union| union.size[1] > widest)
    }

    /// Joins the groups that belong together until there are none.
    fn join_belonging(&mut self) {
        self.has_grown = true;
        self.cells = Cells::default();
        for number in 0..self.groups.len() {
            self.propose(number);
            self.enter(number);
        }
        while let Some(candidate) = self.queue.pop() {
            let Candidate { groups: [a, b], versions, join, .. } = candidate;
            let is_current = [a, b].iter().zip(versions).all(|(&group, version)| {
                self.sets.is_root(group) && self.groups[group].version == version
            });
            match join {
                _ if !is_current => {}
                None => self.queue.extend(self.judge(a, b)),
                Some(join) => {
                    self.join(join);
                    self.propose(a);
                    self.enter(a);
                }
            }
        }
    }

    /// Size of a group's class, if it can join others at all.
    fn size(&self, group: usize) -> Option<ClassSize> {
        let can_join = self.sets.is_root(group) && !self.groups[group].hull.is_empty();
        self.groups[group].kind.size.filter(|_| can_join)
    }

    /// Where the groups of a family lie by their place. All of a family share cells of one side,
    /// whatever their class.
    fn layer(&self, number: usize) -> Layer {
        let side = if self.has_grown { 2.0 } else { 2.0 * self.params.touching };
        let piece = &self.fragments[number];
        Layer { number: if piece.lookalikes == 0 { piece.family } else { LOOKALIKES }, side }
    }

    fn enter(&mut self, number: usize) {
        if self.size(number).is_some() {
            let layer = self.layer(number);
            let group = &self.groups[number];
            self.cells.insert(layer, number, group.low, group.high);
        }
    }

    /// Queues the pairs of a group with the groups of its class in reach, as far as they have been
    /// entered.
    fn propose(&mut self, number: usize) {
        let Some(size) = self.size(number) else {
            return;
        };
        let reach = self.params.bridged_gap(size);
        let group = &self.groups[number];
        for other in self.cells.near(self.layer(number), group.low, group.high, reach) {
            if other == number || !self.sets.is_root(other) {
                continue;
            }
            let (a, b) = (number.min(other), number.max(other));
            let least = group.least_distance(&self.groups[other]);
            let may_touch = least <= self.params.touching_gap(size);
            if least <= reach && (may_touch || !self.is_too_large(a, b, size)) {
                self.queue.push(Candidate {
                    cost: least + self.wait(a, b),
                    groups: [a, b],
                    versions: [self.groups[a].version, self.groups[b].version],
                    join: None,
                });
            }
        }
    }

    /// Metres of gap that the smaller of two groups has to wait for its want of pixels.
    fn wait(&self, a: usize, b: usize) -> f64 {
        self.params.wait / f64::from(self.groups[a].pixels.min(self.groups[b].pixels).max(1))
    }

    /// What the larger of two groups is, and so the union.
    fn kind_of_larger(&self, a: usize, b: usize) -> Kind {
        let larger = if self.groups[b].pixels > self.groups[a].pixels { b } else { a };
        self.groups[larger].kind
    }

    /// Whether no rectangle of an accepted size can hold two groups that do not touch: they reach
    /// farther than its diagonal, or cover more than its area.
    fn is_too_large(&self, a: usize, b: usize, size: ClassSize) -> bool {
        let (one, two) = (&self.groups[a], &self.groups[b]);
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

    /// Measures a pair: what joining it costs and why it belongs together; `None` if it does not.
    fn judge(&self, a: usize, b: usize) -> Option<Candidate> {
        let size = self.kind_of_larger(a, b).size?;
        let (one, two) = (&self.groups[a], &self.groups[b]);
        let touching = self.params.touching_gap(size);
        let gap = distance(&one.hull, &two.hull);
        let is_touching = gap <= touching;
        let is_family = one.kind.family == two.kind.family;
        let may_be_one = is_family || one.kind.lookalikes & two.kind.lookalikes != 0;
        let may_fit = || one.kind.class == two.kind.class && !self.is_too_large(a, b, size);
        if !may_be_one || gap >= self.params.bridged_gap(size) || (!is_touching && !may_fit()) {
            return None;
        }
        let union = self.union(a, b)?.size;
        let limit = self.params.longest_sides(size, gap);
        let fits = union[0] <= limit[0] && union[1] <= limit[1];
        let evidence = if is_touching && is_family && union[1] <= self.params.widest(size) {
            Evidence::Touching
        } else if fits {
            Evidence::Fits { union, limit }
        } else {
            return None;
        };
        let against = match evidence {
            Evidence::Fits { .. } => {
                let excess = (union[0] - size.length).max(0.0) + (union[1] - size.width).max(0.0);
                let perimeter = 2.0 * (union[0] + union[1]);
                self.params.perimeter_weight * perimeter + self.params.excess_weight * excess
            }
            _ => 0.0,
        };
        let (target, query) = (a as u32 + 1, b as u32 + 1);
        Some(Candidate {
            cost: gap + against + self.wait(a, b),
            groups: [a, b],
            versions: [one.version, two.version],
            join: Some(Join { target, query, gap, evidence }),
        })
    }

    /// The later group joins the earlier one.
    fn join(&mut self, join: Join) {
        let (a, b) = (join.target as usize - 1, join.query as usize - 1);
        let (one, two) = (&self.groups[a], &self.groups[b]);
        let hull = convex_hull(&[&one.hull[..], &two.hull].concat());
        let grown = Group::new(hull, one.pixels + two.pixels, self.kind_of_larger(a, b));
        self.groups[a] = Group { version: one.version + 1, ..grown };
        self.sets.join(a, b);
        self.joins.push(join);
    }
}

impl Group {
    fn of_piece(piece: &Fragment) -> Self {
        let Fragment { class, family, lookalikes, size, .. } = *piece;
        let kind = Kind { class, family, lookalikes, size };
        Group::new(piece.hull.clone(), piece.pixels, kind)
    }

    fn new(hull: Vec<PlanePoint>, pixels: u32, kind: Kind) -> Self {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for corner in &hull {
            for axis in 0..2 {
                low[axis] = low[axis].min(corner[axis]);
                high[axis] = high[axis].max(corner[axis]);
            }
        }
        let area = area(&hull);
        Group { hull, low, high, area, pixels, kind, version: 0 }
    }

    /// Distance between the boxes around two groups, metres: they are no nearer to each other.
    fn least_distance(&self, other: &Group) -> f64 {
        let [x, y] = [0, 1].map(|axis: usize| {
            (self.low[axis].max(other.low[axis]) - self.high[axis].min(other.high[axis])).max(0.0)
        });
        x.hypot(y)
    }
}

/// The cheapest candidate is the greatest; at the same cost one that is not measured yet, then that
/// of the earlier groups.
impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_cost = other.cost.total_cmp(&self.cost);
        let measured = || other.join.is_some().cmp(&self.join.is_some());
        by_cost.then_with(measured).then_with(|| other.groups.cmp(&self.groups))
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
        Fragment {
            class: 1,
            family: 1,
            lookalikes: 0,
            size: Some(CAR),
            hull: convex_hull(&corners),
            pixels: 9,
        }
    }

    fn best() -> FragmentMerge {
        ClusterParams::best().fragments.expect("best assembles fragments")
    }

    fn groups(fragments: &[Fragment]) -> Vec<u32> {
        assemble(fragments, &best()).0
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
        (pieces[1].class, pieces[1].family) = (2, 2);
        assert_eq!(groups(&pieces), [1, 2]);
        (pieces[1].class, pieces[1].family) = (1, 1);
        pieces[1].size = None;
        assert_eq!(groups(&pieces), [1, 2]);
    }

    #[test]
    fn kindred_classes_are_one_family() {
        let mut pieces = [piece([0.0, 0.0], [2.0, 1.8]), piece([2.1, 0.0], [4.2, 1.8])];
        (pieces[1].class, pieces[1].pixels) = (2, 5);
        assert_eq!(groups(&pieces), [1, 1]);
    }

    #[test]
    fn look_alikes_join_where_they_touch_and_fit_the_larger() {
        let of = |class: u16, size, low, high, pixels| {
            let lookalikes = 1;
            Fragment {
                class,
                family: class,
                lookalikes,
                size: Some(size),
                pixels,
                ..piece(low, high)
            }
        };
        let person = ClassSize { length: 0.73, width: 0.67 };
        let rider = ClassSize { length: 1.7, width: 0.6 };
        let body = of(1, person, [0.0, 0.0], [0.5, 0.3], 60);
        let arm = of(2, rider, [0.5, 0.0], [0.6, 0.3], 9);
        assert_eq!(groups(&[body.clone(), arm.clone()]), [1, 1]);
        let unlike = Fragment { lookalikes: 2, ..arm.clone() };
        assert_eq!(groups(&[body.clone(), unlike]), [1, 2]);
        let apart = of(2, rider, [0.7, 0.0], [0.8, 0.3], 9);
        assert_eq!(groups(&[body.clone(), apart]), [1, 2]);
        let beside = of(2, rider, [0.5, 0.0], [2.0, 0.3], 9);
        assert_eq!(groups(&[body, beside]), [1, 2], "too long for a person");
    }

    #[test]
    fn the_union_fits_the_class_of_the_larger_part() {
        let bus = ClassSize { length: 10.5, width: 2.9 };
        let mut pieces = [piece([0.0, 0.0], [2.0, 1.8]), piece([3.5, 0.0], [9.0, 1.8])];
        pieces[1].size = Some(bus);
        pieces[1].pixels = 200;
        assert_eq!(groups(&pieces), [1, 1]);
        pieces[1].pixels = 2;
        assert_eq!(groups(&pieces), [1, 2]);
    }

    #[test]
    fn cars_that_touch_along_their_sides_are_two() {
        let cars = [piece([0.0, 0.0], [4.4, 1.8]), piece([0.0, 1.9], [4.4, 3.7])];
        assert_eq!(groups(&cars), [1, 2]);
    }

    /// The front and the rear of a car, and behind it single pixels of a wall that are called car:
    /// each could join a part, and what is left would be too large.
    #[test]
    fn single_pixels_wait_for_the_parts_of_an_object() {
        let mut pieces = vec![piece([0.0, 0.0], [1.5, 1.8]), piece([3.0, 0.0], [4.5, 1.8])];
        let ghost = Fragment { pixels: 1, ..piece([-1.4, 0.9], [-1.4, 0.9]) };
        pieces.push(ghost.clone());
        assert_eq!(groups(&pieces), [1, 1, 2]);
        let impatient = FragmentMerge { wait: 0.0, ..best() };
        assert_eq!(assemble(&pieces, &impatient).0, [1, 2, 1]);
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
        let empty = Fragment {
            class: 1,
            family: 1,
            lookalikes: 0,
            size: Some(CAR),
            hull: Vec::new(),
            pixels: 0,
        };
        assert_eq!(groups(&[empty.clone(), piece([0.0, 0.0], [1.0, 1.0]), empty]), [1, 2, 3]);
    }
}
