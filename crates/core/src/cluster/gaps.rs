//! Pieces put together by the gaps between them, for objects without a class: ours, in place of the
//! bird's-eye merge (paper, III.E), which asks for classes.
//!
//! No size is known, so only gaps count, and how densely the sensor samples:
//!
//! 1. Two pixels *touch* if they are near in space: across the ground nearer than
//!    [`GapMerge::across`], in height nearer than [`GapMerge::upright`] (both together as an
//!    ellipsoid), and both a little more where the sensor's own columns and rows lie farther apart.
//!    Height may be bridged farther because objects stand beside one another, seldom on one
//!    another, while windows, shadows of a railing and dark paint cut objects level.
//! 2. Pieces with pixels that touch are one.
//! 3. A leftover, a piece of fewer than [`GapMerge::leftover`] pixels, shows too little of itself
//!    to be told from a splinter of what stands next to it: it joins the piece nearest to it within
//!    [`GapMerge::leftover_reach`] times the reach of touching. The nearest pair goes first.
//!
//! What touches nothing stays as it is, however small.
//!
//! In the same frame of mind neighbouring pixels are connected where they touch, not by the angle:
//! at range d and a step a between beams the angle joins across a depth of d sin(a) / tan(theta), 2
//! m at 50 m.
//!
//! Time O(M log M) in the object pixels for a bounded number of pixels per cubic metre.

use std::cmp::Ordering;

use rustc_hash::FxHashMap;

use super::divide::Components;
use super::fragments::{Evidence, Join};
use super::merge::Merge;
use super::objects::ObjectPixels;
use super::params::GapMerge;
use crate::geometry::disjoint_sets::DisjointSets;

/// For each instance of the merge step (instance k at k - 1) the group it belongs to, groups
/// numbered from 1 in the order of their first pieces, and the joins in the order in which they
/// were made; pieces are instances.
pub fn join_by_gaps(
    objects: &ObjectPixels,
    components: &Components,
    merge: &Merge,
    params: &GapMerge,
) -> (Vec<u32>, Vec<Join>) {
    let mut groups = Groups::new(components, merge);
    let space = Space::new(objects, &groups, params);
    join_touching(objects, &space, &mut groups);
    join_leftovers(objects, &space, &mut groups, params);
    (groups.sets.numbered(), groups.joins)
}

/// Pieces with pixels that touch become one.
fn join_touching(objects: &ObjectPixels, space: &Space, groups: &mut Groups) {
    for cell in &space.cells {
        for pair in space.objects(cell).windows(2) {
            groups.join_pixels(objects, pair[0], pair[1], None);
        }
    }
    space.pairs_in_reach(|cell, other| {
        let (own, others) = (space.objects(cell), space.objects(other));
        if groups.of(own[0]) == groups.of(others[0]) {
            return;
        }
        let mut pairs = own.iter().flat_map(|&a| others.iter().map(move |&b| (a, b)));
        let touch =
            |&(a, b): &(u32, u32)| objects.squared_separation(a as usize, b as usize) <= 1.0;
        if let Some((a, b)) = pairs.find(touch) {
            groups.join_pixels(objects, a, b, None);
        }
    });
}

/// Leftovers join the nearest piece in reach, the nearest pair first.
fn join_leftovers(objects: &ObjectPixels, space: &Space, groups: &mut Groups, params: &GapMerge) {
    let is_leftover: Vec<bool> =
        groups.pixels.iter().map(|&pixels| pixels < params.leftover).collect();
    let root_of: Vec<usize> =
        (0..groups.pixels.len()).map(|piece| groups.sets.root(piece)).collect();
    let root = |object: u32| root_of[groups.piece[object as usize] as usize];
    let mut nearest: FxHashMap<(usize, usize), (f64, u32, u32)> = FxHashMap::default();
    let chosen = |cell: &Cell| is_leftover[root(space.objects(cell)[0])];
    space.pairs_of(chosen, params.leftover_reach, |cell, other| {
        let (own, others) = (space.objects(cell), space.objects(other));
        let (a, b) = (root(own[0]), root(others[0]));
        if a == b {
            return;
        }
        let pairs = own.iter().flat_map(|&p| others.iter().map(move |&q| (p, q)));
        let apart = pairs.filter_map(|(p, q)| {
            within(objects, p, q, params.leftover_reach).map(|apart| (apart, p.min(q), p.max(q)))
        });
        if let Some(found) = apart.min_by(order) {
            let least = nearest.entry((a.min(b), a.max(b))).or_insert(found);
            if order(&found, least).is_lt() {
                *least = found;
            }
        }
    });
    let mut pairs: Vec<_> = nearest.into_iter().collect();
    pairs.sort_unstable_by(|a, b| order(&a.1, &b.1));
    for (_, (_, p, q)) in pairs {
        let [one, other] = [p, q].map(|object| groups.of(object));
        let fewer = groups.pixels[one].min(groups.pixels[other]);
        if fewer < params.leftover {
            groups.join_pixels(objects, p, q, Some(fewer));
        }
    }
}

/// Pairs of pixels by their separation, ties by the pixels.
fn order(a: &(f64, u32, u32), b: &(f64, u32, u32)) -> Ordering {
    a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2)))
}

/// The separation of two pixels if it is at most that.
fn within(objects: &ObjectPixels, a: u32, b: u32, at_most: f64) -> Option<f64> {
    let squared = f64::from(objects.squared_separation(a as usize, b as usize));
    (squared <= at_most * at_most).then(|| squared.sqrt())
}

/// Which pieces have become one.
struct Groups {
    /// M: the piece of each object pixel from 0, or [`NO_PIECE`].
    piece: Vec<u32>,
    sets: DisjointSets,
    /// Pixels of the group under the number of its first piece.
    pixels: Vec<usize>,
    joins: Vec<Join>,
}

const NO_PIECE: u32 = u32::MAX;

impl Groups {
    fn new(components: &Components, merge: &Merge) -> Self {
        let piece = components.label.iter().map(|&label| match label {
            0 => NO_PIECE,
            label => merge.instance_of_component[label as usize - 1] - 1,
        });
        let piece: Vec<u32> = piece.collect();
        let mut pixels = vec![0; merge.count as usize];
        for &piece in piece.iter().filter(|&&piece| piece != NO_PIECE) {
            pixels[piece as usize] += 1;
        }
        let sets = DisjointSets::new(merge.count as usize);
        Groups { piece, sets, pixels, joins: Vec::new() }
    }

    /// The group of an object pixel that has a piece.
    fn of(&mut self, object: u32) -> usize {
        self.sets.root(self.piece[object as usize] as usize)
    }

    /// The groups of two pixels become one: because they touch, or because one was a leftover of so
    /// many pixels.
    fn join_pixels(&mut self, objects: &ObjectPixels, p: u32, q: u32, leftover: Option<usize>) {
        let (a, b) = (self.of(p), self.of(q));
        if a == b {
            return;
        }
        let (a, b) = (a.min(b), a.max(b));
        self.sets.join(a, b);
        self.pixels[a] += self.pixels[b];
        let [p, q] = [p, q].map(|object| objects.position[object as usize].map(f64::from));
        let gap = (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum::<f64>().sqrt();
        let evidence = leftover.map_or(Evidence::Touching, |pixels| Evidence::Leftover { pixels });
        self.joins.push(Join { target: a as u32 + 1, query: b as u32 + 1, gap, evidence });
    }
}

/// Object pixels by the cell of space they lie in. A cell is so small that all pixels in one touch.
#[derive(Default)]
struct Space {
    /// Object pixels, cell by cell.
    sorted: Vec<u32>,
    /// By place, then upwards.
    cells: Vec<Cell>,
    /// By place.
    columns: Vec<Column>,
    /// Least x of a column.
    least_x: i32,
    /// Columns of x = least_x + i are columns\[strips\[i\]..strips\[i + 1\]\].
    strips: Vec<usize>,
}

/// A cell with pixels in it.
struct Cell {
    /// Height in cells.
    level: i32,
    /// The piece of its first pixel.
    piece: u32,
    /// Its pixels are sorted\[start..end\].
    start: u32,
    end: u32,
}

/// The cells above one another.
struct Column {
    /// Place on the plane in cells.
    place: [i32; 2],
    /// Its cells are cells\[start..end\].
    start: usize,
    end: usize,
    /// How many cells its pixels reach across and upwards at most, not rounded.
    reach: [f64; 2],
}

impl Space {
    fn new(objects: &ObjectPixels, groups: &Groups, params: &GapMerge) -> Self {
        let side = [params.across, params.upright].map(|reach| reach / 3_f64.sqrt());
        let cell = |x: f32, side: f64| (f64::from(x) / side).floor() as i32;
        let key = |object: usize| {
            let [x, y, z] = objects.position[object];
            pack([cell(x, side[0]), cell(y, side[0]), cell(z, side[1])])
        };
        let placed = (0..objects.len()).filter(|&object| groups.piece[object] != NO_PIECE);
        let mut sites: Vec<(u64, u32)> =
            placed.map(|object| (key(object), object as u32)).collect();
        sites.sort_unstable();
        let mut space = Space::default();
        for column in sites.chunk_by(|a, b| a.0 >> LEVEL_BITS == b.0 >> LEVEL_BITS) {
            let start = space.cells.len();
            let mut reach = [0.0_f64; 2];
            for cell in column.chunk_by(|a, b| a.0 == b.0) {
                let start = space.sorted.len() as u32;
                let [_, _, level] = unpack(cell[0].0);
                space.sorted.extend(cell.iter().map(|site| site.1));
                let piece = groups.piece[cell[0].1 as usize];
                space.cells.push(Cell { level, piece, start, end: space.sorted.len() as u32 });
            }
            for site in column {
                let [across, upright] = objects.reach[site.1 as usize];
                reach[0] = reach[0].max(f64::from(across) / side[0]);
                reach[1] = reach[1].max(f64::from(upright) / side[1]);
            }
            let [x, y, _] = unpack(column[0].0);
            space.columns.push(Column { place: [x, y], start, end: space.cells.len(), reach });
        }
        space.least_x = space.columns.first().map_or(0, |column| column.place[0]);
        for (number, column) in space.columns.iter().enumerate() {
            let strip = (column.place[0] - space.least_x) as usize;
            space.strips.resize(strip + 1, number);
        }
        space.strips.push(space.columns.len());
        space
    }

    fn objects(&self, cell: &Cell) -> &[u32] {
        &self.sorted[cell.start as usize..cell.end as usize]
    }

    /// Numbers of the columns whose place is so many cells or fewer from a column's, itself among
    /// them.
    fn around(&self, column: &Column, steps: i32) -> impl Iterator<Item = usize> {
        let [x, y] = column.place;
        let strip = (x - self.least_x) as usize;
        let last = (strip + steps as usize).min(self.strips.len() - 2);
        (strip.saturating_sub(steps as usize)..=last).flat_map(move |strip| {
            let (start, end) = (self.strips[strip], self.strips[strip + 1]);
            let columns = &self.columns[start..end];
            let first = columns.partition_point(|other| other.place[1] < y - steps);
            let near = columns[first..].iter().take_while(move |other| other.place[1] <= y + steps);
            start + first..start + first + near.count()
        })
    }

    /// The cells of a column from so many levels below a level to so many above it.
    fn levels(&self, column: &Column, level: i32, steps: i32) -> impl Iterator<Item = &Cell> {
        let cells = &self.cells[column.start..column.end];
        let below = cells.iter().skip_while(move |cell| cell.level < level - steps);
        below.take_while(move |cell| cell.level <= level + steps)
    }

    /// Visits every pair of cells of different pieces whose pixels may touch, once.
    fn pairs_in_reach(&self, mut visit: impl FnMut(&Cell, &Cell)) {
        let across = |column: &Column| column.reach[0].ceil() as i32;
        for (number, column) in self.columns.iter().enumerate() {
            for near in self.around(column, across(column)) {
                let other = &self.columns[near];
                let apart = (0..2).map(|i| (column.place[i] - other.place[i]).abs());
                let is_met_from_there = near < number && apart.max() <= Some(across(other));
                if is_met_from_there {
                    continue;
                }
                let upright = column.reach[1].max(other.reach[1]).ceil() as i32;
                for cell in &self.cells[column.start..column.end] {
                    for beside in self.levels(other, cell.level, upright) {
                        let is_first = near != number || beside.level > cell.level;
                        if is_first && beside.piece != cell.piece {
                            visit(cell, beside);
                        }
                    }
                }
            }
        }
    }

    /// Visits every chosen cell with all others that so many times its reach leads to.
    fn pairs_of(
        &self,
        is_chosen: impl Fn(&Cell) -> bool,
        times: f64,
        mut visit: impl FnMut(&Cell, &Cell),
    ) {
        for column in &self.columns {
            let [across, upright] = column.reach.map(|cells| (times * cells).ceil() as i32);
            let cells = &self.cells[column.start..column.end];
            let chosen: Vec<&Cell> = cells.iter().filter(|cell| is_chosen(cell)).collect();
            if chosen.is_empty() {
                continue;
            }
            for near in self.around(column, across) {
                for cell in &chosen {
                    for other in self.levels(&self.columns[near], cell.level, upright) {
                        if other.start != cell.start {
                            visit(cell, other);
                        }
                    }
                }
            }
        }
    }
}

/// Bits of a key for each of x, y and level.
const LEVEL_BITS: u32 = 21;
const HALF: i32 = 1 << (LEVEL_BITS - 1);

/// One number for a cell, ordered by x, then y, then level; cells beyond 2^20 share the last one.
fn pack(cell: [i32; 3]) -> u64 {
    let part = |x: i32| (x.clamp(-HALF, HALF - 1) + HALF) as u64;
    part(cell[0]) << (2 * LEVEL_BITS) | part(cell[1]) << LEVEL_BITS | part(cell[2])
}

fn unpack(key: u64) -> [i32; 3] {
    let part = |shift: u32| ((key >> shift) & ((1 << LEVEL_BITS) - 1)) as i32 - HALF;
    [part(2 * LEVEL_BITS), part(LEVEL_BITS), part(0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cluster::params::ClusterParams;

    fn params() -> GapMerge {
        ClusterParams::best().gaps.expect("best joins by gaps")
    }

    /// Pixels at those places, all with one reach, in pieces numbered from 1.
    fn scene(places: &[[f32; 3]], piece: &[u32]) -> (ObjectPixels, Components, Merge) {
        let count = piece.iter().copied().max().unwrap_or(0);
        let reach = [params().across as f32, params().upright as f32];
        let objects = ObjectPixels {
            position: places.to_vec(),
            pixel: (0..places.len() as u32).collect(),
            reach: vec![reach; places.len()],
            ..ObjectPixels::default()
        };
        let components = Components { label: piece.to_vec(), count, ..Components::default() };
        let instance_of_component = (1..=count).collect();
        (objects, components, Merge { instance_of_component, count, steps: Vec::new() })
    }

    fn groups(places: &[[f32; 3]], piece: &[u32], params: &GapMerge) -> (Vec<u32>, Vec<Join>) {
        let (objects, components, merge) = scene(places, piece);
        join_by_gaps(&objects, &components, &merge, params)
    }

    #[test]
    fn what_stands_apart_stays_apart_and_what_lies_above_joins() {
        let alone = GapMerge { leftover: 0, ..params() };
        // Two posts half a metre apart; a third part 0.7 m above the first.
        let places = [[5.0, 0.0, 0.0], [5.0, 0.5, 0.0], [5.0, 0.0, 0.7]];
        let (groups, joins) = groups(&places, &[1, 2, 3], &alone);
        assert_eq!(groups, [1, 2, 1]);
        assert_eq!((joins[0].target, joins[0].query), (1, 3));
        assert_eq!(joins[0].evidence, Evidence::Touching);
        assert!((joins[0].gap - 0.7).abs() < 1e-6, "{joins:?}");
    }

    #[test]
    fn a_leftover_joins_the_nearest_and_larger_pieces_wait_for_no_one() {
        let mut places = Vec::new();
        let mut piece = Vec::new();
        for (number, y) in [(1, 0.0), (2, 1.3)] {
            for pixel in 0..20 {
                places.push([5.0, y, 0.1 * pixel as f32]);
                piece.push(number);
            }
        }
        // A pixel 0.75 m from the first and 0.55 m from the second; another out of reach of all.
        places.extend([[5.0, 0.75, 1.0], [9.0, 0.75, 1.0]]);
        piece.extend([3, 4]);
        let (found, joins) = groups(&places, &piece, &params());
        assert_eq!(found, [1, 2, 2, 3]);
        assert_eq!(joins.len(), 1);
        assert_eq!(joins[0].evidence, Evidence::Leftover { pixels: 1 });
        let alone = GapMerge { leftover: 0, ..params() };
        assert_eq!(groups(&places, &piece, &alone).0, [1, 2, 3, 4]);
    }

    #[test]
    fn pixels_without_a_component_have_no_piece() {
        let places = [[5.0, 0.0, 0.0], [5.0, 0.1, 0.0], [5.0, 0.2, 0.0]];
        assert_eq!(groups(&places, &[1, 0, 2], &params()).0, [1, 1]);
        assert!(groups(&[], &[], &params()).0.is_empty());
    }

    #[test]
    fn keys_keep_the_order_of_cells() {
        for cell in [[0, 0, 0], [-3, 7, -1], [1000, -1000, 5]] {
            assert_eq!(unpack(pack(cell)), cell);
        }
        let keys = [[-1, 5, 5], [0, -9, 9], [0, -8, -9], [0, -8, 0]].map(pack);
        assert!(keys.is_sorted(), "{keys:?}");
    }

    proptest::proptest! {
        /// Against all pairs, with reaches of their own.
        #[test]
        fn cells_find_all_that_touch(
            points in proptest::collection::vec((-12..12_i8, -12..12_i8, -6..6_i8, 0..4_u8), 1..70),
        ) {
            let place = |p: &(i8, i8, i8, u8)| [p.0, p.1, p.2].map(|x| f32::from(x) * 0.21 + 0.05);
            let places: Vec<[f32; 3]> = points.iter().map(place).collect();
            let pieces: Vec<u32> = (1..=points.len() as u32).collect();
            let (mut objects, components, merge) = scene(&places, &pieces);
            for (reach, point) in objects.reach.iter_mut().zip(&points) {
                let wider = 0.2 * f32::from(point.3);
                *reach = [reach[0] + wider, reach[1] + wider / 3.0];
            }
            let mut expected: Vec<usize> = (0..points.len()).collect();
            for a in 0..points.len() {
                for b in 0..a {
                    if objects.separation(a, b) <= 1.0 {
                        let (from, to) = (expected[a], expected[b]);
                        expected.iter_mut().filter(|e| **e == from).for_each(|e| *e = to);
                    }
                }
            }
            let alone = GapMerge { leftover: 0, ..params() };
            let (found, joins) = join_by_gaps(&objects, &components, &merge, &alone);
            for a in 0..points.len() {
                for b in 0..a {
                    assert_eq!(expected[a] == expected[b], found[a] == found[b], "{a} and {b}");
                }
            }
            let count = found.iter().max().copied().unwrap_or(0) as usize;
            assert_eq!(joins.len(), points.len() - count);
        }
    }
}
