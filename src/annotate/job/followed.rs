//! Clouds on their way through the trackers.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use super::pending::CloudResult;
use crate::annotate::report::FrameReport;
use crate::annotate::tracking::{RecordedMotion, Stored, TopicFollower, Untracked};
use crate::error::Result;
use crate::frames::EncodedCloud;
use divmerge_recording::SharedBytes;
use divmerge_recording::workers::{Promise, Ticket};

/// Bytes of the input that wait at most for the tracks of a cloud before them; then the tracks are
/// decided with what is known.
const MOST_WAITING: u64 = 256 << 20;

/// Seconds beyond the lag that clouds of other topics wait for a topic that has ended.
const PATIENCE_S: f64 = 1.0;

/// How long after a cloud it is known where the sensor was, by the log times of messages,
/// nanoseconds. Half a second: transforms of a map come as late.
const RECORDED_WITHIN_NS: u64 = 500_000_000;

/// Clouds on their way through the trackers.
#[derive(Default)]
pub(super) struct Tracking {
    /// By topic, where objects are followed.
    pub(super) followers: BTreeMap<Arc<str>, TopicFollower<FollowedCloud>>,
    /// What is recorded of where the sensor was.
    pub(super) recorded: RecordedMotion,
    /// Clouds that are being clustered or wait for what is recorded about their time, in the
    /// input's order.
    pub(super) clustering: VecDeque<ClusteringCloud>,
    /// Numbers of the clouds that are being clustered or wait for their tracks.
    pub(super) undecided: BTreeSet<u64>,
    next_number: u64,
}

/// A cloud that is being clustered.
pub(super) struct ClusteringCloud {
    pub(super) number: u64,
    pub(super) encoded: EncodedCloud,
    pub(super) bytes: u64,
    pub(super) clustered: Ticket<Result<CloudResult>>,
    pub(super) result: Promise<Result<CloudResult>>,
}

/// A cloud that waits for its tracks.
pub(super) struct FollowedCloud {
    pub(super) number: u64,
    pub(super) encoded: EncodedCloud,
    /// Bytes of the input that were read when it came.
    pub(super) bytes: u64,
    pub(super) written: FollowedResult,
}

/// What becomes of a cloud when its tracks are decided.
pub(super) enum FollowedResult {
    /// Its messages are written.
    Clustered(Promise<Result<CloudResult>>, Box<Untracked>, FrameReport),
    /// The messages that a slice has of it are written with tracks.
    OfSlice(Promise<Result<CloudResult>>, SharedBytes, Box<Stored>, FrameReport),
    /// Nothing: a run before wrote its messages.
    Written,
}

impl Tracking {
    /// No topic is followed yet.
    pub(super) fn new(recorded: RecordedMotion) -> Self {
        Tracking { recorded, ..Tracking::default() }
    }

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

    /// Clouds that wait for their tracks, or for what is recorded about their time.
    pub(super) fn waiting(&mut self) -> usize {
        let mut in_flight = 0;
        for cloud in &mut self.clustering {
            in_flight += usize::from(!cloud.clustered.is_ready());
        }
        self.undecided.len() - in_flight
    }

    /// Whether the next cloud is clustered, and needs nothing that is recorded behind it.
    pub(super) fn is_next_ready(&mut self) -> bool {
        self.recorded.is_empty()
            && self.clustering.front_mut().is_some_and(|first| first.clustered.is_ready())
    }

    /// Whether what is recorded about the time of the next cloud has come, by the log time of the
    /// message that is read.
    pub(super) fn is_next_due(&self, log_time: u64) -> bool {
        let first = self.clustering.front().map(|first| first.encoded.header.log_time);
        let is_past = |first: u64| first.saturating_add(RECORDED_WITHIN_NS) <= log_time;
        !self.recorded.is_empty() && first.is_some_and(is_past)
    }

    /// The first cloud that is being clustered, if so many are.
    pub(super) fn first_of(&mut self, most: usize) -> Option<&mut ClusteringCloud> {
        let mut clustering = self.clustering.iter_mut();
        let mut of_threads = clustering.by_ref().filter_map(|cloud| {
            let is_ready = cloud.clustered.is_ready();
            (!is_ready).then_some(cloud)
        });
        let first = of_threads.next()?;
        (of_threads.count() + 1 >= most).then_some(first)
    }

    /// The topics whose first cloud without tracks was logged so long before `now`, nanoseconds
    /// since 1970, that the next one hardly comes.
    pub(super) fn overdue(&self, now: u64, lag_s: f64) -> Vec<Arc<str>> {
        let longest = ((lag_s + PATIENCE_S) * 1e9) as u64;
        let is_overdue = |follower: &TopicFollower<FollowedCloud>| {
            let first = follower.first().map(|cloud| cloud.encoded.header.log_time);
            first.is_some_and(|first| now.saturating_sub(first) > longest)
        };
        let overdue = self.followers.iter().filter(|(_, follower)| is_overdue(follower));
        overdue.map(|(topic, _)| Arc::clone(topic)).collect()
    }

    /// Whether more of the input than [`MOST_WAITING`] waits for the tracks of a cloud.
    pub(super) fn holds_too_much(&self, bytes: u64) -> bool {
        let first = self.followers.values().filter_map(TopicFollower::first);
        let clustering = self.clustering.front().map(|cloud| cloud.bytes);
        let oldest = first.map(|cloud| cloud.bytes).chain(clustering).min();
        oldest.is_some_and(|oldest| bytes.saturating_sub(oldest) > MOST_WAITING)
    }
}
