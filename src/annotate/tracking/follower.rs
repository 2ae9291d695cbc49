//! The clouds of one topic on their way through the tracker.

use std::collections::VecDeque;

use nalgebra::Isometry3;

use super::observation::{CloudObservation, ObservedMotion};
use super::options::TrackOptions;
use divmerge_core::over_time::ego_motion::{EgoMotion, EgoMotionParams, RegistrationScan};
use divmerge_core::over_time::{InstanceTrack, ObservedInstance, Tracker, TrackerFrame};

/// Nanoseconds in a second.
const SECOND: f64 = 1e9;

/// Follows the objects of one topic.
pub(in crate::annotate) struct TopicFollower<T> {
    ego_motion: EgoMotion,
    tracker: Tracker,
    /// Time of the first cloud and of the last, nanoseconds since 1970.
    times_ns: Option<(i64, i64)>,
    /// Clouds whose tracks are not decided, the first first.
    undecided: VecDeque<(T, Vec<ObservedInstance>)>,
}

/// A cloud whose tracks are decided.
pub(in crate::annotate) struct Decided<T> {
    /// What came with it.
    pub(in crate::annotate) item: T,
    pub(in crate::annotate) observed: Vec<ObservedInstance>,
    /// The track of each of its instances.
    pub(in crate::annotate) tracks: Vec<InstanceTrack>,
}

impl<T> TopicFollower<T> {
    pub(in crate::annotate) fn new(options: &TrackOptions) -> Self {
        TopicFollower {
            ego_motion: EgoMotion::new(EgoMotionParams::default()),
            tracker: Tracker::new(options.params),
            times_ns: None,
            undecided: VecDeque::new(),
        }
    }

    /// What came with the first cloud that is not decided.
    pub(in crate::annotate) fn first(&self) -> Option<&T> {
        self.undecided.front().map(|(item, _)| item)
    }

    /// Takes the next cloud; gives those that are decided by it.
    pub(in crate::annotate) fn push(
        &mut self,
        item: T,
        observation: CloudObservation,
    ) -> Vec<Decided<T>> {
        let CloudObservation { time_ns, motion, instances } = observation;
        let (first_ns, last_ns) = self.times_ns.unwrap_or((time_ns, time_ns));
        self.times_ns = Some((first_ns, time_ns));
        let step = time_ns.saturating_sub(last_ns) as f64 / SECOND;
        let mut decided = Vec::new();
        let pose = match motion {
            ObservedMotion::Pose(pose) => pose,
            ObservedMotion::Scan(bytes) => {
                let (pose, began_anew) = self.estimate(&bytes, step);
                if began_anew {
                    decided = self.tracker.finish();
                }
                pose
            }
        };
        let time = time_ns.saturating_sub(first_ns) as f64 / SECOND;
        decided.extend(self.tracker.push(TrackerFrame {
            time,
            pose: &pose,
            instances: &instances,
        }));
        self.undecided.push_back((item, instances));
        self.take(decided)
    }

    /// Decides all clouds with what is known.
    pub(in crate::annotate) fn decide_all(&mut self) -> Vec<Decided<T>> {
        let decided = self.tracker.decide_all();
        self.take(decided)
    }

    /// The pose of a cloud, and whether it has nothing to do with those before.
    fn estimate(&mut self, scan: &[u8], step: f64) -> (Isometry3<f64>, bool) {
        let scan = RegistrationScan::from_bytes(scan).unwrap_or_default();
        let estimate = self.ego_motion.push(&scan, step);
        (estimate.world_from_sensor, estimate.began_anew)
    }

    fn take(&mut self, decided: Vec<Vec<InstanceTrack>>) -> Vec<Decided<T>> {
        let count = decided.len();
        let clouds = self.undecided.drain(..count);
        let of_cloud = clouds.zip(decided);
        of_cloud.map(|((item, observed), tracks)| Decided { item, observed, tracks }).collect()
    }
}
