//! The order in which pieces are put together: those that touch, then the cheapest pair of all.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::cells::{Cells, Layer};
use super::group::{Fragment, FragmentClass, Group, SizeTest};
use crate::cloud::taxonomy::ClassSize;
use crate::cluster::params::FragmentMerge;
use crate::cluster::post_merge::{Evidence, Join, PostMerge};
use crate::geometry::disjoint_sets::DisjointSets;
use crate::geometry::footprint::{PlanePoint, convex_hull, distance};

/// The layer of all classes that look like others; no class has this number.
const LOOKALIKES: u16 = u16::MAX;

/// A pair of groups that may belong together.
struct Candidate {
    /// What it costs to join them; before they are measured no more than that.
    cost: f64,
    groups: [usize; 2],
    versions: [u32; 2],
    /// Once measured.
    join: Option<Join>,
}

/// Groups of pieces while they are put together; a group stands under the number of its first
/// piece.
pub(super) struct Assembly<'a> {
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
    pub fn new(fragments: &'a [Fragment], params: &'a FragmentMerge) -> Self {
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

    /// The instances, the joins and the last outlines.
    pub fn finish(mut self) -> PostMerge {
        let instance = self.sets.numbered();
        let groups = (0..).zip(self.groups).filter(|&(number, _)| self.sets.is_root(number));
        let groups = groups.map(|(_, group)| group).collect();
        PostMerge { instance, joins: self.joins, groups, ..PostMerge::default() }
    }

    /// Joins the pieces that touch as they are, outlines not growing meanwhile.
    pub fn join_touching(&mut self) {
        for number in 0..self.groups.len() {
            let Some(size) =
                self.groups[number].class.size.filter(|_| !self.groups[number].hull.is_empty())
            else {
                continue;
            };
            let (layer, group) = (self.layer(number), &self.groups[number]);
            let reach = self.params.touching_gap(size);
            let mut others = self.cells.near(layer, group.low, group.high, reach);
            let family = |number: usize| self.fragments[number].class.family;
            others.retain(|&(other, _)| family(number) == family(other));
            others.sort_unstable_by_key(|&(other, _)| other);
            for (other, _) in others {
                let Some([one, two]) = self.sets.apart(number, other) else {
                    continue;
                };
                let gap = distance(&self.groups[number].hull, &self.groups[other].hull);
                if gap <= reach && !self.are_side_by_side(number, other, size) {
                    let (a, b) = (one.min(two), one.max(two));
                    let (target, query) = (a as u32 + 1, b as u32 + 1);
                    self.sets.join(a, b);
                    self.joins.push(Join { target, query, gap, evidence: Evidence::Touching });
                }
            }
            let group = &self.groups[number];
            self.cells.insert(layer, number, group.low, group.high);
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
        let class = |&piece: &usize| self.groups[piece].class;
        let classes: Vec<FragmentClass> = largest.iter().map(class).collect();
        for (number, corners) in corners.into_iter().enumerate() {
            if self.sets.is_root(number) {
                self.groups[number] =
                    Group::new(convex_hull(&corners), pixels[number], classes[number]);
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
        x.hypot(y) > widest
            && !one.is_narrow_with(two, widest)
            && one.rectangle_with(two).is_some_and(|union| union.size[1] > widest)
    }

    /// Joins the groups that belong together, the cheapest pair first, until there are none.
    pub fn join_cheapest_first(&mut self) {
        self.has_grown = true;
        self.cells = Cells::default();
        for number in 0..self.groups.len() {
            self.queue_neighbours(number);
            self.insert(number);
        }
        while let Some(candidate) = self.queue.pop() {
            let Candidate { groups: [a, b], versions, join, .. } = candidate;
            let is_current = [a, b].iter().zip(versions).all(|(&group, version)| {
                self.sets.is_root(group) && self.groups[group].version == version
            });
            match join {
                _ if !is_current => {}
                None => self.queue.extend(self.measure(a, b)),
                Some(join) => {
                    self.join(join);
                    self.queue_neighbours(a);
                    self.insert(a);
                }
            }
        }
    }

    /// Size of a group's class, if it can join others at all.
    fn size(&self, group: usize) -> Option<ClassSize> {
        let can_join = self.sets.is_root(group) && !self.groups[group].hull.is_empty();
        self.groups[group].class.size.filter(|_| can_join)
    }

    /// Where the groups of a family lie by their place. All of a family share cells of one side,
    /// whatever their class.
    fn layer(&self, number: usize) -> Layer {
        let side = if self.has_grown { 2.0 } else { 2.0 * self.params.touching };
        let class = self.fragments[number].class;
        Layer { number: if class.lookalikes == 0 { class.family } else { LOOKALIKES }, side }
    }

    /// Makes a group one that others can be queued with.
    fn insert(&mut self, number: usize) {
        if self.size(number).is_some() {
            let layer = self.layer(number);
            let group = &self.groups[number];
            self.cells.insert(layer, number, group.low, group.high);
        }
    }

    /// Queues the pairs of a group with the groups of its class in reach, as far as they have been
    /// entered.
    fn queue_neighbours(&mut self, number: usize) {
        let Some(size) = self.size(number) else {
            return;
        };
        let reach = self.params.bridged_gap(size);
        let (layer, group) = (self.layer(number), &self.groups[number]);
        for (other, squared) in self.cells.near(layer, group.low, group.high, reach) {
            if other == number || !self.sets.is_root(other) {
                continue;
            }
            let (a, b) = (number.min(other), number.max(other));
            let least = squared.sqrt();
            let may_touch = least <= self.params.touching_gap(size);
            if may_touch || !self.is_too_large(a, b, size) {
                self.queue.push(Candidate {
                    cost: least + self.delay(a, b),
                    groups: [a, b],
                    versions: [self.groups[a].version, self.groups[b].version],
                    join: None,
                });
            }
        }
    }

    /// Metres of gap by which a pair comes later because the smaller group has few pixels.
    fn delay(&self, a: usize, b: usize) -> f64 {
        self.params.delay / f64::from(self.groups[a].pixels.min(self.groups[b].pixels).max(1))
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

    /// Measures a pair: what joining it costs and why it belongs together; `None` if it does not.
    fn measure(&self, a: usize, b: usize) -> Option<Candidate> {
        let (one, two) = (&self.groups[a], &self.groups[b]);
        let size = one.class_of_larger(two).size?;
        let gap = distance(&one.hull, &two.hull);
        let is_touching = gap <= self.params.touching_gap(size);
        let may_fit = || one.class.number == two.class.number && !self.is_too_large(a, b, size);
        let is_out_of_reach = gap >= self.params.bridged_gap(size);
        if !one.may_be_one_with(two) || is_out_of_reach || (!is_touching && !may_fit()) {
            return None;
        }
        let (evidence, against) = self.evidence([one, two], gap, size)?;
        let (target, query) = (a as u32 + 1, b as u32 + 1);
        Some(Candidate {
            cost: gap + against + self.delay(a, b),
            groups: [a, b],
            versions: [one.version, two.version],
            join: Some(Join { target, query, gap, evidence }),
        })
    }

    /// Why two groups belong together, and what speaks against it in metres of gap; `None` if they
    /// do not.
    fn evidence(
        &self,
        [one, two]: [&Group; 2],
        gap: f64,
        size: ClassSize,
    ) -> Option<(Evidence, f64)> {
        let may_touch =
            gap <= self.params.touching_gap(size) && one.class.family == two.class.family;
        if may_touch && one.is_narrow_with(two, self.params.widest(size)) {
            return Some((Evidence::Touching, 0.0));
        }
        let test = SizeTest::new([one, two], gap, size, self.params)?;
        if may_touch && test.is_narrow() {
            return Some((Evidence::Touching, 0.0));
        }
        let SizeTest { union, limit, .. } = test;
        let against = || self.evidence_against(union, size);
        test.fits().then(|| (Evidence::Fits { union, limit }, against()))
    }

    /// Metres of gap that the rectangle around two groups weighs in the order of joins: the more,
    /// the larger it is and the farther it exceeds the usual size.
    fn evidence_against(&self, union: [f64; 2], size: ClassSize) -> f64 {
        let excess = (union[0] - size.length).max(0.0) + (union[1] - size.width).max(0.0);
        let perimeter = 2.0 * (union[0] + union[1]);
        self.params.perimeter_weight * perimeter + self.params.excess_weight * excess
    }

    /// The later group joins the earlier one.
    fn join(&mut self, join: Join) {
        let (a, b) = (join.target as usize - 1, join.query as usize - 1);
        let (one, two) = (&self.groups[a], &self.groups[b]);
        let hull = convex_hull(&[&one.hull[..], &two.hull].concat());
        let grown = Group::new(hull, one.pixels + two.pixels, one.class_of_larger(two));
        self.groups[a] = Group { version: one.version + 1, ..grown };
        self.sets.join(a, b);
        self.joins.push(join);
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
