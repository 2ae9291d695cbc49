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

/// Votes as they come in.
#[derive(Debug, Default)]
pub(super) struct Ballot {
    cast: Vec<(u32, u32, bool)>,
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
            self.cast.push((own.min(other), own.max(other), in_favour));
        }
    }

    /// Counts the votes between `components` components. O(v log v) in the votes.
    pub(super) fn count(mut self, components: u32) -> Votes {
        self.cast.sort_unstable();
        let mut pairs: Vec<Vote> = Vec::new();
        for (a, b, in_favour) in self.cast {
            if pairs.last().is_none_or(|last| (last.a, last.b) != (a, b)) {
                pairs.push(Vote { a, b, positive: 0, negative: 0 });
            }
            if let Some(vote) = pairs.last_mut() {
                vote.positive += u32::from(in_favour);
                vote.negative += u32::from(!in_favour);
            }
        }
        Votes { components, pairs }
    }
}
