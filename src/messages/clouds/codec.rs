//! Clouds from and to the bytes of their format.

use std::borrow::Cow;

use super::fields::{CloudPose, Datatype};
use super::format::CloudFormat;
use super::message::CloudMessage;
use super::{foxglove_cdr, json, livox, point_cloud2, protobuf};
use crate::error::frame::{FrameError, Result, Unsupported};
use crate::messages::ros::ByteOrder;
use crate::messages::stamp;

impl CloudFormat {
    /// Reads a message. The data is borrowed from the message, except in JSON.
    ///
    /// # Errors
    /// [`FrameError::Malformed`] if the message ends early or its sizes disagree,
    /// [`FrameError::Unsupported`] if it is CDR other than the plain one.
    pub fn decode(self, message: &[u8]) -> Result<CloudMessage<'_>> {
        let cloud = match self {
            CloudFormat::Ros2 | CloudFormat::Ros1 => point_cloud2::decode(self, message),
            CloudFormat::FoxgloveRos2 => foxglove_cdr::decode(message),
            CloudFormat::FoxgloveProtobuf => protobuf::decode(message),
            CloudFormat::FoxgloveJson => json::decode(message),
            CloudFormat::LivoxRos2 | CloudFormat::LivoxRos1 => livox::decode(self, message),
        }?;
        cloud.check()?;
        Ok(cloud)
    }

    /// Stamp of a message in nanoseconds; reads no more of the message than it needs.
    ///
    /// # Errors
    /// As [`CloudFormat::decode`].
    pub fn stamp_ns(self, message: &[u8]) -> Result<i64> {
        match self {
            CloudFormat::Ros2
            | CloudFormat::Ros1
            | CloudFormat::FoxgloveRos2
            | CloudFormat::LivoxRos2
            | CloudFormat::LivoxRos1 => {
                let (sec, nanosec, _) = self.ros_reader(message)?.header()?;
                Ok(stamp::stamp_ns(sec, nanosec))
            }
            CloudFormat::FoxgloveProtobuf => protobuf::stamp_ns(message),
            CloudFormat::FoxgloveJson => json::stamp_ns(message),
        }
    }
}

impl CloudMessage<'_> {
    /// Writes the message, replacing what is in `out`.
    ///
    /// # Errors
    /// [`FrameError::Malformed`] if the sizes disagree, [`FrameError::Unsupported`] if the format
    /// cannot hold the cloud.
    pub fn encode(&self, out: &mut Vec<u8>) -> Result<()> {
        self.check()?;
        self.encode_with(self.data.len(), out, |out| out.extend_from_slice(&self.data))
    }

    /// Writes the message with data of which `fill` appends `length` bytes, replacing what is in
    /// `out`. What is in `data` does not count.
    ///
    /// # Errors
    /// [`FrameError::Unsupported`] if the format cannot hold the cloud.
    pub(in crate::messages) fn encode_with(
        &self,
        length: usize,
        out: &mut Vec<u8>,
        fill: impl FnOnce(&mut Vec<u8>),
    ) -> Result<()> {
        self.check_format()?;
        out.clear();
        out.reserve_exact(self.head_bound() + json::data_len(self.format, length));
        match self.format {
            CloudFormat::Ros2
            | CloudFormat::Ros1
            | CloudFormat::LivoxRos2
            | CloudFormat::LivoxRos1 => point_cloud2::encode(self, length, out, fill),
            CloudFormat::FoxgloveRos2 => foxglove_cdr::encode(self, length, out, fill),
            CloudFormat::FoxgloveProtobuf => protobuf::encode(self, length, out, fill),
            CloudFormat::FoxgloveJson => json::encode(self, length, out, fill),
        }
        Ok(())
    }

    /// The same cloud as a message of another format. Foxglove's has no rows, no counter and no
    /// values but the first of a field; a field of unknown type stays one of unknown type.
    ///
    /// # Errors
    /// [`FrameError::Unsupported`] if the format cannot hold the cloud.
    pub fn reformatted(&self, format: CloudFormat) -> Result<CloudMessage<'_>> {
        let format = format.written();
        let mut cloud = CloudMessage {
            format,
            byte_order: ByteOrder::Little,
            data: Cow::Borrowed(&self.data),
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

    /// Checks that the format can hold the cloud.
    fn check_format(&self) -> Result<()> {
        let is_moved = || self.pose.is_some_and(|pose| pose != CloudPose::default());
        let problem = match self.format.is_foxglove() {
            true if self.is_bigendian => Unsupported::BigEndian,
            false if is_moved() => Unsupported::Pose,
            _ => return Ok(()),
        };
        Err(FrameError::Unsupported { message: self.format.type_name(), problem })
    }

    /// Bytes of the message besides its data, at most.
    fn head_bound(&self) -> usize {
        let names: usize = self.fields.iter().map(|field| field.name.len()).sum();
        match self.format.written() {
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
