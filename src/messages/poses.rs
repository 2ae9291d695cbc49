//! Messages that say where a coordinate frame is: transforms and odometry.

use foxglove::Decode;
use foxglove::messages::{
    FrameTransform, FrameTransforms, Pose, PoseInFrame, Quaternion as Turn, Timestamp, Vector3,
};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::ros::RosReader;
use super::stamp::stamp_ns;
use crate::error::frame::Result;

/// A message that says where a coordinate frame is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PoseMessage {
    /// `tf2_msgs/TFMessage`.
    Transforms(Ros),
    /// `nav_msgs/Odometry`.
    Odometry(Ros),
    /// `geometry_msgs/PoseStamped` or `PoseWithCovarianceStamped`.
    PoseStamped(Ros),
    /// `foxglove.FrameTransform` in protocol buffers.
    FrameTransform,
    /// `foxglove.FrameTransforms` in protocol buffers.
    FrameTransforms,
    /// `foxglove.PoseInFrame` in protocol buffers.
    PoseInFrame,
}

/// Which ROS a message is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ros {
    One,
    Two,
}

/// The pose of a frame in another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RecordedPose<'a> {
    /// Nanoseconds since 1970.
    pub(crate) stamp_ns: i64,
    /// The frame in which the pose is given.
    pub(crate) parent: &'a str,
    /// The frame whose pose it is, where the message names it.
    pub(crate) child: Option<&'a str>,
    /// Takes coordinates of the child to coordinates of the parent, metres.
    pub(crate) pose: Isometry3<f64>,
}

impl PoseMessage {
    /// The message of a type and an encoding; `None` where it says no pose.
    pub(crate) fn named(type_name: &str, encoding: &str) -> Option<Self> {
        let name = type_name.rsplit(['/', '.']).next()?;
        let ros = match encoding {
            "ros1" => Ros::One,
            "cdr" => Ros::Two,
            "protobuf" => {
                return match name {
                    "FrameTransform" => Some(PoseMessage::FrameTransform),
                    "FrameTransforms" => Some(PoseMessage::FrameTransforms),
                    "PoseInFrame" => Some(PoseMessage::PoseInFrame),
                    _ => None,
                };
            }
            _ => return None,
        };
        match name {
            "TFMessage" => Some(PoseMessage::Transforms(ros)),
            "Odometry" => Some(PoseMessage::Odometry(ros)),
            "PoseStamped" | "PoseWithCovarianceStamped" => Some(PoseMessage::PoseStamped(ros)),
            _ => None,
        }
    }

    /// Whether it is about any frames, as the messages of `/tf` are.
    pub(crate) fn is_of_transforms(self) -> bool {
        use PoseMessage::{FrameTransform, FrameTransforms, Transforms};
        matches!(self, Transforms(_) | FrameTransform | FrameTransforms)
    }

    /// Hands over the poses in a message that are poses: of finite numbers and with a rotation.
    ///
    /// # Errors
    /// [`FrameError::Malformed`](crate::error::FrameError::Malformed) where it ends too early;
    /// those read before are handed over.
    pub(crate) fn read(self, message: &[u8], mut take: impl FnMut(RecordedPose)) -> Result<()> {
        match self {
            PoseMessage::Transforms(ros) => read_transforms(ros, message, take),
            PoseMessage::Odometry(ros) => read_pose(ros, message, true, take),
            PoseMessage::PoseStamped(ros) => read_pose(ros, message, false, take),
            PoseMessage::FrameTransform => {
                if let Ok(transform) = FrameTransform::decode(message) {
                    take_transform(&transform, &mut take);
                }
                Ok(())
            }
            PoseMessage::FrameTransforms => {
                let transforms = FrameTransforms::decode(message).unwrap_or_default().transforms;
                transforms.iter().for_each(|transform| take_transform(transform, &mut take));
                Ok(())
            }
            PoseMessage::PoseInFrame => {
                if let Ok(PoseInFrame { timestamp, frame_id, pose: Some(pose) }) =
                    PoseInFrame::decode(message)
                {
                    let Pose { position, orientation } = pose;
                    let pose = foxglove_pose(position, orientation);
                    let stamp_ns = foxglove_stamp(timestamp);
                    let of_frame =
                        |pose| RecordedPose { stamp_ns, parent: &frame_id, child: None, pose };
                    pose.into_iter().for_each(|pose| take(of_frame(pose)));
                }
                Ok(())
            }
        }
    }
}

fn read_transforms(ros: Ros, message: &[u8], mut take: impl FnMut(RecordedPose)) -> Result<()> {
    /// Bytes of the shortest transform.
    const SHORTEST: usize = 76;
    let mut reader = RosReader::new("tf2_msgs/msg/TFMessage", ros == Ros::One, message)?;
    for _ in 0..reader.sequence(SHORTEST)? {
        let (sec, nanosec, parent) = reader.header()?;
        let (child, pose) = (reader.string()?, pose(&mut reader)?);
        let stamp_ns = stamp_ns(sec, nanosec);
        let named = |pose| RecordedPose { stamp_ns, parent: &parent, child: Some(&child), pose };
        pose.into_iter().for_each(|pose| take(named(pose)));
    }
    Ok(())
}

/// Reads the beginning of an odometry, or of a pose with a header, which names no child.
fn read_pose(
    ros: Ros,
    message: &[u8],
    names_child: bool,
    mut take: impl FnMut(RecordedPose),
) -> Result<()> {
    let name = if names_child { "nav_msgs/msg/Odometry" } else { "geometry_msgs/msg/PoseStamped" };
    let mut reader = RosReader::new(name, ros == Ros::One, message)?;
    let (sec, nanosec, parent) = reader.header()?;
    let child = if names_child { Some(reader.string()?) } else { None };
    let child = child.as_deref().filter(|child| !child.is_empty());
    if let Some(pose) = pose(&mut reader)? {
        take(RecordedPose { stamp_ns: stamp_ns(sec, nanosec), parent: &parent, child, pose });
    }
    Ok(())
}

/// The next place and rotation; `None` where they are none.
fn pose(reader: &mut RosReader) -> Result<Option<Isometry3<f64>>> {
    let mut numbers = [0.0; 7];
    for number in &mut numbers {
        *number = reader.f64()?;
    }
    let [along_x, along_y, along_z, x, y, z, w] = numbers;
    Ok(isometry([along_x, along_y, along_z], [x, y, z, w]))
}

fn isometry([x, y, z]: [f64; 3], turn: [f64; 4]) -> Option<Isometry3<f64>> {
    let rotation = Quaternion::from(turn);
    let is_finite = [x, y, z].into_iter().chain(turn).all(f64::is_finite);
    (is_finite && rotation.norm() > 0.1).then(|| {
        let rotation = UnitQuaternion::from_quaternion(rotation);
        Isometry3::from_parts(Translation3::new(x, y, z), rotation)
    })
}

fn take_transform(transform: &FrameTransform, take: &mut impl FnMut(RecordedPose)) {
    let FrameTransform { timestamp, parent_frame_id, child_frame_id, translation, rotation } =
        transform;
    let stamp_ns = foxglove_stamp(*timestamp);
    let (parent, child) = (parent_frame_id.as_str(), Some(child_frame_id.as_str()));
    let pose = foxglove_pose(*translation, *rotation);
    pose.into_iter().for_each(|pose| take(RecordedPose { stamp_ns, parent, child, pose }));
}

pub(crate) fn foxglove_stamp(stamp: Option<Timestamp>) -> i64 {
    stamp.map_or(0, |stamp| stamp_ns(i64::from(stamp.sec()), stamp.nsec()))
}

fn foxglove_pose(place: Option<Vector3>, turn: Option<Turn>) -> Option<Isometry3<f64>> {
    let place = place.map_or([0.0; 3], |place| [place.x, place.y, place.z]);
    isometry(place, turn.map_or([0.0, 0.0, 0.0, 1.0], |turn| [turn.x, turn.y, turn.z, turn.w]))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::messages::clouds::CloudFormat;
    use crate::messages::ros::{ByteOrder, Layout, RosWriter};
    use crate::messages::transforms::{Transform, encode};

    const PARTS: [f64; 7] = [1.0, -2.0, 0.5, 0.0, 0.0, 0.6, 0.8];

    fn expected() -> Isometry3<f64> {
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(0.8, 0.0, 0.0, 0.6));
        Isometry3::from_parts(Translation3::new(1.0, -2.0, 0.5), turn)
    }

    fn poses(
        kind: PoseMessage,
        message: &[u8],
    ) -> Vec<(i64, String, Option<String>, Isometry3<f64>)> {
        let mut found = Vec::new();
        let _ = kind.read(message, |at| {
            found.push((at.stamp_ns, at.parent.to_owned(), at.child.map(str::to_owned), at.pose));
        });
        found
    }

    #[test]
    fn transforms_come_back_in_all_formats() {
        let transform =
            Transform { stamp_ns: 5_000_000_006, parent: "odom", child: "car", pose: expected() };
        let formats = [
            (CloudFormat::Ros2, PoseMessage::named("tf2_msgs/msg/TFMessage", "cdr")),
            (CloudFormat::Ros1, PoseMessage::named("tf2_msgs/TFMessage", "ros1")),
            (
                CloudFormat::FoxgloveProtobuf,
                PoseMessage::named("foxglove.FrameTransform", "protobuf"),
            ),
        ];
        for (format, kind) in formats {
            let mut message = Vec::new();
            encode(&transform, format, &mut message);
            let found = poses(kind.expect("a type"), &message);
            let [(stamp_ns, parent, child, pose)] = found.as_slice() else { panic!("{found:?}") };
            assert_eq!((*stamp_ns, parent.as_str()), (5_000_000_006, "odom"));
            assert_eq!(child.as_deref(), Some("car"));
            assert!((pose.inv_mul(&expected())).translation.vector.norm() < 1e-12);
        }
    }

    #[test]
    fn odometry_names_its_child_and_a_pose_does_not() {
        for (layout, encoding) in [(Layout::Cdr(ByteOrder::Little), "cdr"), (Layout::Ros1, "ros1")]
        {
            for (name, child) in [("Odometry", Some("base_link")), ("PoseStamped", None)] {
                let mut message = Vec::new();
                let mut writer = RosWriter::new(layout, &mut message);
                writer.header((5, 6, "odom"));
                child.into_iter().for_each(|child| writer.string(child));
                writer.f64s(PARTS);
                let kind = PoseMessage::named(name, encoding).expect("a type");
                let found = poses(kind, &message);
                let [(5_000_000_006, parent, of, pose)] = found.as_slice() else {
                    panic!("{found:?}")
                };
                assert_eq!((parent.as_str(), of.as_deref()), ("odom", child));
                assert!(pose.rotation.angle_to(&expected().rotation) < 1e-12);
                assert_eq!(poses(kind, &message[..message.len() - 1]), []);
            }
        }
    }

    #[test]
    fn numbers_that_are_no_pose_are_passed_over() {
        let far = Vector3::new(f64::INFINITY, 0.0, 0.0);
        assert_eq!(isometry(far.into(), [0.0, 0.0, 0.0, 1.0]), None);
        assert_eq!(isometry([0.0; 3], [0.0; 4]), None);
        assert_eq!(isometry([0.0; 3], [0.0, 0.0, f64::NAN, 1.0]), None);
        assert_eq!(PoseMessage::named("sensor_msgs/msg/Imu", "cdr"), None);
        assert_eq!(PoseMessage::named("TFMessage", "json"), None);
    }
}
