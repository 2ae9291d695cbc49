//! Where the vehicle that carries a sensor has its own body.

use std::collections::HashSet;

use super::block::Block;

/// A cube of the grid that a body is made of, by its number along x, y and z.
pub type Cell = [i32; 3];

/// The body of the vehicle that carries a sensor: cubes of the clouds' own frame.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct EgoBody {
    cells: HashSet<Cell>,
}

impl EgoBody {
    /// Edge of a cube, metres. Beams two degrees apart meet a surface 5 m away every 0.17 m.
    pub const EDGE: f64 = 0.2;

    /// A body of these cubes.
    pub fn of_cells(cells: HashSet<Cell>) -> Self {
        EgoBody { cells }
    }

    /// The cube of an edge, metres, that a position lies in.
    pub fn cell_of(position: [f64; 3], edge: f64) -> Cell {
        position.map(|along| (along / edge).floor() as i32)
    }

    /// Whether a position in the clouds' own frame, metres, lies in the body.
    pub fn contains(&self, position: [f64; 3]) -> bool {
        self.cells.contains(&EgoBody::cell_of(position, EgoBody::EDGE))
    }

    /// Number of cubes.
    pub fn cell_count(&self) -> usize {
        self.cells.len()
    }

    /// The block around the body; `None` where there is no body.
    pub fn bounds(&self) -> Option<Block> {
        let mut bounds: Option<(Cell, Cell)> = None;
        for &cell in &self.cells {
            let (least, greatest) = bounds.get_or_insert((cell, cell));
            for axis in 0..3 {
                least[axis] = least[axis].min(cell[axis]);
                greatest[axis] = greatest[axis].max(cell[axis]);
            }
        }
        /// Cubes in a metre.
        const PER_METRE: f64 = 1.0 / EgoBody::EDGE;
        bounds.map(|(least, greatest)| Block {
            least: least.map(|number| f64::from(number) / PER_METRE),
            greatest: greatest.map(|number| f64::from(number + 1) / PER_METRE),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_has_its_cells_and_a_block_around_them() {
        let body = EgoBody::of_cells(HashSet::from([[-1, 0, 2], [4, 0, 2]]));
        assert_eq!((body.cell_count(), EgoBody::default().bounds()), (2, None));
        assert!(body.contains([-0.1, 0.1, 0.5]) && !body.contains([0.1, 0.1, 0.5]));
        assert_eq!(body.bounds().unwrap().to_string(), "-0.2..1,0..0.2,0.4..0.6");
    }
}
