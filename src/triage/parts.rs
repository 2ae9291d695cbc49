//! The parts of an instance and the gaps between them.

use super::facts::Facts;
use crate::disjoint_sets::DisjointSets;
use crate::footprint::PlanePoint;

/// A local component of the divide step within one instance.
pub(super) struct Part {
    low: PlanePoint,
    high: PlanePoint,
    objects: Vec<u32>,
}

impl Part {
    /// Distance between the boxes around two parts, metres.
    fn gap(&self, other: &Part) -> f64 {
        let along = |axis: usize| {
            let low = self.low[axis].max(other.low[axis]);
            (low - self.high[axis].min(other.high[axis])).max(0.0)
        };
        along(0).hypot(along(1))
    }
}

/// For each instance its local components; instance k at k - 1.
pub(super) fn components(facts: &Facts) -> Vec<Vec<Part>> {
    let label = &facts.frame.stages.components.label;
    let parts = |objects: &Vec<u32>| {
        let mut objects = objects.clone();
        objects.sort_by_key(|&object| label[object as usize]);
        let same = |a: &u32, b: &u32| label[*a as usize] == label[*b as usize];
        objects.chunk_by(same).map(|objects| part(facts, objects)).collect()
    };
    facts.members.iter().map(|member| parts(&member.objects)).collect()
}

fn part(facts: &Facts, objects: &[u32]) -> Part {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for &object in objects {
        let place = facts.place(object);
        for axis in 0..2 {
            low[axis] = low[axis].min(place[axis]);
            high[axis] = high[axis].max(place[axis]);
        }
    }
    Part { low, high, objects: objects.to_vec() }
}

/// An instance cut in two.
pub(super) struct Cut {
    /// Metres between the two sides.
    pub gap: f64,
    /// What the cut weighs.
    pub weight: f64,
    /// The object pixels of the two sides, the larger first.
    pub sides: [Vec<u32>; 2],
}

/// The cut of some parts that weighs most by its gap in metres and the smaller side's share of the pixels;
/// none of fewer than two parts.
///
/// The parts are linked to a minimum spanning tree (Prim, O(n^2)); every link is a cut.
pub(super) fn widest_cut(parts: &[Part], weight: impl Fn(f64, f64) -> f64) -> Option<Cut> {
    let links = spanning_tree(parts);
    let total: usize = parts.iter().map(|part| part.objects.len()).sum();
    let below = pixels_below(parts, &links);
    let weighed = links.iter().filter(|link| link.gap > 0.0).map(|link| {
        let side = below[link.to].min(total - below[link.to]);
        (weight(link.gap, side as f64 / total as f64), *link)
    });
    let (weight, cut) = weighed.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let mut sets = DisjointSets::new(parts.len());
    for link in links.iter().filter(|link| link.to != cut.to) {
        sets.join(link.from, link.to);
    }
    let mut sides = [Vec::new(), Vec::new()];
    for (number, part) in parts.iter().enumerate() {
        let side = usize::from(sets.root(number) == sets.root(cut.to));
        sides[side].extend(&part.objects);
    }
    sides.sort_by_key(|side| std::cmp::Reverse(side.len()));
    Some(Cut { gap: cut.gap, weight, sides })
}

/// A link of the tree: `to` was linked to `from`, which the tree held before.
#[derive(Debug, Clone, Copy)]
struct Link {
    from: usize,
    to: usize,
    gap: f64,
}

/// The links of the minimum spanning tree in the order in which they were made.
fn spanning_tree(parts: &[Part]) -> Vec<Link> {
    let mut links = Vec::new();
    let mut nearest: Vec<(f64, usize)> = vec![(f64::INFINITY, 0); parts.len()];
    let mut is_in = vec![false; parts.len()];
    let mut last = 0;
    for _ in 1..parts.len() {
        is_in[last] = true;
        for (number, part) in parts.iter().enumerate().filter(|&(number, _)| !is_in[number]) {
            let gap = parts[last].gap(part);
            if gap < nearest[number].0 {
                nearest[number] = (gap, last);
            }
        }
        let outside = (0..parts.len()).filter(|&number| !is_in[number]);
        let Some(to) = outside.min_by(|&a, &b| nearest[a].0.total_cmp(&nearest[b].0)) else {
            break;
        };
        let (gap, from) = nearest[to];
        links.push(Link { from, to, gap });
        last = to;
    }
    links
}

/// For each part the pixels in it and in all that hang on it.
fn pixels_below(parts: &[Part], links: &[Link]) -> Vec<usize> {
    let mut below: Vec<usize> = parts.iter().map(|part| part.objects.len()).collect();
    for link in links.iter().rev() {
        below[link.from] += below[link.to];
    }
    below
}
