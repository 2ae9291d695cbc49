//! What figures look like around their panels: a white page.

use super::font::Weight;
use super::style::{Anchor, Colour, TextStyle, opaque, rgb};

/// The page.
pub const PAGE: Colour = [255, 255, 255, 255];
/// Titles.
pub const INK: Colour = [24, 26, 30, 255];
/// All other text on the page.
pub const FAINT_INK: Colour = [98, 103, 112, 255];
/// Text on the page that no longer matters.
pub const PALE_INK: Colour = [176, 180, 188, 255];
/// The share of votes in favour in a table or matrix on the page.
pub const IN_FAVOUR: [u8; 3] = [120, 184, 240];

/// Colours of methods in charts, by their names: Okabe and Ito's that are dark enough on the page,
/// and some more.
const METHODS: [(&str, u32); 12] = [
    ("best", 0x0072b2),
    ("paper", 0xd55e00),
    ("authors", 0x009e73),
    ("alpine", 0xcc79a7),
    ("euclidean", 0x6e6e6e),
    ("dbscan", 0xb08300),
    ("scan-line-run", 0x2d2d2d),
    ("depth-clustering", 0x966edc),
    ("supervoxel", 0x008c96),
    ("one-per-class", 0x961e3c),
    ("boxes", 0x5a6e1e),
    ("true instances", 0x3c3ca0),
];

/// Colours of a chart's lines by their names: a method has its own in all charts, whatever follows
/// its name; other lines have what is left.
pub fn line_colours(names: &[&str]) -> Vec<Colour> {
    let place = |name: &str| {
        let name = name.to_lowercase();
        METHODS.iter().position(|(method, _)| {
            let rest = name.strip_prefix(method);
            rest.is_some_and(|rest| !rest.starts_with(|next: char| next.is_alphanumeric()))
        })
    };
    let known: Vec<Option<usize>> = names.iter().map(|name| place(name)).collect();
    let left: Vec<usize> = (0..METHODS.len()).filter(|at| !known.contains(&Some(*at))).collect();
    let mut others = left.iter().copied().cycle();
    let colour = |known: &Option<usize>| {
        let at = known.or_else(|| others.next()).unwrap_or(0);
        opaque(rgb(METHODS[at].1))
    };
    known.iter().map(colour).collect()
}

/// Size of a heading.
pub const HEADING: f64 = 15.0;
/// Size of a panel's title.
pub const TITLE: f64 = 12.5;
/// Size of all other text.
pub const SMALL: f64 = 11.0;

/// Text on the page.
pub fn text(size: f64, weight: Weight, colour: Colour, anchor: Anchor) -> TextStyle {
    TextStyle { size, weight, colour, anchor, halo: None }
}

/// A heading, from its left end.
pub fn heading() -> TextStyle {
    text(HEADING, Weight::Medium, INK, Anchor::Start)
}

/// The title of a panel, from its left end.
pub fn title() -> TextStyle {
    text(TITLE, Weight::Medium, INK, Anchor::Start)
}

/// Small text of regular weight.
pub fn small(colour: Colour, anchor: Anchor) -> TextStyle {
    text(SMALL, Weight::Regular, colour, anchor)
}

/// Small text that should not be noticed first.
pub fn faint(anchor: Anchor) -> TextStyle {
    small(FAINT_INK, anchor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_method_has_one_colour_in_all_charts() {
        let one = line_colours(&["best", "paper", "DBSCAN 0.5 m, 5"]);
        let other = line_colours(&["ghosts", "dbscan", "paper, by voxel", "bestial"]);
        assert_eq!([one[1], one[2]], [other[2], other[1]]);
        // What is no method has a colour of none in the chart.
        assert!(other[0] != other[3] && !one[1..].contains(&other[0]));
        assert!(!one[1..].contains(&other[3]), "{other:?}");
    }
}
