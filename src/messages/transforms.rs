//! Poses of coordinate frames in one another, in the messages that go with each format of clouds.

use foxglove::Encode;
use foxglove::messages::{FrameTransform, Quaternion, Timestamp, Vector3};
use nalgebra::Isometry3;

use super::clouds::CloudFormat;
use super::definitions::{self, MessageSchema};
use super::ros::{ByteOrder, Layout, RosWriter};
use super::stamp::stamp;

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

/// The definition of the poses that go with clouds of a format: `tf2_msgs/TFMessage` in ROS, else
/// `foxglove.FrameTransform`.
pub(crate) fn schema(format: CloudFormat) -> MessageSchema {
    match format {
        CloudFormat::Ros2 | CloudFormat::FoxgloveRos2 | CloudFormat::LivoxRos2 => {
            definitions::TF_MESSAGE
        }
        CloudFormat::Ros1 | CloudFormat::LivoxRos1 => definitions::ros1::TF_MESSAGE,
        CloudFormat::FoxgloveProtobuf => MessageSchema::protobuf::<FrameTransform>(FRAME_TRANSFORM),
        CloudFormat::FoxgloveJson => MessageSchema::json(
            FRAME_TRANSFORM,
            include_str!("definitions/foxglove/FrameTransform.json"),
        ),
    }
}

const FRAME_TRANSFORM: &str = "foxglove.FrameTransform";

/// A message of one transform, replacing what is in `out`.
pub(crate) fn encode(transform: &Transform, format: CloudFormat, out: &mut Vec<u8>) {
    match format {
        CloudFormat::Ros2 | CloudFormat::FoxgloveRos2 | CloudFormat::LivoxRos2 => {
            tf_message(transform, Layout::Cdr(ByteOrder::Little), out);
        }
        CloudFormat::Ros1 | CloudFormat::LivoxRos1 => tf_message(transform, Layout::Ros1, out),
        CloudFormat::FoxgloveProtobuf => {
            out.clear();
            frame_transform(transform).encode(out).expect("a vector has room for it");
        }
        CloudFormat::FoxgloveJson => {
            out.clear();
            serde_json::to_value(frame_transform(transform))
                .and_then(|message| serde_json::to_writer(out, &message))
                .expect("numbers and text are JSON");
        }
    }
}

fn tf_message(transform: &Transform, layout: Layout, out: &mut Vec<u8>) {
    let Isometry3 { rotation, translation } = transform.pose;
    let (sec, nanosec) = stamp(transform.stamp_ns);
    let mut writer = RosWriter::new(layout, out);
    writer.length(1);
    writer.header((sec, nanosec, transform.parent));
    writer.string(transform.child);
    writer.f64s(translation.vector.iter().chain(rotation.coords.iter()).copied());
}

fn frame_transform(transform: &Transform) -> FrameTransform {
    let (sec, nanosec) = stamp(transform.stamp_ns);
    let Isometry3 { rotation, translation } = transform.pose;
    let [x, y, z] = translation.vector.into();
    let translation = Some(Vector3 { x, y, z });
    let [x, y, z, w] = rotation.coords.into();
    FrameTransform {
        timestamp: Some(Timestamp::new(sec as u32, nanosec)),
        parent_frame_id: transform.parent.to_owned(),
        child_frame_id: transform.child.to_owned(),
        translation,
        rotation: Some(Quaternion { x, y, z, w }),
    }
}
