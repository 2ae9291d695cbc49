//! Clouds whose objects are followed: observed in the order of the input, written when their tracks
//! are decided.

use std::sync::Arc;

use super::followed::{ClusteringCloud, FollowedCloud, FollowedResult};
use super::pending::CloudResult;
use super::state::Job;
use crate::annotate::checkpoint::{CompletedCloud, StoredMessage};
use crate::annotate::event::{RunEvent, TrackedFrame};
use crate::annotate::report::FrameReport;
use crate::annotate::tracking::{Decided, TopicFollower, stored_cloud};
use crate::annotate::writing::Writing;
use crate::error::{Error, Result, SliceProblem};
use crate::frames::EncodedCloud;
use divmerge_recording::Item;

impl Job<'_> {
    /// Observes the clouds that have been clustered, and decides tracks that can wait no longer.
    pub(super) fn observe_ready(&mut self, bytes: u64) -> Result<()> {
        while self.tracking.is_next_ready() {
            self.observe_next()?;
        }
        if self.tracking.holds_too_much(bytes) {
            self.decide_all()?;
        }
        Ok(())
    }

    /// Takes what a message of the input says of where the sensor is, behind the clouds that this
    /// need not wait for. So tracks depend on the order of the input alone.
    pub(super) fn pass(&mut self, bytes: u64, item: &Item) -> Result<()> {
        let Item::Message { header, data, .. } = item else { return Ok(()) };
        while self.tracking.is_next_due(header.log_time) {
            self.observe_next()?;
            self.settle_ready(bytes)?;
        }
        if self.tracking.recorded.takes(header.channel_id) {
            self.tracking.recorded.take(header.channel_id, data);
            self.tracking.recorded.forget_what_is_past();
        }
        Ok(())
    }

    /// Waits for the first cloud that is being clustered, if so many are; whether it did.
    pub(super) fn waits_for_clouds(&mut self, most: usize) -> bool {
        let Some(first) = self.tracking.first_of(most) else { return false };
        self.batch.run(&self.workers);
        first.clustered.get_ready();
        true
    }

    /// Waits until the next cloud is clustered, and observes it.
    pub(super) fn observe_next(&mut self) -> Result<()> {
        if self.tracking.clustering.front_mut().is_some_and(|first| !first.clustered.is_ready()) {
            self.batch.run(&self.workers);
        }
        let Some(cloud) = self.tracking.clustering.pop_front() else { return Ok(()) };
        let ClusteringCloud { number, encoded, bytes, clustered, result } = cloud;
        let (observation, written) = match clustered.wait() {
            Ok(CloudResult::Untracked(clustered, mut untracked)) => {
                let report = FrameReport::new(&clustered, &untracked.annotated.frame_id);
                let stamp_ns = untracked.annotated.stamp_ns;
                self.watch.take(&encoded.topic, &clustered.cloud, stamp_ns);
                self.announce(&encoded, &clustered, &untracked.annotated, &report)?;
                let observation = std::mem::take(&mut untracked.observation);
                (observation, FollowedResult::Clustered(result, untracked, report))
            }
            Ok(CloudResult::Completed(CompletedCloud::Annotated(report, messages, stored))) => {
                let Some(stored) = stored else {
                    return Err(self.lacks_observation(&encoded));
                };
                let observation = stored.observation.clone();
                let written = match self.joins_slices {
                    true => {
                        let [StoredMessage { data, .. }, _] = messages;
                        FollowedResult::OfSlice(result, data, stored, report)
                    }
                    false => {
                        let completed = CompletedCloud::Annotated(report, messages, Some(stored));
                        result.keep(Ok(CloudResult::Completed(completed)));
                        self.tracking.undecided.remove(&number);
                        FollowedResult::Written
                    }
                };
                (observation, written)
            }
            // An error of this cloud alone.
            other @ (Ok(_) | Err(Error::Frame(_))) => {
                self.tracking.undecided.remove(&number);
                result.keep(other);
                return Ok(());
            }
            Err(error) => return Err(error),
        };
        let (topic, now) = (Arc::clone(&encoded.topic), encoded.header.log_time);
        let Some(follower) = self.tracking.followers.get_mut(&topic) else { return Ok(()) };
        let followed = FollowedCloud { number, encoded, bytes, written };
        let mut decided = follower.push(followed, observation, &self.tracking.recorded);
        for topic in self.tracking.overdue(now, self.options.tracks.params.lag_s) {
            let overdue = self.tracking.followers.get_mut(&topic);
            decided.extend(overdue.into_iter().flat_map(TopicFollower::decide_all));
        }
        decided.into_iter().try_for_each(|decided| self.write_decided(decided))
    }

    /// Decides the tracks of all clouds with what is known.
    pub(super) fn decide_all(&mut self) -> Result<()> {
        while !self.tracking.clustering.is_empty() {
            self.observe_next()?;
        }
        let followers = self.tracking.followers.values_mut();
        let decided: Vec<Decided<FollowedCloud>> =
            followers.flat_map(TopicFollower::decide_all).collect();
        decided.into_iter().try_for_each(|decided| self.write_decided(decided))
    }

    /// Gives a cloud whose tracks are decided to the threads, to be written.
    fn write_decided(&mut self, decided: Decided<FollowedCloud>) -> Result<()> {
        if let Some(tracked) = tracked_frame(&decided) {
            self.tell(RunEvent::Tracked(&tracked))?;
        }
        let Decided { item, observed, frame, .. } = decided;
        let FollowedCloud { number, encoded, written, .. } = item;
        self.tracking.undecided.remove(&number);
        let (config, types) = (Arc::clone(&self.config), self.options.types);
        let joined = self.overview.path.clone();
        self.workers.detach(move || {
            let writing = Writing { config: &config, types: &types, tracks: None, keeps: false };
            let found = (observed.as_slice(), &frame);
            match written {
                FollowedResult::Clustered(result, untracked, report) => {
                    let kept = untracked.kept.clone();
                    let annotated = untracked.write(&encoded, writing, found);
                    result.keep(annotated.map(|made| CloudResult::Tracked(report, made, kept)));
                }
                FollowedResult::OfSlice(result, message, stored, report) => {
                    let untracked = stored_cloud(&encoded, writing, &message, *stored);
                    let annotated = untracked.and_then(|untracked| {
                        let problem = SliceProblem::OtherMessages;
                        let other = Error::Slices { of: joined, problem };
                        untracked.ok_or(other)?.write(&encoded, writing, found)
                    });
                    result.keep(annotated.map(|made| CloudResult::Joined(report, made)));
                }
                FollowedResult::Written => {}
            }
        });
        Ok(())
    }

    /// Reports the tracks of each topic, and where the motion of its sensor came from.
    pub(super) fn report_tracks(&mut self) {
        let mut warnings = Vec::new();
        for (topic, follower) in &self.tracking.followers {
            let motion = follower.motion_report();
            warnings.extend(motion.warnings().map(|problem| format!("{topic}: {problem}")));
            let report = self.report.topics.entry(topic.to_string()).or_default();
            report.ego_motion = motion.clone();
            report.tracks = follower.summaries();
        }
        warnings.into_iter().for_each(|warning| self.warn(warning));
    }

    /// The error that what was kept of a cloud lacks its observation.
    fn lacks_observation(&self, encoded: &EncodedCloud) -> Error {
        let (topic, number) = (encoded.topic.to_string(), encoded.number);
        let problem = SliceProblem::LacksCloud { topic, number };
        Error::Slices { of: self.overview.path.clone(), problem }
    }
}

/// The objects of a cloud that this run clustered.
fn tracked_frame(decided: &Decided<FollowedCloud>) -> Option<TrackedFrame> {
    let FollowedCloud { encoded, written, .. } = &decided.item;
    let FollowedResult::Clustered(_, untracked, _) = written else { return None };
    Some(TrackedFrame {
        topic: encoded.topic.to_string(),
        number: encoded.number,
        stamp_ns: untracked.annotated.stamp_ns,
        log_time_ns: encoded.header.log_time,
        frame_id: untracked.annotated.frame_id.clone(),
        objects: decided.frame.objects.clone(),
        world_from_cloud: decided.world_from_cloud,
        began_anew: decided.began_anew,
    })
}
