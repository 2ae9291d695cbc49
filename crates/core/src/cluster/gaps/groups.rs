//! Which pieces have become one, and why.

use crate::cluster::divide_and_merge::assigner::Merge;
use crate::cluster::divide_and_merge::divide::Components;
use crate::cluster::objects::ObjectPixels;
use crate::cluster::post_merge::{Evidence, Join};
use crate::geometry::disjoint_sets::DisjointSets;

/// Which pieces have become one.
pub(super) struct Groups {
    /// M: the piece of each object pixel from 0, or [`NO_PIECE`].
    pub piece: Vec<u32>,
    pub sets: DisjointSets,
    /// Pixels of the group under the number of its first piece.
    pub pixels: Vec<usize>,
    pub joins: Vec<Join>,
}

/// The piece of a pixel that has none.
pub(super) const NO_PIECE: u32 = u32::MAX;

impl Groups {
    pub fn new(components: &Components, merge: &Merge) -> Self {
        let piece = components.label.iter().map(|&label| match label {
            0 => NO_PIECE,
            label => merge.instance_of_component[label as usize - 1] - 1,
        });
        let piece: Vec<u32> = piece.collect();
        let mut pixels = vec![0; merge.count as usize];
        for &piece in piece.iter().filter(|&&piece| piece != NO_PIECE) {
            pixels[piece as usize] += 1;
        }
        let sets = DisjointSets::new(merge.count as usize);
        Groups { piece, sets, pixels, joins: Vec::new() }
    }

    /// The group of an object pixel that has a piece.
    pub fn of(&mut self, object: u32) -> usize {
        self.sets.root(self.piece[object as usize] as usize)
    }

    /// The groups of two pixels become one: because they touch, or because one was a leftover of so
    /// many pixels.
    pub fn join_pixels(&mut self, objects: &ObjectPixels, p: u32, q: u32, leftover: Option<usize>) {
        let (a, b) = (self.of(p), self.of(q));
        if a == b {
            return;
        }
        let (a, b) = (a.min(b), a.max(b));
        self.sets.join(a, b);
        self.pixels[a] += self.pixels[b];
        let [p, q] = [p, q].map(|object| objects.position[object as usize].map(f64::from));
        let gap = (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum::<f64>().sqrt();
        let evidence = leftover.map_or(Evidence::Touching, |pixels| Evidence::Leftover { pixels });
        self.joins.push(Join { target: a as u32 + 1, query: b as u32 + 1, gap, evidence });
    }
}
