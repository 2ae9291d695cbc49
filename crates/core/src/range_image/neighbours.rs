//! Neighbours on the range image: the nearest object pixel in each direction.

use std::ops::Range;

use super::pixel_set::PixelSet;

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
/// `objects` holds the object pixels, `pixels` the same as a list, `group` a group per object
/// pixel: only pixels of one group are neighbours. In each direction the nearest object pixel of
/// the same group within reach is the neighbour; all others are stepped over (ALGORITHM section 4).
/// A pixel is never its own neighbour.
pub fn neighbours(
    objects: &PixelSet,
    pixels: &[u32],
    group: &[u16],
    reach: Reach,
) -> Vec<[u32; NEIGHBOURS]> {
    let mut found = vec![[NO_NEIGHBOUR; NEIGHBOURS]; group.len()];
    let columns = objects.columns();
    let rows = rows(pixels, objects.rows(), columns);
    for row in &rows {
        link_row((pixels, group), row.clone(), columns, reach, &mut found);
    }
    // Rows beside each other first, so that the nearest are linked first.
    for apart in 1..=reach.rows.min(rows.len().saturating_sub(1)) {
        let step = (apart * columns) as u32;
        for (upper, lower) in rows.iter().zip(&rows[apart..]) {
            link_rows((pixels, group), upper.clone(), lower.clone(), step, &mut found);
        }
    }
    found
}

/// The numbers of the object pixels in each row of the image.
fn rows(pixels: &[u32], rows: usize, columns: usize) -> Vec<Range<usize>> {
    let mut end = 0;
    let row = |row: usize| {
        let start = end;
        let next = (row + 1) * columns;
        end += pixels[start..].iter().take_while(|&&pixel| (pixel as usize) < next).count();
        start..end
    };
    (0..rows).map(row).collect()
}

/// Links the object pixels of one row, which have the numbers `row`, from left to right.
fn link_row(
    (pixels, group): (&[u32], &[u16]),
    row: Range<usize>,
    columns: usize,
    reach: Reach,
    found: &mut [[u32; NEIGHBOURS]],
) {
    let (first, in_row) = (row.start, &pixels[row]);
    for (place, &pixel) in in_row.iter().enumerate() {
        let own = group[first + place];
        let is_near = |&(_, distance): &(usize, usize)| distance <= reach.columns;
        let to_the_right = (place + 1..).zip(&in_row[place + 1..]);
        let mut near = to_the_right
            .map(|(place, &other)| (place, (other - pixel) as usize))
            .take_while(is_near);
        let right = near.find(|&(place, _)| group[first + place] == own);
        let other = right.or_else(|| {
            let seam = in_row[..place].iter().filter(|_| reach.wraps).enumerate();
            let mut near = seam
                .map(|(place, &other)| (place, other as usize + columns - pixel as usize))
                .take_while(is_near);
            near.find(|&(place, _)| group[first + place] == own)
        });
        if let Some((other, _)) = other {
            found[first + place][1] = (first + other) as u32;
            found[first + other][0] = (first + place) as u32;
        }
    }
}

/// Links the object pixels of two rows that lie in one column and have nothing between them; `step`
/// pixels lie between one and the other.
fn link_rows(
    (pixels, group): (&[u32], &[u16]),
    upper: Range<usize>,
    lower: Range<usize>,
    step: u32,
    found: &mut [[u32; NEIGHBOURS]],
) {
    let mut below = lower.start;
    for number in upper {
        let wanted = pixels[number] + step;
        while below < lower.end && pixels[below] < wanted {
            below += 1;
        }
        if below == lower.end {
            return;
        }
        let is_next = pixels[below] == wanted && group[below] == group[number];
        if is_next && found[number][3] == NO_NEIGHBOUR {
            found[number][3] = below as u32;
            found[below][2] = number as u32;
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
