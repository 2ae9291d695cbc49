//! Clouds with the poses of their sensor as a recording: of ROS 2, or of the format's own kind.

use std::collections::BTreeMap;
use std::path::Path;

use divmerge_recording::{MessageHeader, RecordingWriter, WriteOptions};

use crate::error::Result;
use crate::messages::clouds::CloudFormat;
use crate::messages::definitions::{self, MessageSchema};
use crate::messages::qos::{Durability, connection_metadata, qos_metadata};
pub use crate::messages::stamp::stamp;
use crate::messages::transforms;
pub use crate::messages::transforms::Transform;

/// A recording of one cloud topic being written, with `/tf` where there are poses. It appears under
/// its name when it is finished.
pub struct CloudRecording {
    writer: RecordingWriter,
    format: CloudFormat,
    clouds: Channel,
    poses: Option<Channel>,
    message: Vec<u8>,
}

/// A channel and the number of messages on it.
struct Channel {
    id: u16,
    messages: u32,
}

impl CloudRecording {
    /// Starts a recording that will be `output`, with clouds of a format on `topic`.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::create`].
    pub fn create(
        format: CloudFormat,
        output: &Path,
        topic: &str,
        options: &WriteOptions,
    ) -> Result<Self> {
        let options = WriteOptions { profile: format.profile().into(), ..options.clone() };
        let mut writer = RecordingWriter::create(output, &options)?;
        let clouds = add_channel(&mut writer, topic, &format.schema())?;
        Ok(CloudRecording { writer, format, clouds, poses: None, message: Vec::new() })
    }

    /// Writes an encoded cloud message of the recording's format, logged and published at a time in
    /// nanoseconds since 1970.
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
                let schema = transforms::schema(self.format);
                none.insert(add_channel(&mut self.writer, "/tf", &schema)?)
            }
        };
        transforms::encode(transform, self.format, &mut self.message);
        write(&mut self.writer, poses, log_time, &self.message)
    }

    /// Writes the only message of `/tf_static` in a ROS 2 recording.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::write_message`].
    pub fn write_static_pose(&mut self, log_time: u64, transform: &Transform) -> Result<()> {
        let mut message = Vec::new();
        transforms::encode(transform, CloudFormat::Ros2, &mut message);
        self.write_once("/tf_static", &definitions::TF_MESSAGE, log_time, &message)
    }

    /// Writes the only message of a topic in a ROS 2 recording: its type, the message itself.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::write_message`].
    pub fn write_once(
        &mut self,
        topic: &str,
        schema: &MessageSchema,
        log_time: u64,
        message: &[u8],
    ) -> Result<()> {
        let id = schema.add_to(&mut self.writer)?;
        let metadata = qos_metadata(1, Durability::TransientLocal);
        let id = self.writer.add_channel(topic, id, schema.message_encoding, &metadata)?;
        write(&mut self.writer, &mut Channel { id, messages: 0 }, log_time, message)
    }

    /// Attaches a text file, as of a time in nanoseconds since 1970.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::attach`].
    pub fn attach_text(&mut self, name: &str, time: u64, text: &[u8]) -> Result<()> {
        Ok(self.writer.attach(name, "text/plain", time, text)?)
    }

    /// Writes a metadata record.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::write_metadata`].
    pub fn write_metadata(&mut self, name: &str, table: &BTreeMap<String, String>) -> Result<()> {
        Ok(self.writer.write_metadata(name, table)?)
    }

    /// Completes the recording and returns its size in bytes.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::finish`].
    pub fn finish(self) -> Result<u64> {
        Ok(self.writer.finish()?)
    }
}

impl MessageSchema {
    /// Adds the type to a recording as a schema, and returns its id there.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::add_schema`].
    pub fn add_to(&self, writer: &mut RecordingWriter) -> Result<u16> {
        Ok(writer.add_schema(self.name, self.encoding, &self.data)?)
    }
}

fn add_channel(
    writer: &mut RecordingWriter,
    topic: &str,
    schema: &MessageSchema,
) -> Result<Channel> {
    let metadata = connection_metadata(topic, schema, || qos_metadata(10, Durability::Volatile));
    let id = schema.add_to(writer)?;
    let id = writer.add_channel(topic, id, schema.message_encoding, &metadata)?;
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
    Ok(writer.write_message(&header, message)?)
}
