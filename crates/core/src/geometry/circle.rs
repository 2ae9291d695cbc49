//! Sectors of a circle that is cut into bins.

use std::ops::Range;

/// The longest run of bins that are not occupied, which may run beyond the last bin; the first of
/// several, empty where there is none. `None` of a circle without an occupied bin.
pub fn longest_gap(occupied: &[bool]) -> Option<Range<usize>> {
    let bins = occupied.len();
    let first = occupied.iter().position(|&is_occupied| is_occupied)?;
    let mut longest = 0..0;
    let mut start = first + 1;
    for bin in first + 1..=first + bins {
        if occupied[bin % bins] {
            if bin - start > longest.len() {
                longest = start..bin;
            }
            start = bin + 1;
        }
    }
    Some(longest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_found_across_the_end() {
        let circle = |drawn: &str| drawn.chars().map(|bin| bin == 'x').collect::<Vec<bool>>();
        assert_eq!(longest_gap(&circle("..xx.x..")), Some(6..10));
        assert_eq!(longest_gap(&circle("x..x.x")), Some(1..3));
        assert_eq!(longest_gap(&circle("xxx")), Some(0..0));
        assert_eq!(longest_gap(&circle("...")), None);
    }
}
