//! Clouds whose objects are followed: observed in the order of the input, written when their tracks
//! are decided.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use super::pending::CloudResult;
use super::state::Job;
use crate::annotate::checkpoint::{CompletedCloud, StoredMessage};
use crate::annotate::message::Writing;
use crate::annotate::report::FrameReport;
use crate::annotate::tracking::{Decided, Stored, TopicFollower, Untracked, stored_cloud};
use crate::error::{Error, Result, SliceProblem};
use crate::frames::EncodedCloud;
use divmerge_recording::SharedBytes;
use divmerge_recording::workers::{Promise, Ticket};

/// Bytes of the input that wait at most for the tracks of a cloud before them; then the tracks are
/// decided with what is known.
const MOST_WAITING: u64 = 512 << 20;

/// Clouds on their way through the trackers.
#[derive(Default)]
pub(super) struct Tracking {
    /// By topic, where objects are followed.
    followers: BTreeMap<Arc<str>, TopicFollower<FollowedCloud>>,
    /// Clouds that are being clustered, in the input's order.
    clustering: VecDeque<ClusteringCloud>,
    /// Numbers of the clouds that are being clustered or wait for their tracks.
    undecided: BTreeSet<u64>,
    next_number: u64,
}

/// A cloud that is being clustered.
struct ClusteringCloud {
    number: u64,
    encoded: EncodedCloud,
    bytes: u64,
    clustered: Ticket<Result<CloudResult>>,
    result: Promise<Result<CloudResult>>,
}

/// A cloud that waits for its tracks.
pub(in crate::annotate) struct FollowedCloud {
    number: u64,
    encoded: EncodedCloud,
    /// Bytes of the input that were read when it came.
    bytes: u64,
    written: FollowedResult,
}

/// What becomes of a cloud when its tracks are decided.
enum FollowedResult {
    /// Its messages are written.
    Clustered(Promise<Result<CloudResult>>, Box<Untracked>, FrameReport),
    /// The messages that a slice has of it are written with tracks.
    OfSlice(Promise<Result<CloudResult>>, SharedBytes, Box<Stored>, FrameReport),
    /// Nothing: a run before wrote its messages.
    Written,
}

impl Tracking {
    /// Objects are followed on a topic.
    pub(super) fn follow(&mut self, topic: &Arc<str>, follower: TopicFollower<FollowedCloud>) {
        self.followers.insert(Arc::clone(topic), follower);
    }

    pub(super) fn follows(&self, topic: &str) -> bool {
        self.followers.contains_key(topic)
    }

    /// Takes a cloud that is being clustered, so many bytes into the input; its number, and the
    /// ticket for what becomes of it in the end.
    pub(super) fn push(
        &mut self,
        encoded: EncodedCloud,
        bytes: u64,
        clustered: Ticket<Result<CloudResult>>,
    ) -> (u64, Ticket<Result<CloudResult>>) {
        let (result, ticket) = Promise::new();
        let number = self.next_number;
        self.next_number += 1;
        self.undecided.insert(number);
        self.clustering.push_back(ClusteringCloud { number, encoded, bytes, clustered, result });
        (number, ticket)
    }

    /// Whether the tracks of a cloud are not decided.
    pub(super) fn is_undecided(&self, number: u64) -> bool {
        self.undecided.contains(&number)
    }

    /// Clouds that wait for their tracks.
    pub(super) fn waiting(&self) -> usize {
        self.undecided.len() - self.clustering.len()
    }

    /// Clouds that are being clustered.
    pub(super) fn clustering(&self) -> usize {
        self.clustering.len()
    }

    /// Whether more of the input than [`MOST_WAITING`] waits for the tracks of a cloud.
    fn holds_too_much(&self, bytes: u64) -> bool {
        let first = self.followers.values().filter_map(TopicFollower::first);
        let oldest = first.map(|cloud| cloud.bytes).min();
        oldest.is_some_and(|oldest| bytes.saturating_sub(oldest) > MOST_WAITING)
    }
}

impl Job<'_> {
    /// Observes the clouds that have been clustered, and decides tracks that can wait no longer.
    pub(super) fn observe_ready(&mut self, bytes: u64) -> Result<()> {
        while self.tracking.clustering.front_mut().is_some_and(|first| first.clustered.is_ready()) {
            self.observe_next()?;
        }
        if self.tracking.holds_too_much(bytes) {
            self.decide_all()?;
        }
        Ok(())
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
                self.announce(&encoded, &clustered, &untracked.annotated, &report);
                let observation = std::mem::take(&mut untracked.observation);
                (observation, FollowedResult::Clustered(result, untracked, report))
            }
            Ok(CloudResult::Completed(CompletedCloud::Annotated(report, messages, stored))) => {
                let Some(mut stored) = stored else {
                    return Err(self.lacks_observation(&encoded));
                };
                let observation = std::mem::take(&mut stored.observation);
                let written = match self.joins_slices {
                    true => {
                        let [StoredMessage { data, .. }, _] = messages;
                        FollowedResult::OfSlice(result, data, stored, report)
                    }
                    false => {
                        stored.observation.clone_from(&observation);
                        let completed = CompletedCloud::Annotated(report, messages, Some(stored));
                        result.keep(Ok(CloudResult::Completed(completed)));
                        self.tracking.undecided.remove(&number);
                        FollowedResult::Written
                    }
                };
                (observation, written)
            }
            other => {
                self.tracking.undecided.remove(&number);
                result.keep(other);
                return Ok(());
            }
        };
        let topic = Arc::clone(&encoded.topic);
        let Some(follower) = self.tracking.followers.get_mut(&topic) else { return Ok(()) };
        let followed = FollowedCloud { number, encoded, bytes, written };
        for decided in follower.push(followed, observation) {
            self.write_decided(decided);
        }
        Ok(())
    }

    /// Decides the tracks of all clouds with what is known.
    pub(super) fn decide_all(&mut self) -> Result<()> {
        while self.tracking.clustering() > 0 {
            self.observe_next()?;
        }
        let followers = self.tracking.followers.values_mut();
        let decided: Vec<Decided<FollowedCloud>> =
            followers.flat_map(TopicFollower::decide_all).collect();
        for decided in decided {
            self.write_decided(decided);
        }
        Ok(())
    }

    /// Gives a cloud whose tracks are decided to the threads, to be written.
    fn write_decided(&mut self, decided: Decided<FollowedCloud>) {
        let Decided { item, observed, tracks } = decided;
        let FollowedCloud { number, encoded, written, .. } = item;
        self.tracking.undecided.remove(&number);
        let (config, types) = (Arc::clone(&self.config), self.options.types);
        let joined = self.overview.path.clone();
        self.workers.detach(move || {
            let writing = Writing { config: &config, types: &types, tracks: None, keeps: false };
            let found = (observed.as_slice(), tracks.as_slice());
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
                    result.keep(annotated.map(|made| CloudResult::Tracked(report, made, None)));
                }
                FollowedResult::Written => {}
            }
        });
    }

    /// The error that what was kept of a cloud lacks its observation.
    fn lacks_observation(&self, encoded: &EncodedCloud) -> Error {
        let (topic, number) = (encoded.topic.to_string(), encoded.number);
        let problem = SliceProblem::LacksCloud { topic, number };
        Error::Slices { of: self.overview.path.clone(), problem }
    }
}
