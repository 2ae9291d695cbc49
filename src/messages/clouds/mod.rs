//! Clouds in messages of every format that is read and written, a file a format; all become one
//! [`CloudMessage`].
//!
//! | [`CloudFormat`] | type | message encoding |
//! | --- | --- | --- |
//! | `Ros2` | `sensor_msgs/msg/PointCloud2` | `cdr` |
//! | `Ros1` | `sensor_msgs/PointCloud2` | `ros1` |
//! | `FoxgloveRos2` | `foxglove_msgs/msg/PointCloud` | `cdr` |
//! | `FoxgloveProtobuf` | `foxglove.PointCloud` | `protobuf` |
//! | `FoxgloveJson` | `foxglove.PointCloud` | `json` |
//! | `LivoxRos2` | `livox_ros_driver2/msg/CustomMsg`; read alone | `cdr` |
//! | `LivoxRos1` | `livox_ros_driver2/CustomMsg`; read alone | `ros1` |
//!
//! [`CloudChannel::of`] alone decides which of them a channel carries, or why it cannot be read.

mod channel;
mod codec;
mod columns;
mod fields;
mod format;
mod foxglove_cdr;
mod json;
mod livox;
mod message;
mod point_cloud2;
mod protobuf;
mod wire_format;

#[cfg(test)]
mod format_tests;
#[cfg(test)]
pub(crate) mod tests;

pub use channel::{CloudChannel, Unreadable};
pub use fields::{CloudPose, Datatype, PointField};
pub use format::CloudFormat;
pub use message::CloudMessage;
