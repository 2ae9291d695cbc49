//! The formats of clouds: names, encodings, definitions.

use foxglove::messages::PointCloud;

use crate::error::FrameError;
use crate::messages::definitions::{self, MessageSchema, ros1};

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
    /// `CustomMsg` of Livox's drivers in CDR, which is read alone.
    LivoxRos2,
    /// `CustomMsg` of Livox's drivers as ROS 1 lays it out, which is read alone.
    LivoxRos1,
}

impl CloudFormat {
    /// All formats that are written.
    pub const ALL: [CloudFormat; 5] = [
        CloudFormat::Ros2,
        CloudFormat::Ros1,
        CloudFormat::FoxgloveRos2,
        CloudFormat::FoxgloveProtobuf,
        CloudFormat::FoxgloveJson,
    ];

    /// The format in which such clouds are written: PointCloud2 for those of Livox.
    pub fn written(self) -> Self {
        match self {
            CloudFormat::LivoxRos2 => CloudFormat::Ros2,
            CloudFormat::LivoxRos1 => CloudFormat::Ros1,
            written => written,
        }
    }

    /// Name of the message's type.
    pub fn type_name(self) -> &'static str {
        match self {
            CloudFormat::Ros2 => definitions::POINT_CLOUD2.name,
            CloudFormat::Ros1 => ros1::POINT_CLOUD2.name,
            CloudFormat::FoxgloveRos2 => definitions::FOXGLOVE_POINT_CLOUD.name,
            CloudFormat::FoxgloveProtobuf | CloudFormat::FoxgloveJson => "foxglove.PointCloud",
            CloudFormat::LivoxRos2 => "livox_ros_driver2/msg/CustomMsg",
            CloudFormat::LivoxRos1 => "livox_ros_driver2/CustomMsg",
        }
    }

    /// Encoding of the messages, as channels name it.
    pub fn message_encoding(self) -> &'static str {
        match self {
            CloudFormat::Ros2 | CloudFormat::FoxgloveRos2 | CloudFormat::LivoxRos2 => "cdr",
            CloudFormat::Ros1 | CloudFormat::LivoxRos1 => "ros1",
            CloudFormat::FoxgloveProtobuf => "protobuf",
            CloudFormat::FoxgloveJson => "json",
        }
    }

    /// Profile of a recording of such messages alone: what its other topics and their metadata keep
    /// to.
    pub fn profile(self) -> &'static str {
        match self {
            CloudFormat::Ros2 | CloudFormat::FoxgloveRos2 | CloudFormat::LivoxRos2 => "ros2",
            CloudFormat::Ros1 | CloudFormat::LivoxRos1 => "ros1",
            CloudFormat::FoxgloveProtobuf | CloudFormat::FoxgloveJson => "",
        }
    }

    /// Whether it is Foxglove's cloud: with a pose, without rows or byte order, one value per
    /// field.
    pub fn is_foxglove(self) -> bool {
        !matches!(self.written(), CloudFormat::Ros2 | CloudFormat::Ros1)
    }

    /// The definition of the messages in which such clouds are written.
    pub fn schema(self) -> MessageSchema {
        match self.written() {
            CloudFormat::Ros2 | CloudFormat::LivoxRos2 => definitions::POINT_CLOUD2,
            CloudFormat::Ros1 | CloudFormat::LivoxRos1 => definitions::ros1::POINT_CLOUD2,
            CloudFormat::FoxgloveRos2 => definitions::FOXGLOVE_POINT_CLOUD,
            CloudFormat::FoxgloveProtobuf => {
                MessageSchema::protobuf::<PointCloud>(self.type_name())
            }
            CloudFormat::FoxgloveJson => MessageSchema::json(
                self.type_name(),
                include_str!("../definitions/foxglove/PointCloud.json"),
            ),
        }
    }

    pub(super) fn malformed(self, problem: String) -> FrameError {
        FrameError::Malformed { message: self.type_name(), problem }
    }
}
