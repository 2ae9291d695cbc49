//! A simulated drive as a ROS 2 recording: clouds with truth, and the pose of the sensor.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use nalgebra::Isometry3;

use super::cdr::{ByteOrder, CdrWriter};
use super::point_cloud2::{
    Datatype, POINT_CLOUD2_NAME, POINT_CLOUD2_SCHEMA, PointCloud2, PointField,
};
use super::recording::{MessageHeader, RecordingWriter, WriteOptions};
use crate::error::{Error, Result};
use crate::simulate::{Drive, Frame};

/// Topic of the clouds: x y z intensity t ring label true_instance.
pub const CLOUD_TOPIC: &str = "/lidar/points";

/// Coordinate frame of the clouds.
pub const SENSOR_FRAME: &str = "lidar";

/// Fields of the clouds: name, offset, type. `label` is SemanticKITTI's class, `true_instance` the true
/// object, `t` nanoseconds after the stamp.
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

const TF_NAME: &str = "tf2_msgs/msg/TFMessage";
const TF_SCHEMA: &str = "\
geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
";

/// Writes frames 0 to `frames` of a drive; `on_frame` is called after each and may break off. Returns the
/// size in bytes.
///
/// # Errors
/// Those of [`RecordingWriter`]; [`Error::Interrupted`].
pub fn write_drive(
    drive: &Drive,
    frames: usize,
    output: &Path,
    options: &WriteOptions,
    mut on_frame: impl FnMut(usize) -> ControlFlow<()>,
) -> Result<u64> {
    let options = WriteOptions { profile: "ros2".into(), ..options.clone() };
    let mut writer = RecordingWriter::create(output, &options)?;
    let qos = "- history: 1\n  depth: 10\n  reliability: 1\n  durability: 2\n";
    let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), qos.to_owned())]);
    let schema = writer.add_schema(POINT_CLOUD2_NAME, "ros2msg", POINT_CLOUD2_SCHEMA.as_bytes())?;
    let clouds = writer.add_channel(CLOUD_TOPIC, schema, "cdr", &metadata)?;
    let schema = writer.add_schema(TF_NAME, "ros2msg", TF_SCHEMA.as_bytes())?;
    let poses = writer.add_channel("/tf", schema, "cdr", &metadata)?;
    let mut message = Vec::new();
    for number in 0..frames {
        let frame = drive.frame(number);
        let mut write = |channel_id: u16, message: &[u8]| {
            let header = MessageHeader {
                channel_id,
                sequence: number as u32,
                log_time: frame.stamp_ns + DELAY_NS,
                publish_time: frame.stamp_ns + DELAY_NS,
            };
            writer.write_message(&header, message)
        };
        transform_message(&frame, &mut message);
        write(poses, &message)?;
        cloud_message(&frame, &mut message)?;
        write(clouds, &message)?;
        if on_frame(number).is_break() {
            return Err(Error::Interrupted { path: output.to_owned() });
        }
    }
    writer.finish()
}

/// A cloud is published when its sweep is over.
const DELAY_NS: u64 = 100_000_000;

/// A frame as a PointCloud2 message, replacing what is in `out`.
///
/// # Errors
/// Those of [`PointCloud2::encode`].
pub fn cloud_message(frame: &Frame, out: &mut Vec<u8>) -> Result<()> {
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
    let (stamp_sec, stamp_nanosec) = stamp(frame);
    let message = PointCloud2 {
        byte_order: ByteOrder::Little,
        stamp_sec,
        stamp_nanosec,
        frame_id: SENSOR_FRAME.to_owned(),
        height: cloud.height as u32,
        width: cloud.width as u32,
        fields: fields.to_vec(),
        is_bigendian: false,
        point_step: POINT_STEP,
        row_step: POINT_STEP * cloud.width as u32,
        data: &data,
        is_dense: true,
    };
    message.encode(out)
}

/// The pose of the sensor in `map`, replacing what is in `out`.
fn transform_message(frame: &Frame, out: &mut Vec<u8>) {
    let Isometry3 { rotation, translation } = frame.pose;
    let (seconds, nanoseconds) = stamp(frame);
    let mut cdr = CdrWriter::new(ByteOrder::Little, out);
    cdr.u32(1);
    cdr.i32(seconds);
    cdr.u32(nanoseconds);
    cdr.string("map");
    cdr.string(SENSOR_FRAME);
    let rotation = rotation.coords;
    for value in translation.vector.iter().chain(rotation.iter()) {
        cdr.f64(*value);
    }
}

fn stamp(frame: &Frame) -> (i32, u32) {
    const SECOND: u64 = 1_000_000_000;
    ((frame.stamp_ns / SECOND) as i32, (frame.stamp_ns % SECOND) as u32)
}
