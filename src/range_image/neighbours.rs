//! Neighbours on the range image: the nearest object pixel in each direction.

use crate::grid::Grid;

/// Marks the absence of a neighbour in a direction.
pub const NO_NEIGHBOUR: u32 = u32::MAX;

/// The directions in the order in which the growth visits them: left, right, up, down.
pub const NEIGHBOURS: usize = 4;

/// How far a neighbour may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reach {
    /// Most columns to the left or right; 1 is the 4-connected neighbourhood.
    pub columns: usize,
    /// Most rows up or down.
    pub rows: usize,
    /// Whether columns 0 and W-1 are neighbours.
    pub wraps: bool,
}

/// For every object pixel its neighbours left, right, up and down, as numbers of object pixels.
///
/// `objects` holds an H x W grid of object pixel numbers, given in row-major order ([`NO_NEIGHBOUR`]
/// where the pixel is empty or masked out), `group` a group per object pixel: only pixels of one group
/// are neighbours. In each direction the nearest object pixel of the same group within reach is the
/// neighbour; all others are stepped over (ALGORITHM section 4). A pixel is never its own neighbour.
pub fn neighbours(objects: &Grid<u32>, group: &[u16], reach: Reach) -> Vec<[u32; NEIGHBOURS]> {
    let mut found = vec![[NO_NEIGHBOUR; NEIGHBOURS]; group.len()];
    let mut in_row = Vec::with_capacity(objects.columns());
    for row in 0..objects.rows() {
        in_row.clear();
        let numbers = objects.row(row).iter().enumerate();
        in_row.extend(numbers.filter(|&(_, &n)| n != NO_NEIGHBOUR).map(|(c, &n)| (c, n)));
        link_row(&in_row, objects.columns(), group, reach, &mut found);
        for &(column, number) in &in_row {
            let below =
                (row + 1..objects.rows()).take(reach.rows).map(|row| objects[(row, column)]);
            let other = below
                .filter(|&other| other != NO_NEIGHBOUR)
                .find(|&other| group[other as usize] == group[number as usize]);
            if let Some(other) = other {
                found[number as usize][3] = other;
                found[other as usize][2] = number;
            }
        }
    }
    found
}

/// Links the object pixels of one row, given as (column, number) from left to right.
fn link_row(
    in_row: &[(usize, u32)],
    columns: usize,
    group: &[u16],
    reach: Reach,
    found: &mut [[u32; NEIGHBOURS]],
) {
    for (place, &(column, number)) in in_row.iter().enumerate() {
        let to_the_right = in_row[place + 1..].iter().map(|&(c, n)| (c - column, n));
        let round_the_seam = in_row[..place].iter().map(|&(c, n)| (c + columns - column, n));
        let other = to_the_right
            .chain(round_the_seam.filter(|_| reach.wraps))
            .take_while(|&(distance, _)| distance <= reach.columns)
            .find(|&(_, other)| group[other as usize] == group[number as usize]);
        if let Some((_, other)) = other {
            found[number as usize][1] = other;
            found[other as usize][0] = number;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers the `#` of a drawing in row-major order.
    fn drawn(lines: &[&str]) -> (Grid<u32>, usize) {
        let mut next = 0;
        let drawing = lines.concat();
        let cells = drawing.chars().map(|cell| {
            if cell != '#' {
                return NO_NEIGHBOUR;
            }
            next += 1;
            next - 1
        });
        let cells: Vec<u32> = cells.collect();
        (Grid::from_rows(lines.len(), lines[0].len(), cells), next as usize)
    }

    fn found(lines: &[&str], columns: usize, rows: usize, wraps: bool) -> Vec<[i64; 4]> {
        let (grid, count) = drawn(lines);
        let reach = Reach { columns, rows, wraps };
        let found = neighbours(&grid, &vec![0; count], reach);
        let signed = |n: u32| if n == NO_NEIGHBOUR { -1 } else { i64::from(n) };
        found.into_iter().map(|four| four.map(signed)).collect()
    }

    #[test]
    fn four_connected_with_wrap() {
        //  0 . 1
        //  2 3 .
        let lines = ["#.#", "##."];
        assert_eq!(
            found(&lines, 1, 1, true),
            [[1, -1, -1, 2], [-1, 0, -1, -1], [-1, 3, 0, -1], [2, -1, -1, -1]]
        );
        assert_eq!(found(&lines, 1, 1, false)[0], [-1, -1, -1, 2]);
    }

    #[test]
    fn gaps_step_over_what_is_empty() {
        assert_eq!(found(&["#..#"], 2, 1, false), [[-1; 4], [-1; 4]]);
        assert_eq!(found(&["#..#"], 3, 1, false), [[-1, 1, -1, -1], [0, -1, -1, -1]]);
        assert_eq!(found(&["#", ".", "#"], 1, 2, true), [[-1, -1, -1, 1], [-1, -1, 0, -1]]);
    }

    #[test]
    fn two_columns_are_neighbours_on_both_sides() {
        assert_eq!(found(&["##"], 1, 1, true), [[1, 1, -1, -1], [0, 0, -1, -1]]);
    }

    #[test]
    fn never_its_own_neighbour() {
        assert_eq!(found(&["#"], 5, 5, true), [[-1; 4]]);
        assert_eq!(found(&["#.."], 9, 9, true), [[-1; 4]]);
    }

    #[test]
    fn other_groups_are_stepped_over() {
        let (grid, _) = drawn(&["###"]);
        let reach = Reach { columns: 2, rows: 1, wraps: false };
        let found = neighbours(&grid, &[1, 2, 1], reach);
        assert_eq!(found[0][1], 2);
        assert_eq!(found[1], [NO_NEIGHBOUR; 4]);
    }
}
