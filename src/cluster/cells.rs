//! Boxes on the bird's-eye plane by the cells they cover, to find those near a box without trying all.

use rustc_hash::FxHashMap;

use crate::footprint::PlanePoint;

/// Numbered boxes by cell.
#[derive(Debug)]
pub(super) struct Cells {
    side: f64,
    boxes: FxHashMap<(i64, i64), Vec<usize>>,
}

impl Cells {
    /// No boxes yet, in square cells of `side` metres.
    pub fn new(side: f64) -> Self {
        Cells { side, boxes: FxHashMap::default() }
    }

    /// Adds a box under a number, which may be there already.
    pub fn insert(&mut self, number: usize, low: PlanePoint, high: PlanePoint) {
        for cell in self.covered(low, high) {
            let numbers = self.boxes.entry(cell).or_default();
            if !numbers.contains(&number) {
                numbers.push(number);
            }
        }
    }

    /// Numbers of the boxes in the cells within `reach` metres of a box, ascending.
    pub fn near(&self, low: PlanePoint, high: PlanePoint, reach: f64) -> Vec<usize> {
        let low = low.map(|x| x - reach);
        let high = high.map(|x| x + reach);
        let cells = self.covered(low, high);
        let mut found: Vec<usize> =
            cells.filter_map(|cell| self.boxes.get(&cell)).flatten().copied().collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    fn covered(
        &self,
        low: PlanePoint,
        high: PlanePoint,
    ) -> impl Iterator<Item = (i64, i64)> + use<> {
        let cell = |x: f64| (x / self.side).floor() as i64;
        let (columns, rows) = (cell(low[0])..=cell(high[0]), cell(low[1])..=cell(high[1]));
        columns.flat_map(move |column| rows.clone().map(move |row| (column, row)))
    }
}
