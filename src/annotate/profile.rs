//! What took how long.

use serde::Serialize;

use super::writing::Annotated;
use crate::frames::EncodedCloud;
use divmerge_recording::stopwatch::Steps;
use divmerge_recording::{ReadTimes, WriteTimes};

/// Slowest frames that are kept.
const SLOWEST: usize = 5;

/// What an annotation took, step by step. Threads work at the same time, so the milliseconds of all
/// steps may be more than those of the whole.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Profile {
    /// Threads that unpacked, clustered and compressed.
    pub threads: usize,
    /// Milliseconds from beginning to end.
    pub wall_ms: f64,
    /// Reading and unpacking.
    pub read: ReadTimes,
    /// Clouds to labels; bytes of the messages that hold the clouds.
    pub cluster: Steps,
    /// Labels to messages; bytes of those messages.
    pub encode: Steps,
    /// Waiting for clouds to be clustered.
    pub wait: Steps,
    /// Compressing and writing.
    pub write: WriteTimes,
    /// The most clouds that were being clustered, or waited for their turn, at a time.
    pub most_clouds_in_flight: usize,
    /// The frames that took longest from message to messages, the slowest first.
    pub slowest: Vec<SlowFrame>,
}

/// A frame that took long.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SlowFrame {
    /// Topic of its cloud.
    pub topic: String,
    /// Number of the cloud on its topic, from 0.
    pub number: u64,
    /// When it was logged, nanoseconds since 1970.
    pub log_time_ns: u64,
    /// Milliseconds from message to messages.
    pub ms: f64,
}

impl Profile {
    /// Takes a frame whose message has so many bytes.
    pub(super) fn take(&mut self, cloud: &EncodedCloud, message: usize, annotated: &Annotated) {
        let times = annotated.times;
        let added = annotated.cloud.len() + annotated.objects.len();
        self.cluster.take(times.total_ms() - times.encode_ms, message as u64);
        self.encode.take(times.encode_ms, added as u64);
        let slow = SlowFrame {
            topic: cloud.topic.to_string(),
            number: cloud.number,
            log_time_ns: cloud.header.log_time,
            ms: times.total_ms(),
        };
        let place = self.slowest.partition_point(|other| other.ms >= slow.ms);
        self.slowest.insert(place, slow);
        self.slowest.truncate(SLOWEST);
    }
}
