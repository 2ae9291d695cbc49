//! Votes on the borders of components: V+ and V- of Alg. 1, sparse.

/// V+ and V- between two components, each counted as Alg. 1 counts it: once per visit of a pixel to its
/// neighbour, so that a pair of border pixels counts twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Vote {
    /// The lower label.
    pub a: u32,
    /// The higher label.
    pub b: u32,
    /// V+\[a\]\[b\] = V+\[b\]\[a\].
    pub positive: u32,
    /// V-\[a\]\[b\] = V-\[b\]\[a\].
    pub negative: u32,
}

/// All pairs of components with a common border, sorted by (a, b); what is not there is zero.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Votes {
    /// Number of components m.
    pub components: u32,
    /// The pairs: a few per component, never m x m.
    pub pairs: Vec<Vote>,
}

/// Votes as they come in: (lower label, higher label and, in the lowest bit, whether in favour).
#[derive(Debug, Default)]
pub(super) struct Ballot {
    cast: Vec<(u32, u64)>,
}

impl Ballot {
    pub(super) fn in_favour(&mut self, own: u32, other: u32) {
        self.cast(own, other, true);
    }

    pub(super) fn against(&mut self, own: u32, other: u32) {
        self.cast(own, other, false);
    }

    /// Votes within one component decide nothing and are not kept.
    fn cast(&mut self, own: u32, other: u32, in_favour: bool) {
        if own != other {
            let (a, b) = (own.min(other), own.max(other));
            self.cast.push((a, u64::from(b) << 1 | u64::from(in_favour)));
        }
    }

    /// Counts the votes between `components` components: a counting sort by the lower label, then a
    /// short sort of each label's votes. O(m + v log b) in v votes, b of them on one component's border.
    pub(super) fn count(self, components: u32) -> Votes {
        let mut start = vec![0_usize; components as usize + 2];
        for &(a, _) in &self.cast {
            start[a as usize + 1] += 1;
        }
        for label in 1..start.len() {
            start[label] += start[label - 1];
        }
        let mut sorted = vec![0_u64; self.cast.len()];
        let mut next = start.clone();
        for (a, vote) in self.cast {
            sorted[next[a as usize]] = vote;
            next[a as usize] += 1;
        }
        let mut pairs = Vec::new();
        for a in 1..=components {
            let of_a = &mut sorted[start[a as usize]..start[a as usize + 1]];
            of_a.sort_unstable();
            for of_pair in of_a.chunk_by(|x, y| x >> 1 == y >> 1) {
                let positive = of_pair.iter().filter(|&vote| vote & 1 == 1).count() as u32;
                let negative = of_pair.len() as u32 - positive;
                pairs.push(Vote { a, b: (of_pair[0] >> 1) as u32, positive, negative });
            }
        }
        Votes { components, pairs }
    }
}
