//! Boxes on the bird's-eye plane by the cells they cover, to find those near a box without trying
//! all.

use rustc_hash::FxHashMap;

use crate::geometry::footprint::PlanePoint;

/// Numbered boxes by layer and cell.
#[derive(Debug, Default)]
pub(super) struct Cells {
    numbers: FxHashMap<(u16, i64, i64), Vec<usize>>,
    /// The box of each number.
    boxes: Vec<Bounds>,
    searches: u32,
}

#[derive(Debug, Clone, Copy, Default)]
struct Bounds {
    low: PlanePoint,
    high: PlanePoint,
    /// The last search that looked at it.
    search: u32,
}

/// A layer of its own with square cells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layer {
    pub number: u16,
    /// Side of its cells in metres.
    pub side: f64,
}

impl Cells {
    /// Adds a box under a number, or a larger one in place of the one that is there.
    pub fn insert(&mut self, layer: Layer, number: usize, low: PlanePoint, high: PlanePoint) {
        if number >= self.boxes.len() {
            self.boxes.resize(number + 1, Bounds::default());
        }
        self.boxes[number] = Bounds { low, high, search: self.searches };
        for (x, y) in covered(layer, low, high) {
            let numbers = self.numbers.entry((layer.number, x, y)).or_default();
            if !numbers.contains(&number) {
                numbers.push(number);
            }
        }
    }

    /// Numbers of the boxes of a layer within `reach` metres of a box, in any order, and their
    /// squared distances.
    pub fn near(
        &mut self,
        layer: Layer,
        low: PlanePoint,
        high: PlanePoint,
        reach: f64,
    ) -> Vec<(usize, f64)> {
        self.searches += 1;
        let mut found = Vec::new();
        for (x, y) in covered(layer, low.map(|x| x - reach), high.map(|x| x + reach)) {
            for &number in self.numbers.get(&(layer.number, x, y)).into_iter().flatten() {
                let other = &mut self.boxes[number];
                if std::mem::replace(&mut other.search, self.searches) == self.searches {
                    continue;
                }
                let apart = |axis: usize| {
                    (low[axis].max(other.low[axis]) - high[axis].min(other.high[axis])).max(0.0)
                };
                let squared = apart(0).powi(2) + apart(1).powi(2);
                if squared <= reach * reach {
                    found.push((number, squared));
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
