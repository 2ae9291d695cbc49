//! The clouds of one topic on their way through the tracker.

use std::collections::VecDeque;

use nalgebra::Isometry3;

use super::observation::CloudObservation;
use super::options::TrackOptions;
use super::recorded_motion::RecordedMotion;
use super::sensor_motion::{MotionReport, SensorMotion, SensorPose};
use super::summary::{Summaries, TrackSummary};
use divmerge_core::over_time::{DecidedFrame, ObservedInstance, Tracker, TrackerFrame};

/// Nanoseconds in a second.
const SECOND: f64 = 1e9;

/// Follows the objects of one topic.
pub(in crate::annotate) struct TopicFollower<T> {
    motion: SensorMotion,
    tracker: Tracker,
    /// Time of the first cloud and of the last, nanoseconds since 1970.
    times_ns: Option<(i64, i64)>,
    /// Clouds whose tracks are not decided, the first first.
    undecided: VecDeque<UndecidedCloud<T>>,
    summaries: Summaries,
}

struct UndecidedCloud<T> {
    item: T,
    time_ns: i64,
    observed: Vec<ObservedInstance>,
    pose: SensorPose,
}

/// A cloud whose tracks are decided.
pub(in crate::annotate) struct Decided<T> {
    /// What came with it.
    pub(in crate::annotate) item: T,
    pub(in crate::annotate) observed: Vec<ObservedInstance>,
    pub(in crate::annotate) frame: DecidedFrame,
    /// From its frame as it was clustered to one that stands still, metres.
    pub(in crate::annotate) world_from_cloud: Isometry3<f64>,
    /// Whether that has nothing to do with the ones before.
    pub(in crate::annotate) began_anew: bool,
}

impl<T> TopicFollower<T> {
    pub(in crate::annotate) fn new(options: &TrackOptions) -> Self {
        TopicFollower {
            motion: SensorMotion::new(&options.ego_motion, &options.estimation),
            tracker: Tracker::new(options.params),
            times_ns: None,
            undecided: VecDeque::new(),
            summaries: Summaries::default(),
        }
    }

    /// What came with the first cloud that is not decided.
    pub(in crate::annotate) fn first(&self) -> Option<&T> {
        self.undecided.front().map(|cloud| &cloud.item)
    }

    /// Where the motion of the sensor came from so far.
    pub(in crate::annotate) fn motion_report(&self) -> &MotionReport {
        self.motion.report()
    }

    /// The tracks of the clouds that are decided.
    pub(in crate::annotate) fn summaries(&self) -> Vec<TrackSummary> {
        self.summaries.each()
    }

    /// Takes the next cloud, and what is recorded of where the sensor was; gives those that are
    /// decided by it.
    pub(in crate::annotate) fn push(
        &mut self,
        item: T,
        observation: CloudObservation,
        recorded: &RecordedMotion,
    ) -> Vec<Decided<T>> {
        let time_ns = observation.time_ns;
        let (first_ns, last_ns) = self.times_ns.unwrap_or((time_ns, time_ns));
        self.times_ns = Some((first_ns, time_ns));
        let step = time_ns.saturating_sub(last_ns) as f64 / SECOND;
        let recorded = recorded.poses(&observation.frame_id, time_ns);
        let pose = self.motion.push(&observation, &recorded, step);
        let mut decided = if pose.began_anew { self.tracker.finish() } else { Vec::new() };
        let time = time_ns.saturating_sub(first_ns) as f64 / SECOND;
        let instances = observation.instances;
        decided.extend(self.tracker.push(TrackerFrame {
            time,
            pose: &pose.world_from_cloud,
            instances: &instances,
        }));
        self.undecided.push_back(UndecidedCloud { item, time_ns, observed: instances, pose });
        self.take(decided)
    }

    /// Decides all clouds with what is known.
    pub(in crate::annotate) fn decide_all(&mut self) -> Vec<Decided<T>> {
        let decided = self.tracker.decide_all();
        self.take(decided)
    }

    fn take(&mut self, decided: Vec<DecidedFrame>) -> Vec<Decided<T>> {
        let count = decided.len();
        let clouds = self.undecided.drain(..count).zip(decided);
        let mut taken = Vec::with_capacity(count);
        for (UndecidedCloud { item, time_ns, observed, pose }, frame) in clouds {
            self.summaries.take(time_ns, &observed, &frame);
            let SensorPose { world_from_cloud, began_anew } = pose;
            taken.push(Decided { item, observed, frame, world_from_cloud, began_anew });
        }
        taken
    }
}
