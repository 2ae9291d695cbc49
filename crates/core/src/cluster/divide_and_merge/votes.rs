//! Votes on the borders of components: V+ and V- of Alg. 1, sparse.

/// V+ and V- between two components, each counted as Alg. 1 counts it: once per visit of a pixel to
/// its neighbour, so that a pair of border pixels counts twice.
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

/// Votes as they come in: (lower label, twice the higher label and, in the lowest bit, whether in
/// favour). Labels are below 2^31, which is more pixels than any memory holds.
#[derive(Debug, Default)]
pub(in crate::cluster) struct Ballot {
    cast: Vec<(u32, u32)>,
    /// How many of them are votes; behind them are places for more.
    count: usize,
}

impl Ballot {
    /// With places for so many votes.
    pub(in crate::cluster) fn with_places(places: usize) -> Self {
        Ballot { cast: vec![(0, 0); places + 1], count: 0 }
    }

    /// A vote between two components.
    pub(in crate::cluster) fn cast(&mut self, own: u32, other: u32, in_favour: bool) {
        if self.count + 1 >= self.cast.len() {
            self.cast.resize((2 * self.cast.len()).max(64), (0, 0));
        }
        self.cast_if(true, own, other, in_favour);
    }

    /// A vote between two components, if it counts, for which there must be a place. Votes within
    /// one component decide nothing and are not kept. Which those are cannot be foreseen, so each
    /// is written down and some are written over, without a branch.
    #[inline]
    pub(in crate::cluster) fn cast_if(
        &mut self,
        counts: bool,
        own: u32,
        other: u32,
        in_favour: bool,
    ) {
        let (a, b) = (own.min(other), own.max(other));
        self.cast[self.count] = (a, b << 1 | u32::from(in_favour));
        self.count += usize::from(counts & (own != other));
    }

    /// Counts the votes between `components` components, each as `weight` votes: a counting sort by
    /// the lower label, then a sum for each of its neighbours. O(m + v + p log p) in v votes and
    /// the p neighbours of one component.
    pub(in crate::cluster) fn count(self, components: u32, weight: u32) -> Votes {
        let (sorted, start) = self.by_lower_label(components);
        let mut pairs: Vec<Vote> = Vec::new();
        // Where the pair of a label stands, if it is there and belongs to the lower label in turn.
        let mut place = vec![0_u32; components as usize + 1];
        for a in 1..=components {
            let first = pairs.len();
            for &vote in &sorted[start[a as usize] as usize..start[a as usize + 1] as usize] {
                let (b, in_favour) = (vote >> 1, vote & 1);
                let at = place[b as usize] as usize;
                let at = if at >= first && pairs.get(at).is_some_and(|pair| pair.b == b) {
                    at
                } else {
                    place[b as usize] = pairs.len() as u32;
                    pairs.push(Vote { a, b, positive: 0, negative: 0 });
                    pairs.len() - 1
                };
                pairs[at].positive += weight * in_favour;
                pairs[at].negative += weight * (1 - in_favour);
            }
            pairs[first..].sort_unstable_by_key(|pair| pair.b);
        }
        Votes { components, pairs }
    }

    /// The votes of each lower label one after the other; those of label a from start\[a\] to
    /// start\[a + 1\].
    fn by_lower_label(self, components: u32) -> (Vec<u32>, Vec<u32>) {
        let cast = &self.cast[..self.count];
        let mut start = vec![0_u32; components as usize + 2];
        for &(a, _) in cast {
            start[a as usize + 1] += 1;
        }
        for label in 1..start.len() {
            start[label] += start[label - 1];
        }
        let mut sorted = vec![0; cast.len()];
        let mut next = start.clone();
        for &(a, vote) in cast {
            sorted[next[a as usize] as usize] = vote;
            next[a as usize] += 1;
        }
        (sorted, start)
    }
}
