//! A simulated drive as a recording: clouds with truth, and the pose of the sensor.

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::path::Path;

use divmerge_recording::WriteOptions;

use super::cloud_recording::{CloudRecording, Transform};
use crate::error::{Error, Result};
use crate::messages::clouds::{CloudFormat, CloudMessage, Datatype, PointField};
use crate::messages::stamp::stamp;
use divmerge_simulate::{Drive, SimulatedFrame};

/// Topic of the clouds: x y z intensity t ring label true_instance.
pub const CLOUD_TOPIC: &str = "/lidar/points";

/// Coordinate frame of the clouds.
pub const SENSOR_FRAME: &str = "lidar";

/// Fields of the clouds: name, offset, type. `label` is SemanticKITTI's class, `true_instance` the
/// true object, `t` nanoseconds after the stamp; `ring` is left out where the sensor has none.
const FIELDS: [(&str, u32, Datatype); 8] = [
    ("x", 0, Datatype::Float32),
    ("y", 4, Datatype::Float32),
    ("z", 8, Datatype::Float32),
    ("intensity", 12, Datatype::Float32),
    ("t", 16, Datatype::UInt32),
    ("ring", 20, Datatype::UInt16),
    ("label", 22, Datatype::UInt16),
    ("true_instance", 24, Datatype::UInt16),
];
const POINT_STEP: u32 = 28;

/// Writes frames 0 to `frames` of a drive as a ROS 2 recording; see [`write_drive_in`].
///
/// # Errors
/// Those of [`CloudRecording`]; [`Error::Interrupted`].
pub fn write_drive(
    drive: &Drive,
    frames: usize,
    output: &Path,
    options: &WriteOptions,
    on_frame: impl FnMut(usize) -> ControlFlow<()>,
) -> Result<u64> {
    write_drive_in(drive, (CloudFormat::Ros2, frames), output, options, on_frame)
}

/// Writes frames 0 to `frames` of a drive with clouds of a format; `on_frame` is called after each
/// and may break off. Returns the size in bytes.
///
/// # Errors
/// Those of [`CloudRecording`]; [`Error::Interrupted`].
pub fn write_drive_in(
    drive: &Drive,
    (format, frames): (CloudFormat, usize),
    output: &Path,
    options: &WriteOptions,
    mut on_frame: impl FnMut(usize) -> ControlFlow<()>,
) -> Result<u64> {
    let mut recording = CloudRecording::create(format, output, CLOUD_TOPIC, options)?;
    let mut message = Vec::new();
    for number in 0..frames {
        let frame = drive.frame(number);
        let log_time = frame.stamp_ns + DELAY_NS;
        let (stamp_ns, pose) = (frame.stamp_ns, frame.pose);
        let transform = Transform { stamp_ns, parent: "map", child: SENSOR_FRAME, pose };
        recording.write_pose(log_time, &transform)?;
        cloud_message_in(format, &frame, &mut message)?;
        recording.write_cloud(log_time, &message)?;
        if on_frame(number).is_break() {
            return Err(Error::Interrupted { path: output.to_owned() });
        }
    }
    recording.finish()
}

/// A cloud is published when its sweep is over.
const DELAY_NS: u64 = 100_000_000;

/// A frame as a PointCloud2 message of ROS 2, replacing what is in `out`.
///
/// # Errors
/// Those of [`CloudMessage::encode`].
pub fn cloud_message(frame: &SimulatedFrame, out: &mut Vec<u8>) -> Result<()> {
    cloud_message_in(CloudFormat::Ros2, frame, out)
}

/// A frame as a message of a format, replacing what is in `out`.
///
/// # Errors
/// Those of [`CloudMessage::encode`].
pub fn cloud_message_in(
    format: CloudFormat,
    frame: &SimulatedFrame,
    out: &mut Vec<u8>,
) -> Result<()> {
    let cloud = &frame.cloud;
    let mut data = Vec::with_capacity(cloud.len() * POINT_STEP as usize);
    let column = |column: &Option<Vec<u16>>, point: usize| column.as_ref().map_or(0, |c| c[point]);
    for point in 0..cloud.len() {
        for value in [cloud.x[point], cloud.y[point], cloud.z[point], frame.intensity[point]] {
            data.extend(value.to_le_bytes());
        }
        data.extend(frame.time_offset_ns[point].to_le_bytes());
        data.extend(column(&cloud.ring, point).to_le_bytes());
        data.extend(column(&cloud.class, point).to_le_bytes());
        data.extend(frame.true_instance[point].to_le_bytes());
        data.extend([0; 2]);
    }
    let fields = FIELDS.map(|(name, offset, datatype)| PointField {
        name: name.to_owned(),
        offset,
        datatype,
        count: 1,
    });
    let is_there = |field: &PointField| field.name != "ring" || cloud.ring.is_some();
    let (stamp_sec, stamp_nanosec) = stamp(frame.stamp_ns);
    let message = CloudMessage {
        format,
        stamp_sec: stamp_sec.into(),
        stamp_nanosec,
        frame_id: SENSOR_FRAME.to_owned(),
        height: cloud.height as u32,
        width: cloud.width as u32,
        fields: fields.into_iter().filter(is_there).collect(),
        is_bigendian: false,
        point_step: POINT_STEP,
        row_step: POINT_STEP * cloud.width as u32,
        data: Cow::Borrowed(&data),
        is_dense: true,
        ..CloudMessage::default()
    };
    Ok(message.encode(out)?)
}
