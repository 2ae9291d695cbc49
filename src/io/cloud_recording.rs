//! Clouds with the poses of their sensor as a ROS 2 recording.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Isometry3;

use super::definitions::{
    POINT_CLOUD2_NAME, POINT_CLOUD2_SCHEMA, TF_MESSAGE_NAME, TF_MESSAGE_SCHEMA,
};
use super::qos::{Durability, QOS_KEY, qos_profile};
use super::recording::{MessageHeader, RecordingWriter, WriteOptions};
use super::ros::{ByteOrder, Layout, RosWriter};
use crate::error::Result;

/// A recording of one cloud topic being written, with `/tf` where there are poses. It appears under its name
/// when it is finished.
pub struct CloudRecording {
    writer: RecordingWriter,
    clouds: Channel,
    poses: Option<Channel>,
    message: Vec<u8>,
}

/// A channel and the number of messages on it.
struct Channel {
    id: u16,
    messages: u32,
}

/// The pose of one coordinate frame in another at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transform<'a> {
    /// Nanoseconds since 1970.
    pub stamp_ns: u64,
    /// The frame in which the pose is given.
    pub parent: &'a str,
    /// The frame whose pose it is.
    pub child: &'a str,
    /// Takes coordinates of the child to coordinates of the parent, metres.
    pub pose: Isometry3<f64>,
}

impl CloudRecording {
    /// Starts a recording that will be `output`, with clouds on `topic`.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::create`].
    pub fn create(output: &Path, topic: &str, options: &WriteOptions) -> Result<Self> {
        let options = WriteOptions { profile: "ros2".into(), ..options.clone() };
        let mut writer = RecordingWriter::create(output, &options)?;
        let definition = (POINT_CLOUD2_NAME, POINT_CLOUD2_SCHEMA);
        let clouds = add_channel(&mut writer, topic, definition, Durability::Volatile)?;
        Ok(CloudRecording { writer, clouds, poses: None, message: Vec::new() })
    }

    /// Writes an encoded PointCloud2 message, logged and published at a time in nanoseconds since 1970.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::write_message`].
    pub fn write_cloud(&mut self, log_time: u64, message: &[u8]) -> Result<()> {
        write(&mut self.writer, &mut self.clouds, log_time, message)
    }

    /// Writes a pose to `/tf`.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::write_message`].
    pub fn write_pose(&mut self, log_time: u64, transform: &Transform) -> Result<()> {
        let poses = match &mut self.poses {
            Some(poses) => poses,
            none => {
                let definition = (TF_MESSAGE_NAME, TF_MESSAGE_SCHEMA);
                let durability = Durability::Volatile;
                none.insert(add_channel(&mut self.writer, "/tf", definition, durability)?)
            }
        };
        transform_message(transform, &mut self.message);
        write(&mut self.writer, poses, log_time, &self.message)
    }

    /// Writes the only message of `/tf_static`.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::write_message`].
    pub fn write_static_pose(&mut self, log_time: u64, transform: &Transform) -> Result<()> {
        let mut message = Vec::new();
        transform_message(transform, &mut message);
        self.write_once("/tf_static", (TF_MESSAGE_NAME, TF_MESSAGE_SCHEMA), log_time, &message)
    }

    /// Writes the only message of a topic: name and definition of its type, the message itself.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::write_message`].
    pub fn write_once(
        &mut self,
        topic: &str,
        definition: (&str, &str),
        log_time: u64,
        message: &[u8],
    ) -> Result<()> {
        let durability = Durability::TransientLocal;
        let mut channel = add_channel(&mut self.writer, topic, definition, durability)?;
        write(&mut self.writer, &mut channel, log_time, message)
    }

    /// Attaches a text file, as of a time in nanoseconds since 1970.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::attach`].
    pub fn attach_text(&mut self, name: &str, time: u64, text: &[u8]) -> Result<()> {
        self.writer.attach(name, "text/plain", time, text)
    }

    /// Writes a metadata record.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::write_metadata`].
    pub fn write_metadata(&mut self, name: &str, table: &BTreeMap<String, String>) -> Result<()> {
        self.writer.write_metadata(name, table)
    }

    /// Completes the recording and returns its size in bytes.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::finish`].
    pub fn finish(self) -> Result<u64> {
        self.writer.finish()
    }
}

/// Whole seconds since 1970 and the nanoseconds beyond.
pub fn stamp(nanoseconds: u64) -> (i32, u32) {
    const SECOND: u64 = 1_000_000_000;
    ((nanoseconds / SECOND) as i32, (nanoseconds % SECOND) as u32)
}

fn add_channel(
    writer: &mut RecordingWriter,
    topic: &str,
    (name, definition): (&str, &str),
    durability: Durability,
) -> Result<Channel> {
    // Keep the last messages, deliver each.
    let qos = match durability {
        Durability::Volatile => qos_profile(10, durability),
        Durability::TransientLocal => qos_profile(1, durability),
    };
    let metadata = BTreeMap::from([(QOS_KEY.to_owned(), qos)]);
    let schema = writer.add_schema(name, "ros2msg", definition.as_bytes())?;
    let id = writer.add_channel(topic, schema, "cdr", &metadata)?;
    Ok(Channel { id, messages: 0 })
}

fn write(
    writer: &mut RecordingWriter,
    channel: &mut Channel,
    log_time: u64,
    message: &[u8],
) -> Result<()> {
    let header = MessageHeader {
        channel_id: channel.id,
        sequence: channel.messages,
        log_time,
        publish_time: log_time,
    };
    channel.messages = channel.messages.wrapping_add(1);
    writer.write_message(&header, message)
}

/// A TFMessage of one transform, replacing what is in `out`.
fn transform_message(transform: &Transform, out: &mut Vec<u8>) {
    let Isometry3 { rotation, translation } = transform.pose;
    let (sec, nanosec) = stamp(transform.stamp_ns);
    let mut cdr = RosWriter::new(Layout::Cdr(ByteOrder::Little), out);
    cdr.length(1);
    cdr.header((sec, nanosec, transform.parent));
    cdr.string(transform.child);
    for value in translation.vector.iter().chain(rotation.coords.iter()) {
        cdr.f64(*value);
    }
}
