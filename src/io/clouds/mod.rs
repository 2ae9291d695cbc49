//! Clouds in messages of every format that is read and written, a file a format; all become one [`PackedCloud`].
//!
//! | [`CloudFormat`] | type | message encoding |
//! | --- | --- | --- |
//! | `Ros2` | `sensor_msgs/msg/PointCloud2` | `cdr` |
//! | `Ros1` | `sensor_msgs/PointCloud2` | `ros1` |
//! | `FoxgloveRos2` | `foxglove_msgs/msg/PointCloud` | `cdr` |
//! | `FoxgloveProtobuf` | `foxglove.PointCloud` | `protobuf` |
//! | `FoxgloveJson` | `foxglove.PointCloud` | `json` |
//!
//! Which of them a channel carries, or why it cannot be read, is for [`CloudChannel::of`] to say, alone.

mod channel;
mod foxglove_cdr;
mod json;
mod packed;
mod point_cloud2;
mod protobuf;
mod rfc3339;
mod schema;
mod wire_format;

pub use channel::{CloudChannel, Unreadable};
pub use packed::{CloudPose, Datatype, PackedCloud, PointField};

#[cfg(test)]
mod format_tests;
#[cfg(test)]
pub(in crate::io) use packed::tests;

use super::definitions::{self, ros1};
use super::ros::{ByteOrder, Layout};
use crate::error::{Error, Result};

/// Format of a cloud message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum CloudFormat {
    /// `sensor_msgs/msg/PointCloud2` in CDR.
    #[default]
    Ros2,
    /// `sensor_msgs/PointCloud2` as ROS 1 lays it out.
    Ros1,
    /// `foxglove_msgs/msg/PointCloud` in CDR.
    FoxgloveRos2,
    /// `foxglove.PointCloud` in protobuf.
    FoxgloveProtobuf,
    /// `foxglove.PointCloud` in JSON.
    FoxgloveJson,
}

impl CloudFormat {
    /// All of them.
    pub const ALL: [CloudFormat; 5] = [
        CloudFormat::Ros2,
        CloudFormat::Ros1,
        CloudFormat::FoxgloveRos2,
        CloudFormat::FoxgloveProtobuf,
        CloudFormat::FoxgloveJson,
    ];

    /// Name of the message's type.
    pub fn type_name(self) -> &'static str {
        match self {
            CloudFormat::Ros2 => definitions::POINT_CLOUD2.name,
            CloudFormat::Ros1 => ros1::POINT_CLOUD2.name,
            CloudFormat::FoxgloveRos2 => definitions::FOXGLOVE_POINT_CLOUD.name,
            CloudFormat::FoxgloveProtobuf | CloudFormat::FoxgloveJson => "foxglove.PointCloud",
        }
    }

    /// Encoding of the messages, as a channel says it.
    pub fn message_encoding(self) -> &'static str {
        match self {
            CloudFormat::Ros2 | CloudFormat::FoxgloveRos2 => "cdr",
            CloudFormat::Ros1 => "ros1",
            CloudFormat::FoxgloveProtobuf => "protobuf",
            CloudFormat::FoxgloveJson => "json",
        }
    }

    /// Profile of a recording of such messages alone: what its other topics and their metadata keep to.
    pub fn profile(self) -> &'static str {
        match self {
            CloudFormat::Ros2 | CloudFormat::FoxgloveRos2 => "ros2",
            CloudFormat::Ros1 => "ros1",
            CloudFormat::FoxgloveProtobuf | CloudFormat::FoxgloveJson => "",
        }
    }

    /// Whether it is Foxglove's cloud, which has no rows, no byte order and one value a field, and a pose.
    pub fn is_foxglove(self) -> bool {
        !matches!(self, CloudFormat::Ros2 | CloudFormat::Ros1)
    }

    /// Reads a message. Data that lies in the message as it is stays where it is.
    ///
    /// # Errors
    /// [`Error::Malformed`] if the message ends early or its sizes disagree, [`Error::Unsupported`] if it is CDR other
    /// than the plain one.
    pub fn decode(self, message: &[u8]) -> Result<PackedCloud<'_>> {
        let cloud = match self {
            CloudFormat::Ros2 | CloudFormat::Ros1 => point_cloud2::decode(self, message),
            CloudFormat::FoxgloveRos2 => foxglove_cdr::decode(message),
            CloudFormat::FoxgloveProtobuf => protobuf::decode(message),
            CloudFormat::FoxgloveJson => json::decode(message),
        }?;
        cloud.check()?;
        Ok(cloud)
    }

    /// Stamp of a message in nanoseconds, for which no more of it is read than is needed.
    ///
    /// # Errors
    /// As [`CloudFormat::decode`].
    pub fn stamp_ns(self, message: &[u8]) -> Result<i64> {
        match self {
            CloudFormat::Ros2 | CloudFormat::Ros1 | CloudFormat::FoxgloveRos2 => {
                let (sec, nanosec, _) = self.ros_header(message)?;
                Ok(packed::stamp_ns(sec, nanosec))
            }
            CloudFormat::FoxgloveProtobuf => protobuf::stamp_ns(message),
            CloudFormat::FoxgloveJson => json::stamp_ns(message),
        }
    }

    fn malformed(self, problem: String) -> Error {
        Error::Malformed { message: self.type_name(), problem }
    }
}

impl PackedCloud<'_> {
    /// How ROS messages beside this one lie in bytes; none where it is no ROS message.
    pub fn layout(&self) -> Option<Layout> {
        match self.format {
            CloudFormat::Ros2 | CloudFormat::FoxgloveRos2 => Some(Layout::Cdr(self.byte_order)),
            CloudFormat::Ros1 => Some(Layout::Ros1),
            CloudFormat::FoxgloveProtobuf | CloudFormat::FoxgloveJson => None,
        }
    }

    /// Writes the message, replacing what is in `out`.
    ///
    /// # Errors
    /// [`Error::Malformed`] if the sizes disagree, [`Error::Unsupported`] if the format cannot hold the cloud.
    pub fn encode(&self, out: &mut Vec<u8>) -> Result<()> {
        self.check()?;
        self.encode_with(self.data.len(), out, |out| out.extend_from_slice(&self.data))
    }

    /// Writes the message with data of which `fill` appends `length` bytes, replacing what is in `out`. What is in
    /// `data` does not count.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if the format cannot hold the cloud.
    pub(super) fn encode_with(
        &self,
        length: usize,
        out: &mut Vec<u8>,
        fill: impl FnOnce(&mut Vec<u8>),
    ) -> Result<()> {
        self.check_format()?;
        out.clear();
        out.reserve_exact(self.head_bound() + json::data_len(self.format, length));
        match self.format {
            CloudFormat::Ros2 | CloudFormat::Ros1 => point_cloud2::encode(self, length, out, fill),
            CloudFormat::FoxgloveRos2 => foxglove_cdr::encode(self, length, out, fill),
            CloudFormat::FoxgloveProtobuf => protobuf::encode(self, length, out, fill),
            CloudFormat::FoxgloveJson => json::encode(self, length, out, fill),
        }
        Ok(())
    }

    /// The same cloud as a message of another format. Foxglove's has no rows, no counter and no values but the first
    /// of a field; a field of unknown type stays one of unknown type.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if the format cannot hold the cloud.
    pub fn reformatted(&self, format: CloudFormat) -> Result<PackedCloud<'_>> {
        let mut cloud = PackedCloud {
            format,
            byte_order: ByteOrder::Little,
            data: std::borrow::Cow::Borrowed(&self.data),
            fields: self.fields.clone(),
            frame_id: self.frame_id.clone(),
            ..*self
        };
        if format.is_foxglove() != self.format.is_foxglove() {
            for field in &mut cloud.fields {
                field.count = if format.is_foxglove() { 1 } else { field.count };
                if let Datatype::Unknown(code) = &mut field.datatype {
                    *code = 0;
                }
            }
        }
        cloud.check_format()?;
        Ok(cloud)
    }

    /// Checks that the format has words for what the cloud is.
    fn check_format(&self) -> Result<()> {
        let is_moved = || self.pose.is_some_and(|pose| pose != CloudPose::default());
        let problem = match self.format.is_foxglove() {
            true if self.is_bigendian => "numbers in big endian, where it has little endian alone",
            false if is_moved() => "points in another pose than that of their frame",
            _ => return Ok(()),
        };
        let message = self.format.type_name();
        Err(Error::Unsupported { message, problem: format!("it cannot hold {problem}") })
    }

    /// Bytes of the message besides its data, at most.
    fn head_bound(&self) -> usize {
        let names: usize = self.fields.iter().map(|field| field.name.len()).sum();
        match self.format {
            CloudFormat::Ros2 | CloudFormat::Ros1 => {
                64 + self.frame_id.len() + names + 24 * self.fields.len()
            }
            // A name in JSON can take six bytes for one.
            CloudFormat::FoxgloveJson => {
                512 + 6 * (self.frame_id.len() + names) + 64 * self.fields.len()
            }
            _ => 128 + self.frame_id.len() + names + 32 * self.fields.len(),
        }
    }
}
