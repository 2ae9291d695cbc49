//! What identifies a cloud of a recording.

use crate::messages::clouds::CloudMessage;

/// What identifies a cloud of a recording: boxes and classes are found by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CloudKey<'a> {
    /// Topic of the cloud.
    pub topic: &'a str,
    /// Number of the cloud on its topic in the order of the file, from 0; unreadable clouds count.
    pub number: u64,
    /// Stamp of the cloud's header, nanoseconds since 1970.
    pub stamp_ns: i64,
    /// Coordinate frame of the cloud.
    pub frame_id: &'a str,
}

impl<'a> CloudKey<'a> {
    /// The key of a decoded cloud message.
    pub fn new(topic: &'a str, number: u64, cloud: &'a CloudMessage) -> Self {
        CloudKey { topic, number, stamp_ns: cloud.stamp_ns(), frame_id: &cloud.frame_id }
    }
}
