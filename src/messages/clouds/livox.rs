//! `CustomMsg` of Livox's drivers (livox_ros_driver, livox_ros_driver2; ROS 1 and 2), as the
//! PointCloud2 that is written in its stead.

use std::borrow::Cow;

use super::fields::{Datatype, PointField};
use super::format::CloudFormat;
use super::message::CloudMessage;
use crate::error::frame::Result;
use crate::messages::ros::RosReader;

/// Bytes of a point: time, x, y, z, reflectivity, tag, line. CDR puts one of padding between them.
const SMALLEST_POINT: usize = 4 + 3 * 4 + 3;

/// Bytes of a point of the PointCloud2, which starts with multiples of four as viewers want it.
const POINT_STEP: u32 = 20;

/// The fields of the PointCloud2: metres, what came back of the light, Livox's tag (noise, return),
/// the laser that measured, nanoseconds after the time base.
const FIELDS: [(&str, u32, Datatype); 7] = [
    ("x", 0, Datatype::Float32),
    ("y", 4, Datatype::Float32),
    ("z", 8, Datatype::Float32),
    ("reflectivity", 12, Datatype::UInt8),
    ("tag", 13, Datatype::UInt8),
    ("line", 14, Datatype::UInt8),
    ("offset_time", 16, Datatype::UInt32),
];

/// Reads a message of [`CloudFormat::LivoxRos2`] or [`CloudFormat::LivoxRos1`]. Its own count of
/// points (`point_num`) is left aside for the length of the list.
pub(super) fn decode(format: CloudFormat, message: &[u8]) -> Result<CloudMessage<'_>> {
    let mut reader = format.ros_reader(message)?;
    let (stamp_sec, stamp_nanosec, frame_id) = reader.header()?;
    let (_time_base, _point_num, _lidar_id) = (reader.u64()?, reader.u32()?, reader.u8()?);
    for _reserved in 0..3 {
        reader.u8()?;
    }
    let count = reader.sequence(SMALLEST_POINT)?;
    let mut data = Vec::with_capacity(count * POINT_STEP as usize);
    for _ in 0..count {
        point(&mut reader, &mut data)?;
    }
    // The list is shorter than the message, so that 32 bits count it.
    let row_step = data.len() as u32;
    let field = |(name, offset, datatype): (&str, _, _)| PointField {
        name: name.to_owned(),
        offset,
        datatype,
        count: 1,
    };
    Ok(CloudMessage {
        format: format.written(),
        byte_order: reader.layout().byte_order(),
        stamp_sec,
        stamp_nanosec,
        frame_id,
        height: 1,
        width: count as u32,
        fields: FIELDS.map(field).to_vec(),
        point_step: POINT_STEP,
        row_step,
        data: Cow::Owned(data),
        is_dense: true,
        ..CloudMessage::default()
    })
}

/// Appends the next point.
fn point(reader: &mut RosReader, data: &mut Vec<u8>) -> Result<()> {
    let offset_time = reader.u32()?;
    for _axis in 0..3 {
        data.extend_from_slice(&reader.f32()?.to_le_bytes());
    }
    data.extend_from_slice(&[reader.u8()?, reader.u8()?, reader.u8()?, 0]);
    data.extend_from_slice(&offset_time.to_le_bytes());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::ros::{ByteOrder, Layout, RosWriter};

    /// A message of two points.
    fn message(layout: Layout) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut writer = RosWriter::new(layout, &mut bytes);
        writer.header((7, 8, "livox_frame"));
        writer.u64(1_700_000_000_000_000_000);
        writer.u32(2);
        [1, 0, 0, 0].into_iter().for_each(|byte| writer.u8(byte));
        writer.length(2);
        for (time, [x, y, z], tail) in
            [(5, [1.0, -2.0, 0.5], [200, 16, 3]), (99_999, [0.0, 3.5, -1.0], [1, 0, 0])]
        {
            writer.u32(time);
            [x, y, z].into_iter().for_each(|number| writer.f32(number));
            tail.into_iter().for_each(|byte| writer.u8(byte));
        }
        bytes
    }

    #[test]
    fn points_are_read_in_every_layout() {
        for (format, layout) in [
            (CloudFormat::LivoxRos2, Layout::Cdr(ByteOrder::Little)),
            (CloudFormat::LivoxRos2, Layout::Cdr(ByteOrder::Big)),
            (CloudFormat::LivoxRos1, Layout::Ros1),
        ] {
            let bytes = message(layout);
            let cloud = format.decode(&bytes).unwrap();
            assert_eq!((cloud.point_count(), cloud.frame_id.as_str()), (2, "livox_frame"));
            assert_eq!(cloud.column_f64("x").unwrap(), [1.0, 0.0]);
            assert_eq!(cloud.column_f64("y").unwrap(), [-2.0, 3.5]);
            assert_eq!(cloud.column_f64("z").unwrap(), [0.5, -1.0]);
            assert_eq!(cloud.column_u32("offset_time").unwrap(), [5, 99_999]);
            assert_eq!(cloud.column_u32("tag").unwrap(), [16, 0]);
            assert_eq!(cloud.remission().unwrap().unwrap(), [200.0, 1.0]);
            let points = cloud.to_cloud(None).unwrap();
            assert_eq!(points.ring.as_deref(), Some(&[3, 0][..]));
            assert_eq!(format.stamp_ns(&bytes).unwrap(), 7_000_000_008);

            // It is written as the PointCloud2 of the same ROS.
            let mut written = Vec::new();
            cloud.encode(&mut written).unwrap();
            assert_eq!(format.written().decode(&written).unwrap(), cloud);
            for length in 0..bytes.len() {
                assert!(format.decode(&bytes[..length]).is_err(), "{length}");
            }
        }
    }
}
