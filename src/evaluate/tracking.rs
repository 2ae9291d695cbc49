//! What is measured of ids that are meant to last, beside LSTQ.

use serde::Serialize;

use super::hota::{Hota, HotaSums};
use super::identity::{IdChanges, Identity};
use super::occlusion::{OcclusionCases, Occlusions};
use super::overlaps::{FrameOverlaps, TrueObject};

/// Sums over any number of sequences.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracking {
    identity: Identity,
    occlusions: Occlusions,
    hota: HotaSums,
}

/// How objects keep their ids.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TrackingScores {
    /// How often ids change.
    pub id_changes: IdChanges,
    /// Whether ids last through occlusions.
    pub occlusions: OcclusionCases,
    /// HOTA on sets of points.
    pub hota: Hota,
}

impl Tracking {
    /// Empty sums; true objects count where they have more points than `min_points`.
    pub fn new(min_points: u64) -> Self {
        Tracking {
            identity: Identity::new(min_points),
            occlusions: Occlusions::default(),
            hota: HotaSums::new(min_points),
        }
    }

    /// Adds the next frame of a sequence, N points: its time in nanoseconds, found ids, 0 for none,
    /// and of points of things the true class and object; `None` for others.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn add(&mut self, time_ns: u64, found: &[u32], truth: &[Option<TrueObject>]) {
        let overlaps = FrameOverlaps::new(found, truth);
        self.identity.add(&overlaps);
        self.occlusions.add(time_ns, &overlaps);
        self.hota.add(&overlaps);
    }

    /// Ends a sequence: later ids are those of other objects.
    pub fn end_sequence(&mut self) {
        self.identity.end_sequence();
        self.occlusions.end_sequence();
        self.hota.end_sequence();
    }

    /// The scores of all sequences that have ended.
    pub fn scores(&self) -> TrackingScores {
        TrackingScores {
            id_changes: self.identity.changes(),
            occlusions: self.occlusions.cases(),
            hota: self.hota.hota(),
        }
    }
}
