//! `sensor_msgs/PointCloud2` of ROS 1 and 2: the same fields, laid out as each of them does.

use std::borrow::Cow;

use super::fields::{Datatype, MOST_FIELDS, PointField};
use super::format::CloudFormat;
use super::message::CloudMessage;
use crate::error::frame::Result;
use crate::messages::ros::{ByteOrder, Layout, RosReader, RosWriter};

impl CloudFormat {
    /// A cursor at the start of a message of one of the ROS formats.
    pub(super) fn ros_reader(self, message: &[u8]) -> Result<RosReader<'_>> {
        RosReader::new(self.type_name(), self.written() == CloudFormat::Ros1, message)
    }
}

/// Reads a message of [`CloudFormat::Ros2`] or [`CloudFormat::Ros1`]. The data stays where it is.
pub(super) fn decode(format: CloudFormat, message: &[u8]) -> Result<CloudMessage<'_>> {
    let mut reader = format.ros_reader(message)?;
    let (stamp_sec, stamp_nanosec, frame_id) = reader.header()?;
    Ok(CloudMessage {
        format,
        byte_order: reader.layout().byte_order(),
        stamp_sec,
        stamp_nanosec,
        frame_id,
        pose: None,
        height: reader.u32()?,
        width: reader.u32()?,
        fields: read_fields(&mut reader, SMALLEST_FIELD, read_field)?,
        is_bigendian: reader.bool()?,
        point_step: reader.u32()?,
        row_step: reader.u32()?,
        data: Cow::Borrowed(reader.data()?),
        is_dense: reader.bool()?,
    })
}

/// Appends the message with data that `fill` appends. What is before the data is aligned to it.
pub(super) fn encode(
    cloud: &CloudMessage,
    length: usize,
    out: &mut Vec<u8>,
    fill: impl FnOnce(&mut Vec<u8>),
) {
    let layout = cloud.ros_layout();
    let mut writer = RosWriter::new(layout, out);
    writer.header((cloud.stamp_sec as i32, cloud.stamp_nanosec, &cloud.frame_id));
    writer.u32(cloud.height);
    writer.u32(cloud.width);
    writer.length(cloud.fields.len());
    for field in &cloud.fields {
        writer.string(&field.name);
        writer.u32(field.offset);
        writer.u8(field.datatype.code_in(&TYPES) as u8);
        writer.u32(field.count);
    }
    writer.bool(cloud.is_bigendian);
    writer.u32(cloud.point_step);
    writer.u32(cloud.row_step);
    writer.length(length);
    let start = out.len();
    fill(out);
    debug_assert_eq!(out.len() - start, length);
    RosWriter::resume(layout, out).bool(cloud.is_dense);
}

impl CloudMessage<'_> {
    /// How the message lies in bytes, of one of the ROS formats.
    pub(super) fn ros_layout(&self) -> Layout {
        self.layout().unwrap_or(Layout::Cdr(ByteOrder::Little))
    }
}

/// An empty name, offset, datatype and count, without padding.
const SMALLEST_FIELD: usize = 4 + 4 + 1 + 4;

/// Reads a sequence of fields of at least `smallest` bytes each.
pub(super) fn read_fields(
    reader: &mut RosReader,
    smallest: usize,
    read: impl Fn(&mut RosReader) -> Result<PointField>,
) -> Result<Vec<PointField>> {
    let count = reader.sequence(smallest)?;
    if count > MOST_FIELDS {
        return Err(reader.malformed(format!("{count} fields, more than {MOST_FIELDS}")));
    }
    (0..count).map(|_| read(reader)).collect()
}

fn read_field(reader: &mut RosReader) -> Result<PointField> {
    Ok(PointField {
        name: reader.string()?,
        offset: reader.u32()?,
        datatype: Datatype::of_code(&TYPES, reader.u8()?.into()),
        count: reader.u32()?,
    })
}

/// The types in the order of their codes in `sensor_msgs/PointField`, the first of which is 1.
const TYPES: [Datatype; 8] = [
    Datatype::Int8,
    Datatype::UInt8,
    Datatype::Int16,
    Datatype::UInt16,
    Datatype::Int32,
    Datatype::UInt32,
    Datatype::Float32,
    Datatype::Float64,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_those_of_the_definition() {
        let datatype = |code| Datatype::of_code(&TYPES, code);
        assert_eq!(datatype(1), Datatype::Int8);
        assert_eq!(datatype(7), Datatype::Float32);
        assert_eq!(datatype(0), Datatype::Unknown(0));
        assert!((0..=255).all(|code| datatype(code).code_in(&TYPES) == code));
    }

    #[test]
    fn ros1_known_bytes() {
        let data = 1.5_f32.to_le_bytes();
        let cloud = CloudMessage {
            format: CloudFormat::Ros1,
            stamp_sec: 3_000_000_000,
            stamp_nanosec: 5,
            frame_id: "ab".to_owned(),
            width: 1,
            fields: vec![super::super::tests::field("x", 0, Datatype::Float32)],
            point_step: 4,
            row_step: 4,
            data: Cow::Borrowed(&data),
            is_dense: true,
            ..CloudMessage::default()
        };
        let expected = [
            [0, 0, 0, 0].as_slice(), // seq
            &3_000_000_000_u32.to_le_bytes(),
            &[5, 0, 0, 0, 2, 0, 0, 0, b'a', b'b'],
            &[1, 0, 0, 0, 1, 0, 0, 0], // height, width
            &[1, 0, 0, 0, 1, 0, 0, 0, b'x', 0, 0, 0, 0, 7, 1, 0, 0, 0],
            &[0, 4, 0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0],
            &data,
            &[1],
        ];
        let mut message = Vec::new();
        cloud.encode(&mut message).unwrap();
        assert_eq!(message, expected.concat());
        assert_eq!(CloudFormat::Ros1.decode(&message).unwrap(), cloud);
        assert_eq!(CloudFormat::Ros1.stamp_ns(&message).unwrap(), 3_000_000_000_000_000_005);
        for length in 0..message.len() {
            assert!(CloudFormat::Ros1.decode(&message[..length]).is_err(), "{length}");
        }
    }
}
