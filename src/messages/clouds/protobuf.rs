//! `foxglove.PointCloud` in protobuf.
//!
//! Read field by field where it lies, because the data is nearly all of the message and need not be
//! copied (docs/decisions/0007-formats-of-clouds.md); written by the `foxglove` crate but for the
//! data, which is last in the message and is appended.

use std::borrow::Cow;

use foxglove::messages::{PackedElementField, PointCloud, Pose, Quaternion, Vector3};
use foxglove::{Decode, Encode};

use super::fields::{CloudPose, MOST_FIELDS, PointField};
use super::format::CloudFormat;
use super::foxglove_cdr as shared;
use super::message::CloudMessage;
use super::wire_format::{Value, put_bytes, put_integer, put_length, values};
use crate::error::frame::Result;
use crate::messages::stamp;

/// Number of `data` in the message.
const DATA: u64 = 6;

/// Reads a message; the data stays where it is. Of a value that comes twice the last counts, as in
/// protobuf.
pub(super) fn decode(message: &[u8]) -> Result<CloudMessage<'_>> {
    parse(message).map_err(malformed)?
}

/// Stamp of a message in nanoseconds.
pub(super) fn stamp_ns(message: &[u8]) -> Result<i64> {
    let (mut seconds, mut nanoseconds) = (0, 0);
    for value in values(message) {
        if let (1, Value::Bytes(bytes)) = value.map_err(malformed)? {
            (seconds, nanoseconds) = timestamp(bytes).map_err(malformed)?;
        }
    }
    Ok(stamp::stamp_ns(seconds, nanoseconds))
}

fn malformed(problem: String) -> crate::error::FrameError {
    CloudFormat::FoxgloveProtobuf.malformed(problem)
}

/// A value, or what is wrong.
type Parsed<T> = std::result::Result<T, String>;

fn parse(message: &[u8]) -> Parsed<Result<CloudMessage<'_>>> {
    let (mut stamp, mut frame_id, mut pose) = ((0, 0), String::new(), None);
    let (mut stride, mut fields, mut data) = (0, Vec::new(), &[][..]);
    for value in values(message) {
        match value? {
            (1, Value::Bytes(bytes)) => stamp = timestamp(bytes)?,
            (2, Value::Bytes(bytes)) => frame_id = text(bytes)?,
            (3, Value::Bytes(bytes)) => pose = Some(self::pose(bytes)?),
            (4, Value::Fixed32(value)) => stride = value,
            (5, Value::Bytes(_)) if fields.len() == MOST_FIELDS => {
                return Err(format!("more than {MOST_FIELDS} fields"));
            }
            (5, Value::Bytes(bytes)) => fields.push(field(bytes)?),
            (DATA, Value::Bytes(bytes)) => data = bytes,
            (number @ 1..=DATA, value) => return Err(wrong_kind(number, value)),
            _ => {}
        }
    }
    let (stamp_sec, stamp_nanosec) = stamp;
    let cloud =
        shared::unorganised(CloudFormat::FoxgloveProtobuf, stride, fields, Cow::Borrowed(data));
    Ok(cloud.map(|cloud| CloudMessage { stamp_sec, stamp_nanosec, frame_id, pose, ..cloud }))
}

fn wrong_kind(number: u64, value: Value) -> String {
    let kind = match value {
        Value::Varint(_) => "an integer of variable length",
        Value::Fixed64(_) => "64 bits",
        Value::Bytes(_) => "bytes",
        Value::Fixed32(_) => "32 bits",
    };
    format!("field {number} is {kind}, which is not what it has to be")
}

/// `google.protobuf.Timestamp`: seconds and nanoseconds.
fn timestamp(message: &[u8]) -> Parsed<(i64, u32)> {
    let mut stamp = (0, 0);
    for value in values(message) {
        match value? {
            (1, Value::Varint(seconds)) => stamp.0 = seconds as i64,
            (2, Value::Varint(nanoseconds)) => {
                stamp.1 = u32::try_from(nanoseconds)
                    .map_err(|_| format!("a stamp of {} nanoseconds", nanoseconds as i64))?;
            }
            _ => {}
        }
    }
    Ok(stamp)
}

fn text(bytes: &[u8]) -> Parsed<String> {
    String::from_utf8(bytes.to_vec()).map_err(|_| "a text that is not UTF-8".to_owned())
}

fn pose(message: &[u8]) -> Parsed<CloudPose> {
    // What a message leaves out is 0 in protobuf, in a quaternion too.
    let Pose { position, orientation } = part(message)?;
    let Vector3 { x, y, z } = position.unwrap_or_default();
    let Quaternion { x: i, y: j, z: k, w } = orientation.unwrap_or_default();
    Ok(CloudPose { position: [x, y, z], orientation: [i, j, k, w] })
}

fn field(message: &[u8]) -> Parsed<PointField> {
    let PackedElementField { name, offset, r#type } = part(message)?;
    Ok(PointField { name, offset, datatype: shared::datatype(r#type), count: 1 })
}

/// A small message within the message.
fn part<M: Decode>(message: &[u8]) -> Parsed<M>
where
    M::Error: std::fmt::Display,
{
    M::decode(message).map_err(|error| error.to_string())
}

/// Appends the message with data that `fill` appends.
pub(super) fn encode(
    cloud: &CloudMessage,
    length: usize,
    out: &mut Vec<u8>,
    fill: impl FnOnce(&mut Vec<u8>),
) {
    put_timestamp(cloud.stamp_sec, cloud.stamp_nanosec, out);
    head(cloud).encode(out).expect("a vector has room for it");
    if length > 0 {
        put_length(DATA, length, out);
        fill(out);
    }
}

/// Appends the stamp as it is, which the crate's type would put in order first: seconds from 0,
/// nanoseconds below a second.
fn put_timestamp(sec: i64, nanosec: u32, out: &mut Vec<u8>) {
    let mut timestamp = Vec::new();
    put_integer(1, sec as u64, &mut timestamp);
    put_integer(2, nanosec.into(), &mut timestamp);
    put_bytes(1, &timestamp, out);
}

/// The message without its stamp and its data.
fn head(cloud: &CloudMessage) -> PointCloud {
    PointCloud {
        timestamp: None,
        frame_id: cloud.frame_id.clone(),
        pose: cloud.pose.map(|pose| pose_message(&pose)),
        point_stride: cloud.point_step,
        fields: cloud.fields.iter().map(field_message).collect(),
        data: Default::default(),
    }
}

fn pose_message(pose: &CloudPose) -> Pose {
    let [x, y, z] = pose.position;
    let position = Some(Vector3 { x, y, z });
    let [x, y, z, w] = pose.orientation;
    Pose { position, orientation: Some(Quaternion { x, y, z, w }) }
}

fn field_message(field: &PointField) -> PackedElementField {
    PackedElementField {
        name: field.name.clone(),
        offset: field.offset,
        r#type: shared::code(field.datatype),
    }
}
