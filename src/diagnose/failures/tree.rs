//! The one decision in a tree of merges that spoiled an object.

/// Pixels of a part of an instance.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Part {
    /// Those of the object.
    pub own: u64,
    /// All of them.
    pub all: u64,
}

/// A decision without which there are two sides, one of them more like the object than both
/// together.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TreeCut {
    /// The edge.
    pub edge: usize,
    /// Which parts lie on the side of the object.
    pub is_own_side: Vec<bool>,
}

/// The edge of a tree over parts without which one side has the greatest IoU with an object of
/// `total` pixels; none if no cut increases the IoU. Ties go to the first edge. Time O(parts).
pub(super) fn best_cut(parts: &[Part], edges: &[[usize; 2]], total: u64) -> Option<TreeCut> {
    let tree = Tree::new(parts, edges)?;
    let all = tree.below[tree.order[0]];
    let mut best = (iou(all, total), None);
    for (child, _, edge) in tree.steps() {
        let inside = tree.below[child];
        let outside = Part { own: all.own - inside.own, all: all.all - inside.all };
        for (side, is_below) in [(inside, true), (outside, false)] {
            let iou = iou(side, total);
            let is_first = best.1.is_some_and(|(_, of_best, _)| edge < of_best);
            if iou > best.0 || (iou == best.0 && is_first) {
                best = (iou, Some((child, edge, is_below)));
            }
        }
    }
    let (child, edge, is_below) = best.1?;
    let below = tree.members_below(child);
    Some(TreeCut { edge, is_own_side: below.into_iter().map(|below| below == is_below).collect() })
}

fn iou(side: Part, total: u64) -> f64 {
    side.own as f64 / (total + side.all - side.own).max(1) as f64
}

/// A tree rooted at its first part.
struct Tree {
    /// Parts, each after its parent.
    order: Vec<usize>,
    /// For each part its parent and the edge between them; none for the root.
    parent: Vec<Option<(usize, usize)>>,
    /// For each part the pixels of it and of all parts below it.
    below: Vec<Part>,
}

impl Tree {
    /// None without a part. Parts that no edge reaches are left out.
    fn new(parts: &[Part], edges: &[[usize; 2]]) -> Option<Self> {
        let mut beside: Vec<Vec<(usize, usize)>> = vec![Vec::new(); parts.len()];
        for (edge, &[a, b]) in edges.iter().enumerate() {
            beside[a].push((b, edge));
            beside[b].push((a, edge));
        }
        let root = edges.first().map_or(0, |edge| edge[0]);
        let (mut parent, mut is_seen) = (vec![None; parts.len()], vec![false; parts.len()]);
        *is_seen.get_mut(root)? = true;
        let mut order = vec![root];
        let mut next = 0;
        while let Some(&part) = order.get(next) {
            next += 1;
            for &(other, edge) in &beside[part] {
                if !std::mem::replace(&mut is_seen[other], true) {
                    parent[other] = Some((part, edge));
                    order.push(other);
                }
            }
        }
        let mut below = parts.to_vec();
        for &part in order.iter().rev() {
            if let Some((above, _)) = parent[part] {
                below[above].own += below[part].own;
                below[above].all += below[part].all;
            }
        }
        Some(Tree { order, parent, below })
    }

    /// Each part but the root with its parent and the edge between them.
    fn steps(&self) -> impl Iterator<Item = (usize, usize, usize)> {
        let step = |&part: &usize| self.parent[part].map(|(above, edge)| (part, above, edge));
        self.order.iter().filter_map(step)
    }

    fn members_below(&self, top: usize) -> Vec<bool> {
        let mut is_below = vec![false; self.parent.len()];
        is_below[top] = true;
        for (part, above, _) in self.steps() {
            is_below[part] |= is_below[above];
        }
        is_below
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(pixels: &[(u64, u64)]) -> Vec<Part> {
        pixels.iter().map(|&(own, all)| Part { own, all }).collect()
    }

    /// An object in two parts, 0 and 1, and another in 2 and 3, in a chain 0 - 1 - 2 - 3.
    #[test]
    fn the_edge_between_two_objects_is_cut() {
        let parts = parts(&[(10, 10), (10, 10), (0, 15), (0, 15)]);
        let cut = best_cut(&parts, &[[0, 1], [2, 3], [1, 2]], 20).unwrap();
        assert_eq!((cut.edge, cut.is_own_side), (2, vec![true, true, false, false]));
    }

    #[test]
    fn nothing_is_cut_where_nothing_gets_better() {
        assert_eq!(best_cut(&parts(&[(10, 10), (10, 10)]), &[[0, 1]], 20), None);
        // One part, in which the two objects are mixed.
        assert_eq!(best_cut(&parts(&[(10, 20)]), &[], 10), None);
        assert_eq!(best_cut(&[], &[], 10), None);
    }

    #[test]
    fn the_side_away_from_the_root_may_be_the_object() {
        let parts = parts(&[(0, 30), (0, 30), (8, 8)]);
        let cut = best_cut(&parts, &[[0, 1], [0, 2]], 10).unwrap();
        assert_eq!((cut.edge, cut.is_own_side), (1, vec![false, false, true]));
    }
}
