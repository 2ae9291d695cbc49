//! Boxes on the bird's-eye plane by the cells they cover, to find those near a box without trying
//! all.

use rustc_hash::FxHashMap;

use crate::geometry::footprint::PlanePoint;

/// Numbered boxes by layer and cell.
#[derive(Debug, Default)]
pub(super) struct Cells {
    boxes: FxHashMap<(u16, i64, i64), Vec<usize>>,
    /// The last search that found each number.
    found_by: Vec<u32>,
    searches: u32,
}

/// A layer of its own with square cells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layer {
    pub number: u16,
    /// Side of its cells in metres.
    pub side: f64,
}

impl Cells {
    /// Adds a box under a number, which may be there already.
    pub fn insert(&mut self, layer: Layer, number: usize, low: PlanePoint, high: PlanePoint) {
        if number >= self.found_by.len() {
            self.found_by.resize(number + 1, 0);
        }
        for (x, y) in covered(layer, low, high) {
            let numbers = self.boxes.entry((layer.number, x, y)).or_default();
            if !numbers.contains(&number) {
                numbers.push(number);
            }
        }
    }

    /// Numbers of the boxes in the cells of a layer within `reach` metres of a box, in any order.
    pub fn near(
        &mut self,
        layer: Layer,
        low: PlanePoint,
        high: PlanePoint,
        reach: f64,
    ) -> Vec<usize> {
        self.searches += 1;
        let mut found = Vec::new();
        for (x, y) in covered(layer, low.map(|x| x - reach), high.map(|x| x + reach)) {
            for &number in self.boxes.get(&(layer.number, x, y)).into_iter().flatten() {
                if self.found_by[number] != self.searches {
                    self.found_by[number] = self.searches;
                    found.push(number);
                }
            }
        }
        found
    }
}

fn covered(layer: Layer, low: PlanePoint, high: PlanePoint) -> impl Iterator<Item = (i64, i64)> {
    let cell = |x: f64| (x / layer.side).floor() as i64;
    let (columns, rows) = (cell(low[0])..=cell(high[0]), cell(low[1])..=cell(high[1]));
    columns.flat_map(move |column| rows.clone().map(move |row| (column, row)))
}
