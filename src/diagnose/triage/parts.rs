//! The local components of an instance and the gaps between them.

use super::facts::FrameFacts;
use divmerge_core::geometry::disjoint_sets::DisjointSets;
use divmerge_core::geometry::footprint::PlanePoint;

/// The pixels of a local component (of the divide step) within one instance, and the box around
/// them.
pub(super) struct ComponentBox {
    low: PlanePoint,
    high: PlanePoint,
    objects: Vec<u32>,
}

impl ComponentBox {
    /// Distance between the boxes around two parts, metres.
    fn gap(&self, other: &ComponentBox) -> f64 {
        let along = |axis: usize| {
            let low = self.low[axis].max(other.low[axis]);
            (low - self.high[axis].min(other.high[axis])).max(0.0)
        };
        along(0).hypot(along(1))
    }
}

/// For each instance its local components; instance k at k - 1.
pub(super) fn components(facts: &FrameFacts) -> Vec<Vec<ComponentBox>> {
    let label = &facts.frame.stages.components.label;
    let parts = |objects: &Vec<u32>| {
        let mut objects = objects.clone();
        objects.sort_by_key(|&object| label[object as usize]);
        let same = |a: &u32, b: &u32| label[*a as usize] == label[*b as usize];
        objects.chunk_by(same).map(|objects| component_box(facts, objects)).collect()
    };
    facts.members.iter().map(|member| parts(&member.objects)).collect()
}

fn component_box(facts: &FrameFacts, objects: &[u32]) -> ComponentBox {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for &object in objects {
        let place = facts.place(object);
        for axis in 0..2 {
            low[axis] = low[axis].min(place[axis]);
            high[axis] = high[axis].max(place[axis]);
        }
    }
    ComponentBox { low, high, objects: objects.to_vec() }
}

/// An instance split in two.
pub(super) struct Split {
    /// Metres between the two sides.
    pub gap: f64,
    /// Its weight.
    pub weight: f64,
    /// The object pixels of the two sides, the larger first.
    pub sides: [Vec<u32>; 2],
}

/// The split of some parts that `weight` ranks highest, by its gap in metres and the smaller side's
/// share of the pixels; none of fewer than two parts.
///
/// The parts are linked to a minimum spanning tree (Prim, O(n^2)); removing a link gives a split.
pub(super) fn best_split(
    parts: &[ComponentBox],
    weight: impl Fn(f64, f64) -> f64,
) -> Option<Split> {
    let links = spanning_tree(parts);
    let total: usize = parts.iter().map(|part| part.objects.len()).sum();
    let below = pixels_below(parts, &links);
    let weighed = links.iter().filter(|link| link.gap > 0.0).map(|link| {
        let side = below[link.to].min(total - below[link.to]);
        (weight(link.gap, side as f64 / total as f64), *link)
    });
    let (weight, split) = weighed.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let mut sets = DisjointSets::new(parts.len());
    for link in links.iter().filter(|link| link.to != split.to) {
        sets.join(link.from, link.to);
    }
    let mut sides = [Vec::new(), Vec::new()];
    for (number, part) in parts.iter().enumerate() {
        let side = usize::from(sets.root(number) == sets.root(split.to));
        sides[side].extend(&part.objects);
    }
    sides.sort_by_key(|side| std::cmp::Reverse(side.len()));
    Some(Split { gap: split.gap, weight, sides })
}

/// A link of the tree: `to` was added and linked to `from`.
#[derive(Debug, Clone, Copy)]
struct Link {
    from: usize,
    to: usize,
    gap: f64,
}

/// The links of the minimum spanning tree in the order in which they were made.
fn spanning_tree(parts: &[ComponentBox]) -> Vec<Link> {
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

/// For each part the number of pixels in it and in all parts below it in the tree.
fn pixels_below(parts: &[ComponentBox], links: &[Link]) -> Vec<usize> {
    let mut below: Vec<usize> = parts.iter().map(|part| part.objects.len()).collect();
    for link in links.iter().rev() {
        below[link.from] += below[link.to];
    }
    below
}
