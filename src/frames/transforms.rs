//! The static transforms of a recording: `tf2_msgs/msg/TFMessage` on `/tf_static`.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::selection::Selection;
use super::topics::{message_count, type_name};
use super::walk::Walk;
use crate::error::{Result, frame};
use crate::messages::ros::RosReader;
use divmerge_core::ParameterError;
use divmerge_core::cloud::sensor_frame::{SensorFrame, Transforms};
use divmerge_recording::{Overview, Record, is_stream};

/// How far into a recording static transforms are looked for, bytes: they are published when a
/// drive begins, and a recorder that joins later gets them first.
const FAR_ENOUGH: u64 = 64 << 20;

/// The static transforms that a sensor frame needs of a recording.
///
/// # Errors
/// For [`SensorFrame::Recorded`]: [`Error::Parameter`](crate::error::Error::Parameter) if the
/// recording is a stream, and those of [`static_transforms`]. For the others a file that cannot be
/// read has no transforms; whoever reads its clouds reports the error.
pub fn recorded_transforms(frame: &SensorFrame, recording: &Path) -> Result<Transforms> {
    match (frame, is_stream(recording)) {
        // The transforms of a stream are known only at its end.
        (SensorFrame::Recorded, true) => {
            let problem = "the transforms of a stream cannot be had; axes or angles can be given";
            Err(ParameterError::new("sensor_frame", problem).into())
        }
        (_, true) => Ok(Transforms::default()),
        (SensorFrame::Recorded, false) => static_transforms(recording),
        (_, false) => Ok(static_transforms(recording).unwrap_or_default()),
    }
}

/// The static transforms among the first 64 MiB of a recording; none where it has no such topic.
/// Messages that cannot be read are passed over.
///
/// # Errors
/// Those of [`Overview::read`] and [`RecordingReader`](divmerge_recording::RecordingReader).
pub fn static_transforms(recording: &Path) -> Result<Transforms> {
    let overview = Overview::read(recording)?;
    let mut transforms = Transforms::default();
    let mut left = 0;
    let mut is_ros1 = BTreeMap::new();
    for channel in overview.channels.values() {
        let is_static = channel.topic.trim_start_matches('/') == "tf_static";
        if is_static && type_name(&overview, channel).ends_with("TFMessage") {
            left += message_count(&overview, channel.id);
            is_ros1.insert(channel.id, channel.message_encoding == "ros1");
        }
    }
    let topics = is_ros1.keys().map(|&id| (id, overview.channels[&id].topic.as_str().into()));
    let mut walk = Walk::open(&overview, topics.collect(), &Selection::default())?;
    while left > 0 && walk.progress().0 < FAR_ENOUGH {
        let Ok(Some(step)) = walk.next() else { break };
        let Record::Message { header, data, .. } = step.record else { continue };
        if let Some(&is_ros1) = is_ros1.get(&header.channel_id) {
            left -= 1;
            // One that is cut off still says what came before.
            let _ = read(&data, is_ros1, &mut transforms);
        }
    }
    Ok(transforms)
}

/// Takes in the transforms of a message.
///
/// # Errors
/// [`FrameError::Malformed`](crate::error::FrameError::Malformed) where it ends too early; those
/// read before are taken in.
fn read(message: &[u8], is_ros1: bool, transforms: &mut Transforms) -> frame::Result<()> {
    const NAME: &str = "tf2_msgs/msg/TFMessage";
    const SMALLEST: usize = 76;
    let mut reader =
        if is_ros1 { RosReader::ros1(NAME, message) } else { RosReader::cdr(NAME, message)? };
    for _ in 0..reader.sequence(SMALLEST)? {
        let (_, _, parent) = reader.header()?;
        let child = reader.string()?;
        let mut numbers = [0.0; 7];
        for number in &mut numbers {
            *number = reader.f64()?;
        }
        let [along_x, along_y, along_z, x, y, z, w] = numbers;
        let rotation = Quaternion::new(w, x, y, z);
        let translation = Translation3::new(along_x, along_y, along_z);
        if rotation.norm() > 0.1 && numbers.iter().all(|number| number.is_finite()) {
            let rotation = UnitQuaternion::from_quaternion(rotation);
            transforms.insert(&parent, &child, Isometry3::from_parts(translation, rotation));
        }
    }
    Ok(())
}
