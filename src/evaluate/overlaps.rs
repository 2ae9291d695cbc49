//! What found instances and true objects of a frame have in common.

use rustc_hash::FxHashMap;

/// A true object: its class and its id.
pub type TrueObject = (u16, u32);

/// Points of found instances, of true objects and of both, in one frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameOverlaps {
    /// By id.
    pub(super) found: FxHashMap<u32, u64>,
    pub(super) objects: FxHashMap<TrueObject, u64>,
    pub(super) both: FxHashMap<(TrueObject, u32), u64>,
}

impl FrameOverlaps {
    /// Those of a frame of N points: found ids, 0 for none, and of points of things the true class
    /// and object; `None` for others.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn new(found: &[u32], truth: &[Option<TrueObject>]) -> Self {
        assert_eq!(found.len(), truth.len(), "columns of different length");
        let mut overlaps = FrameOverlaps::default();
        for (&id, &object) in found.iter().zip(truth) {
            if id != 0 {
                *overlaps.found.entry(id).or_default() += 1;
            }
            let Some(object) = object else { continue };
            *overlaps.objects.entry(object).or_default() += 1;
            if id != 0 {
                *overlaps.both.entry((object, id)).or_default() += 1;
            }
        }
        overlaps
    }

    /// The found instance with which each true object has an IoU above 0.5, if there is one.
    pub fn matches(&self) -> FxHashMap<TrueObject, u32> {
        let is_match = |&(&(object, id), &shared): &(&(TrueObject, u32), &u64)| {
            2 * shared > self.objects[&object] + self.found[&id] - shared
        };
        self.both.iter().filter(is_match).map(|(&pair, _)| pair).collect()
    }
}
