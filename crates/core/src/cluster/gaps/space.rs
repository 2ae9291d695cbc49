//! Object pixels by the cell of space they lie in, to find those near a pixel without trying all.

use super::groups::{Groups, NO_PIECE};
use crate::cluster::objects::ObjectPixels;
use crate::cluster::params::GapMerge;

/// Object pixels by the cell of space they lie in. A cell is so small that all pixels in one touch.
#[derive(Default)]
pub(super) struct Space {
    /// Object pixels, cell by cell.
    sorted: Vec<u32>,
    /// By place, then upwards.
    pub cells: Vec<Cell>,
    /// By place.
    columns: Vec<Column>,
    /// Least x of a column.
    least_x: i32,
    /// Columns of x = least_x + i are columns\[strips\[i\]..strips\[i + 1\]\].
    strips: Vec<usize>,
}

/// A cell with pixels in it.
pub(super) struct Cell {
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
    /// The pixels that have a piece.
    pub fn new(objects: &ObjectPixels, groups: &Groups, params: &GapMerge) -> Self {
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

    /// The object pixels of a cell.
    pub fn objects(&self, cell: &Cell) -> &[u32] {
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
    pub fn pairs_in_reach(&self, mut visit: impl FnMut(&Cell, &Cell)) {
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
    pub fn pairs_of(
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
pub(super) fn pack(cell: [i32; 3]) -> u64 {
    let part = |x: i32| (x.clamp(-HALF, HALF - 1) + HALF) as u64;
    part(cell[0]) << (2 * LEVEL_BITS) | part(cell[1]) << LEVEL_BITS | part(cell[2])
}

pub(super) fn unpack(key: u64) -> [i32; 3] {
    let part = |shift: u32| ((key >> shift) & ((1 << LEVEL_BITS) - 1)) as i32 - HALF;
    [part(2 * LEVEL_BITS), part(LEVEL_BITS), part(0)]
}
