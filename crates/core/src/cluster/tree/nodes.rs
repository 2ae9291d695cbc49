//! The tree of merges: single linkage that remembers every gap (the condensed tree of Campello,
//! Moulavi and Sander 2013, with a least size of [`TreeMerge::least_points`]).

use serde::Serialize;

use super::links::{Link, Linker, sort};
use crate::cluster::params::TreeMerge;
use crate::geometry::disjoint_sets::DisjointSets;

/// A group of pixels as it was when it joined another group.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Node {
    /// Its pixels are `pixels[start..start + len]` of the [`Tree`].
    #[serde(skip)]
    pub start: u32,
    /// Number of its pixels.
    #[serde(rename = "pixels")]
    pub len: u32,
    /// Gap across which it became one group, metres; of a leaf the gap with which it became large
    /// enough, or [`TreeMerge::nearest`].
    pub birth: f32,
    /// Gap to the group that it joined, metres; [`TreeMerge::farthest`] if it joined none.
    pub death: f32,
    /// The node that it is part of.
    pub parent: Option<u32>,
    /// The two nodes that became it.
    pub children: Option<[u32; 2]>,
}

/// Nodes by number, children before their parents.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tree {
    /// The nodes.
    pub nodes: Vec<Node>,
    /// M: object pixels, those of each node behind one another.
    pub pixels: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Tree {
    /// The tree of M object pixels, given what finds their links. Groups of fewer than
    /// [`TreeMerge::least_points`] pixels are no nodes: what they join absorbs them.
    ///
    /// Reach by reach, so that only links between the groups of the last reach are looked for;
    /// those of a reach join from the shortest to the longest, to a few millimetres ([`sort`]).
    pub(super) fn grow(count: usize, linker: &mut impl Linker, params: &TreeMerge) -> Grown {
        let nearest = params.nearest as f32;
        let mut growth = Growth::new(count, params);
        linker.nearest(nearest, |link| {
            if let Some((a, b)) = growth.apart(&link) {
                growth.join(a, b);
            }
        });
        growth.open_leaves(nearest);
        let fine = growth.groups();
        let (mut links, mut in_order) = (Vec::new(), Vec::new());
        let mut gap = nearest;
        let farthest = params.farthest as f32;
        let between = |&reach: &f32| nearest < reach && reach < farthest;
        let reaches = linker.reaches().iter().copied().filter(between).chain([farthest]);
        for reach in reaches {
            let first = links.len();
            linker.between(&growth.groups(), reach, |link| links.push(link));
            sort(&links[first..], reach, &mut in_order);
            for link in &in_order {
                if let Some((a, b)) = growth.apart(link) {
                    // Gaps grow, though an uneven image may hide a short link until the window is
                    // wide, and the order of the links is not exact.
                    gap = link.distance.max(gap);
                    growth.merge(a, b, gap);
                }
            }
        }
        Grown { tree: growth.finish(), fine, links }
    }

    /// The object pixels of a node.
    pub fn pixels_of(&self, node: &Node) -> &[u32] {
        &self.pixels[node.start as usize..(node.start + node.len) as usize]
    }

    /// Those of them that are in none of its children: all those of a leaf, else what it absorbed.
    pub fn own_pixels_of(&self, node: &Node) -> &[u32] {
        let inherited = node.children.iter().flatten();
        let skip: u32 = inherited.map(|&child| self.nodes[child as usize].len).sum();
        &self.pixels_of(node)[skip as usize..]
    }

    /// M: the smallest node that holds each object pixel.
    pub fn node_of_pixel(&self) -> Vec<Option<u32>> {
        let mut node_of_pixel = vec![None; self.pixels.len()];
        for (number, node) in (0..).zip(&self.nodes) {
            for &object in self.own_pixels_of(node) {
                node_of_pixel[object as usize] = Some(number);
            }
        }
        node_of_pixel
    }

    /// A node and those that it is part of, up to the root.
    pub fn path(&self, node: u32) -> impl Iterator<Item = u32> {
        std::iter::successors(Some(node), |&node| self.nodes[node as usize].parent)
    }
}

/// A tree and what was found on the way.
pub(super) struct Grown {
    /// The tree.
    pub tree: Tree,
    /// M: the first of the pixels that [`TreeMerge::nearest`] joined with each.
    pub fine: Vec<u32>,
    /// Links between those.
    pub links: Vec<Link>,
}

/// Sets of pixels while they grow, each a list that the other's is put behind.
struct Growth {
    least: u32,
    farthest: f32,
    sets: DisjointSets,
    first: Vec<u32>,
    last: Vec<u32>,
    next: Vec<u32>,
    size: Vec<u32>,
    node: Vec<u32>,
    nodes: Vec<Node>,
    /// The first pixel of each node.
    head: Vec<u32>,
}

impl Growth {
    fn new(count: usize, params: &TreeMerge) -> Self {
        Growth {
            least: params.least_points as u32,
            farthest: params.farthest as f32,
            sets: DisjointSets::new(count),
            first: (0..count as u32).collect(),
            last: (0..count as u32).collect(),
            next: vec![NONE; count],
            size: vec![1; count],
            node: vec![NONE; count],
            nodes: Vec::new(),
            head: Vec::new(),
        }
    }

    /// The sets that a link joins, if they are two, the larger first: what is absorbed follows what
    /// absorbs it.
    fn apart(&mut self, link: &Link) -> Option<(usize, usize)> {
        let [a, b] = self.sets.apart(link.a as usize, link.b as usize)?;
        Some(if self.size[a] >= self.size[b] { (a, b) } else { (b, a) })
    }

    /// M: the first pixel of the set that each is in.
    fn groups(&mut self) -> Vec<u32> {
        (0..self.size.len()).map(|pixel| self.sets.root(pixel) as u32).collect()
    }

    /// Makes one set of two, the pixels of the second behind those of the first.
    fn join(&mut self, a: usize, b: usize) -> usize {
        self.sets.join(a, b);
        self.next[self.last[a] as usize] = self.first[b];
        let (first, last, size) = (self.first[a], self.last[b], self.size[a] + self.size[b]);
        let root = a.min(b);
        (self.first[root], self.last[root], self.size[root]) = (first, last, size);
        root
    }

    fn open(&mut self, set: usize, birth: f32, children: Option<[u32; 2]>) -> u32 {
        let death = self.farthest;
        self.nodes.push(Node { start: 0, len: 0, birth, death, parent: None, children });
        self.head.push(self.first[set]);
        self.nodes.len() as u32 - 1
    }

    /// Every set that is large enough becomes a leaf.
    fn open_leaves(&mut self, birth: f32) {
        for set in 0..self.size.len() {
            if self.sets.is_root(set) && self.size[set] >= self.least {
                self.node[set] = self.open(set, birth, None);
            }
        }
    }

    /// Two sets meet across a gap, the larger of them first.
    fn merge(&mut self, a: usize, b: usize, gap: f32) {
        let [one, other] = [self.node[a], self.node[b]];
        let [size, smaller] = [self.size[a], self.size[b]];
        let node = if smaller >= self.least {
            let parent = self.open(a, gap, Some([one, other]));
            for (child, len) in [(one, size), (other, smaller)] {
                let child = &mut self.nodes[child as usize];
                (child.len, child.death, child.parent) = (len, gap, Some(parent));
            }
            parent
        } else if one == NONE && size + smaller >= self.least {
            self.open(a, gap, None)
        } else {
            one
        };
        let root = self.join(a, b);
        self.node[root] = node;
    }

    fn finish(mut self) -> Tree {
        let mut pixels = Vec::with_capacity(self.next.len());
        let mut place = vec![0; self.next.len()];
        for set in 0..self.next.len() {
            if !self.sets.is_root(set) {
                continue;
            }
            if self.node[set] != NONE {
                self.nodes[self.node[set] as usize].len = self.size[set];
            }
            let mut at = self.first[set];
            while at != NONE {
                place[at as usize] = pixels.len() as u32;
                pixels.push(at);
                at = self.next[at as usize];
            }
        }
        for (node, &head) in self.nodes.iter_mut().zip(&self.head) {
            node.start = place[head as usize];
        }
        Tree { nodes: self.nodes, pixels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cluster::ClusterParams;

    /// All pairs of places on a line.
    struct Line(Vec<f32>);

    impl Linker for Line {
        fn reaches(&self) -> &'static [f32] {
            &[0.5, 0.9]
        }

        fn nearest(&mut self, reach: f32, visit: impl FnMut(Link)) {
            let each: Vec<u32> = (0..self.0.len() as u32).collect();
            self.between(&each, reach, visit);
        }

        fn between(&mut self, group: &[u32], reach: f32, mut visit: impl FnMut(Link)) {
            for a in 0..self.0.len() {
                for b in 0..a {
                    let distance = (self.0[a] - self.0[b]).abs();
                    if group[a] != group[b] && distance <= reach {
                        visit(Link { distance, a: a as u32, b: b as u32 });
                    }
                }
            }
        }
    }

    proptest::proptest! {
        /// Groups become one across the gaps between neighbours on the line, whatever the reaches.
        #[test]
        fn gaps_on_a_line(gaps in proptest::collection::vec(1..180_u8, 1..12)) {
            let params = ClusterParams::best().tree.expect("best cuts a tree");
            let mut places = Vec::new();
            let mut at = 0.0;
            let gaps: Vec<f32> = gaps.into_iter().map(|gap| 0.1 + 0.01 * f32::from(gap)).collect();
            for gap in std::iter::once(&0.0).chain(&gaps) {
                at += gap;
                places.extend([at; 6]);
            }
            let count = places.len();
            let grown = Tree::grow(count, &mut Line(places), &params);
            let joined = grown.tree.nodes.iter().filter(|node| node.children.is_some());
            let mut births: Vec<f32> = joined.map(|node| node.birth).collect();
            let mut near: Vec<f32> = gaps.into_iter().filter(|&gap| gap < 1.999).collect();
            births.sort_by(f32::total_cmp);
            near.sort_by(f32::total_cmp);
            proptest::prop_assert_eq!(births.len(), near.len());
            for (birth, gap) in births.iter().zip(near) {
                proptest::prop_assert!((birth - gap).abs() < 5e-3, "{} for {}", birth, gap);
            }
            for node in &grown.tree.nodes {
                proptest::prop_assert!(node.birth <= node.death);
            }
        }
    }
}
