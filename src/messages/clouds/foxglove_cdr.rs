//! Foxglove's cloud, which has neither rows nor byte orders: what its encodings share, and CDR.

use std::borrow::Cow;

use super::fields::{CloudPose, Datatype, MOST_FIELDS, PointField};
use super::format::CloudFormat;
use super::message::CloudMessage;
use super::point_cloud2::read_fields;
use crate::error::frame::Result;
use crate::messages::ros::{RosReader, RosWriter};

/// The types in the order of their codes in `foxglove.PackedElementField`, the first of which is 1;
/// 0 is unknown.
const TYPES: [Datatype; 8] = [
    Datatype::UInt8,
    Datatype::Int8,
    Datatype::UInt16,
    Datatype::Int16,
    Datatype::UInt32,
    Datatype::Int32,
    Datatype::Float32,
    Datatype::Float64,
];

/// Names of the codes.
const NAMES: [&str; 9] =
    ["UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64"];

/// The type of a code.
pub(super) fn datatype(code: i32) -> Datatype {
    Datatype::of_code(&TYPES, code)
}

/// The type of a name, if there is one.
pub(super) fn datatype_of_name(name: &str) -> Option<Datatype> {
    NAMES.iter().position(|known| *known == name).map(|code| datatype(code as i32))
}

/// The code of a type.
pub(super) fn code(datatype: Datatype) -> i32 {
    datatype.code_in(&TYPES)
}

/// A cloud of points one behind the other. Sizes that do not agree are left for
/// [`CloudFormat::decode`] to find: a row then is not as long as the data.
pub(super) fn unorganised<'a>(
    format: CloudFormat,
    stride: u32,
    fields: Vec<PointField>,
    data: Cow<'a, [u8]>,
) -> Result<CloudMessage<'a>> {
    if fields.len() > MOST_FIELDS {
        let count = fields.len();
        return Err(format.malformed(format!("{count} fields, more than {MOST_FIELDS}")));
    }
    let (length, step) = (data.len(), stride as usize);
    if step == 0 && length > 0 {
        return Err(format.malformed(format!("{length} bytes of data in points of 0 bytes")));
    }
    if length > 0 && !length.is_multiple_of(step) {
        let problem = format!("{length} bytes of data are no whole number of points of {stride}");
        return Err(format.malformed(problem));
    }
    let sizes = u32::try_from(length.checked_div(step).unwrap_or(0)).ok();
    let Some((width, row_step)) = sizes.zip(u32::try_from(length).ok()) else {
        return Err(format.malformed(format!("{length} bytes of data, more than 32 bits count")));
    };
    Ok(CloudMessage {
        format,
        width,
        fields,
        point_step: stride,
        row_step,
        data,
        ..CloudMessage::default()
    })
}

/// Reads a message of [`CloudFormat::FoxgloveRos2`]. The data stays where it is.
pub(super) fn decode(message: &[u8]) -> Result<CloudMessage<'_>> {
    let format = CloudFormat::FoxgloveRos2;
    let mut reader = format.ros_reader(message)?;
    let (stamp_sec, stamp_nanosec, frame_id) = reader.header()?;
    let pose = CloudPose { position: reader.f64s()?, orientation: reader.f64s()? };
    let stride = reader.u32()?;
    // An empty name, offset and type, without padding.
    let fields = read_fields(&mut reader, 4 + 4 + 1, read_field)?;
    let data = Cow::Borrowed(reader.data()?);
    let byte_order = reader.layout().byte_order();
    let cloud = unorganised(format, stride, fields, data)?;
    Ok(CloudMessage { byte_order, stamp_sec, stamp_nanosec, frame_id, pose: Some(pose), ..cloud })
}

fn read_field(reader: &mut RosReader) -> Result<PointField> {
    Ok(PointField {
        name: reader.string()?,
        offset: reader.u32()?,
        datatype: datatype(reader.u8()?.into()),
        count: 1,
    })
}

/// Appends the message with data that `fill` appends.
pub(super) fn encode(
    cloud: &CloudMessage,
    length: usize,
    out: &mut Vec<u8>,
    fill: impl FnOnce(&mut Vec<u8>),
) {
    let mut writer = RosWriter::new(cloud.ros_layout(), out);
    writer.header((cloud.stamp_sec as i32, cloud.stamp_nanosec, &cloud.frame_id));
    let pose = cloud.pose.unwrap_or_default();
    writer.f64s(pose.position);
    writer.f64s(pose.orientation);
    writer.u32(cloud.point_step);
    writer.length(cloud.fields.len());
    for field in &cloud.fields {
        writer.string(&field.name);
        writer.u32(field.offset);
        writer.u8(code(field.datatype) as u8);
    }
    writer.length(length);
    fill(out);
}
