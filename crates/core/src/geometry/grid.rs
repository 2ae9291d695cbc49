//! A row-major grid.

use std::ops::{Index, IndexMut};

/// Rows x columns values in row-major order: the value at (row, column) is `values[row * columns +
/// column]`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Grid<T> {
    rows: usize,
    columns: usize,
    values: Vec<T>,
}

impl<T: Clone> Grid<T> {
    /// A grid filled with one value.
    pub fn filled(rows: usize, columns: usize, value: T) -> Self {
        Grid { rows, columns, values: vec![value; rows * columns] }
    }
}

impl<T> Grid<T> {
    /// A grid over `values`, given row by row.
    ///
    /// # Panics
    /// If `values.len() != rows * columns`.
    pub fn from_rows(rows: usize, columns: usize, values: Vec<T>) -> Self {
        assert_eq!(
            values.len(),
            rows * columns,
            "{rows} x {columns} grid of {} values",
            values.len()
        );
        Grid { rows, columns, values }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of pixels, rows times columns.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether the grid has no pixel.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// All values, row by row.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// All values, row by row.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// One row, from column 0 on.
    pub fn row(&self, row: usize) -> &[T] {
        &self.values[row * self.columns..(row + 1) * self.columns]
    }

    /// The pixel number of (row, column), as used by [`Grid::values`].
    pub fn pixel(&self, row: usize, column: usize) -> usize {
        row * self.columns + column
    }
}

impl<T> Index<(usize, usize)> for Grid<T> {
    type Output = T;

    fn index(&self, (row, column): (usize, usize)) -> &T {
        &self.values[row * self.columns + column]
    }
}

impl<T> IndexMut<(usize, usize)> for Grid<T> {
    fn index_mut(&mut self, (row, column): (usize, usize)) -> &mut T {
        &mut self.values[row * self.columns + column]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_row_major() {
        let mut grid = Grid::from_rows(2, 3, vec![0, 1, 2, 3, 4, 5]);
        assert_eq!(grid[(1, 0)], 3);
        assert_eq!(grid.row(1), &[3, 4, 5]);
        assert_eq!(grid.pixel(1, 2), 5);
        grid[(0, 2)] = 9;
        assert_eq!(grid.values(), &[0, 1, 9, 3, 4, 5]);
    }
}
