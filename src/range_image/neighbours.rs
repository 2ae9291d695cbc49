//! Neighbours on the range image: the nearest object pixel in each direction.

use super::PixelSet;

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
/// `objects` holds the object pixels, `pixels` the same as a list, `group` a group per object pixel: only
/// pixels of one group are neighbours. In each direction the nearest object pixel of the same group within
/// reach is the neighbour; all others are stepped over (ALGORITHM section 4). A pixel is never its own
/// neighbour.
pub fn neighbours(
    objects: &PixelSet,
    pixels: &[u32],
    group: &[u16],
    reach: Reach,
) -> Vec<[u32; NEIGHBOURS]> {
    let mut found = vec![[NO_NEIGHBOUR; NEIGHBOURS]; group.len()];
    let (columns, size) = (objects.columns(), objects.rows() * objects.columns());
    let row = |pixel: u32| pixel as usize / columns;
    let mut in_row = Vec::with_capacity(columns);
    let mut number = 0;
    for pixels in pixels.chunk_by(|&a, &b| row(a) == row(b)) {
        let first = row(pixels[0]) * columns;
        in_row.clear();
        in_row.extend(pixels.iter().map(|&pixel| pixel as usize - first).zip(number..));
        number += pixels.len() as u32;
        link_row(&in_row, columns, group, reach, &mut found);
        for &(column, number) in &in_row {
            let below = (first + column..size).step_by(columns).skip(1).take(reach.rows);
            let other = below
                .filter_map(|pixel| objects.number(pixel))
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

    /// The `#` of a drawing.
    fn drawn(lines: &[&str]) -> PixelSet {
        let drawing = lines.concat();
        let pixels = (0..).zip(drawing.chars()).filter(|&(_, cell)| cell == '#');
        PixelSet::new(lines.len(), lines[0].len(), pixels.map(|(pixel, _)| pixel))
    }

    fn found(lines: &[&str], columns: usize, rows: usize, wraps: bool) -> Vec<[i64; 4]> {
        let objects = drawn(lines);
        let pixels = objects.pixels();
        let reach = Reach { columns, rows, wraps };
        let found = neighbours(&objects, &pixels, &vec![0; pixels.len()], reach);
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
        let objects = drawn(&["###"]);
        let reach = Reach { columns: 2, rows: 1, wraps: false };
        let found = neighbours(&objects, &objects.pixels(), &[1, 2, 1], reach);
        assert_eq!(found[0][1], 2);
        assert_eq!(found[1], [NO_NEIGHBOUR; 4]);
    }
}
