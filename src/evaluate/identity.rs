//! How often objects change their id over time.
//!
//! In each frame a found instance is matched to the true object with which it has an IoU above 0.5;
//! there is at most one. As in the CLEAR MOT metrics (Bernardin and Stiefelhagen 2008):
//!
//! - a switch: the object is matched to another id than when it was matched last;
//! - a fragmentation: it is matched again after frames in which it was there and was not.
//!
//! Objects count in frames where they have more points than a minimum.

use rustc_hash::FxHashMap;
use serde::Serialize;

use super::overlaps::{FrameOverlaps, TrueObject};

/// Sums over any number of sequences.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Identity {
    min_points: u64,
    changes: IdChanges,
    /// Objects of the current sequence: class and id.
    objects: FxHashMap<TrueObject, Following>,
}

/// How an object was followed so far.
#[derive(Debug, Clone, PartialEq, Default)]
struct Following {
    /// The id that it was matched to last.
    last: Option<u32>,
    /// Whether it was in a frame since and was not matched.
    is_lost: bool,
}

/// How often ids change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct IdChanges {
    /// True objects.
    pub objects: u64,
    /// Of these: that were matched in some frame.
    pub found: u64,
    /// Times that an object got another id.
    pub switches: u64,
    /// Times that an object was found again after it was lost.
    pub fragmentations: u64,
}

impl Identity {
    /// Empty sums; true objects count where they have more points than `min_points`.
    pub fn new(min_points: u64) -> Self {
        Identity { min_points, ..Identity::default() }
    }

    /// Adds the next frame of a sequence.
    pub fn add(&mut self, overlaps: &FrameOverlaps) {
        let matches = overlaps.matches();
        let sizes = overlaps.objects.iter();
        for (&object, _) in sizes.filter(|&(_, &size)| size > self.min_points) {
            let following = self.objects.entry(object).or_default();
            match (matches.get(&object), following.last) {
                (None, _) => following.is_lost = true,
                (Some(&id), last) => {
                    let was_found = u64::from(last.is_some());
                    self.changes.switches += u64::from(last.is_some_and(|last| last != id));
                    self.changes.fragmentations += was_found * u64::from(following.is_lost);
                    *following = Following { last: Some(id), is_lost: false };
                }
            }
        }
    }

    /// Ends a sequence: later ids are those of other objects.
    pub fn end_sequence(&mut self) {
        for following in std::mem::take(&mut self.objects).into_values() {
            self.changes.objects += 1;
            self.changes.found += u64::from(following.last.is_some());
        }
    }

    /// The sums of all sequences that have ended.
    pub fn changes(&self) -> IdChanges {
        self.changes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changes(frames: &[&[u32]]) -> IdChanges {
        let mut identity = Identity::new(1);
        for &found in frames {
            identity.add(&FrameOverlaps::new(found, &vec![Some((1, 7)); found.len()]));
        }
        identity.end_sequence();
        identity.changes()
    }

    #[test]
    fn by_hand() {
        let found = changes(&[&[3; 4], &[3; 4], &[4; 4], &[0; 4], &[4; 4], &[5, 5, 5, 4]]);
        assert_eq!(found, IdChanges { objects: 1, found: 1, switches: 2, fragmentations: 1 });
        // Halves match nothing; one point is not counted.
        let halves = changes(&[&[1, 1, 2, 2], &[9]]);
        assert_eq!(halves, IdChanges { objects: 1, found: 0, switches: 0, fragmentations: 0 });
        // Lost at first is no fragmentation.
        assert_eq!(changes(&[&[0; 4], &[1; 4]]).fragmentations, 0);
    }

    #[test]
    fn sequences_are_apart() {
        let mut identity = Identity::new(0);
        for id in [1, 2] {
            identity.add(&FrameOverlaps::new(&[id, 0], &[Some((1, 7)), None]));
            identity.end_sequence();
        }
        let expected = IdChanges { objects: 2, found: 2, switches: 0, fragmentations: 0 };
        assert_eq!(identity.changes(), expected);
    }
}
