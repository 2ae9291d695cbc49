//! `foxglove.PointCloud` in JSON, as its JSON schema has it; and as protobuf's JSON has it, with
//! names of types and times as text.

use std::borrow::Cow;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::fields::{CloudPose, Datatype, MOST_FIELDS, PointField};
use super::format::CloudFormat;
use super::foxglove_cdr::{code, datatype, datatype_of_name, unorganised};
use super::message::CloudMessage;
use crate::error::frame::{FrameError, Result};
use crate::messages::stamp::{self as time, parse_rfc3339};

/// Reads data with or without padding, writes it with padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The message as it is read. What is left out has its default, as in protobuf.
#[derive(Deserialize, Default)]
#[serde(default)]
struct Message<'a> {
    #[serde(borrow)]
    timestamp: Option<Stamp<'a>>,
    #[serde(alias = "frameId")]
    frame_id: String,
    pose: Option<Pose>,
    #[serde(alias = "pointStride")]
    point_stride: u32,
    #[serde(borrow, deserialize_with = "fields")]
    fields: Vec<Field<'a>>,
    #[serde(borrow)]
    data: Cow<'a, str>,
}

/// The message's stamp alone.
#[derive(Deserialize)]
struct Stamped<'a> {
    #[serde(borrow, default)]
    timestamp: Option<Stamp<'a>>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "a stamp is {\"sec\": …, \"nsec\": …} or a time as in RFC 3339")]
enum Stamp<'a> {
    Parts {
        #[serde(alias = "seconds")]
        sec: i64,
        #[serde(alias = "nanos", alias = "nanosec", default)]
        nsec: u32,
    },
    Text(#[serde(borrow)] Cow<'a, str>),
}

#[derive(Deserialize, Serialize, Default)]
#[serde(default)]
struct Pose {
    position: Vector,
    orientation: Orientation,
}

#[derive(Deserialize, Serialize, Default)]
#[serde(default)]
struct Vector {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Deserialize, Serialize, Default)]
#[serde(default)]
struct Orientation {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

/// Reads the fields; fails at the first one too many, before it is kept.
fn fields<'de, D: Deserializer<'de>>(list: D) -> std::result::Result<Vec<Field<'de>>, D::Error> {
    struct Fields;
    impl<'de> Visitor<'de> for Fields {
        type Value = Vec<Field<'de>>;

        fn expecting(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
            write!(out, "at most {MOST_FIELDS} fields")
        }

        fn visit_seq<A: SeqAccess<'de>>(
            self,
            mut list: A,
        ) -> std::result::Result<Self::Value, A::Error> {
            let mut fields = Vec::new();
            while let Some(field) = list.next_element()? {
                if fields.len() == MOST_FIELDS {
                    return Err(A::Error::invalid_length(MOST_FIELDS + 1, &self));
                }
                fields.push(field);
            }
            Ok(fields)
        }
    }
    list.deserialize_seq(Fields)
}

#[derive(Deserialize)]
struct Field<'a> {
    #[serde(default)]
    name: String,
    #[serde(default)]
    offset: u32,
    #[serde(borrow, default, rename = "type")]
    kind: Option<Kind<'a>>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "a type is a number from 0 to 8 or a name such as \"FLOAT32\"")]
enum Kind<'a> {
    Code(i32),
    Name(#[serde(borrow)] Cow<'a, str>),
}

/// Reads a message. The data is copied out of its text.
pub(super) fn decode(message: &[u8]) -> Result<CloudMessage<'_>> {
    let message: Message = parse(message)?;
    let (stamp_sec, stamp_nanosec) = stamp(message.timestamp)?;
    let fields = message.fields.into_iter().map(field).collect::<Result<_>>()?;
    let data = BASE64.decode(message.data.as_bytes()).map_err(|error| {
        malformed(format!("the data, {} letters, is no base64: {error}", message.data.len()))
    })?;
    let format = CloudFormat::FoxgloveJson;
    let cloud = unorganised(format, message.point_stride, fields, Cow::Owned(data))?;
    let (frame_id, pose) = (message.frame_id, message.pose.map(|pose| pose.read()));
    Ok(CloudMessage { stamp_sec, stamp_nanosec, frame_id, pose, ..cloud })
}

/// Stamp of a message in nanoseconds.
pub(super) fn stamp_ns(message: &[u8]) -> Result<i64> {
    let message: Stamped = parse(message)?;
    let (sec, nanosec) = stamp(message.timestamp)?;
    Ok(time::stamp_ns(sec, nanosec))
}

fn malformed(problem: String) -> FrameError {
    CloudFormat::FoxgloveJson.malformed(problem)
}

fn parse<'a, T: Deserialize<'a>>(message: &'a [u8]) -> Result<T> {
    // A list of the values without their names would be taken, too.
    if message.trim_ascii_start().first() != Some(&b'{') {
        return Err(malformed(format!("{} bytes that are no object of JSON", message.len())));
    }
    serde_json::from_slice(message).map_err(|error| malformed(error.to_string()))
}

fn stamp(stamp: Option<Stamp>) -> Result<(i64, u32)> {
    match stamp {
        None => Ok((0, 0)),
        Some(Stamp::Parts { sec, nsec }) => Ok((sec, nsec)),
        Some(Stamp::Text(text)) => parse_rfc3339(&text)
            .ok_or_else(|| malformed(format!("the stamp `{text}` is no time as in RFC 3339"))),
    }
}

fn field(field: Field) -> Result<PointField> {
    let datatype = match field.kind {
        None => Datatype::Unknown(0),
        Some(Kind::Code(code)) => datatype(code),
        Some(Kind::Name(name)) => datatype_of_name(&name).ok_or_else(|| {
            malformed(format!("field `{}` has the unknown type `{name}`", field.name))
        })?,
    };
    Ok(PointField { name: field.name, offset: field.offset, datatype, count: 1 })
}

impl Pose {
    fn read(&self) -> CloudPose {
        let Pose { position: Vector { x, y, z }, orientation: q } = self;
        CloudPose { position: [*x, *y, *z], orientation: [q.x, q.y, q.z, q.w] }
    }

    fn of(pose: &CloudPose) -> Self {
        let ([x, y, z], [i, j, k, w]) = (pose.position, pose.orientation);
        Pose { position: Vector { x, y, z }, orientation: Orientation { x: i, y: j, z: k, w } }
    }
}

/// The message as it is written, without its data.
#[derive(Serialize)]
struct Head<'a> {
    timestamp: StampParts,
    frame_id: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pose: Option<Pose>,
    point_stride: u32,
    fields: Vec<FieldHead<'a>>,
}

#[derive(Serialize)]
struct StampParts {
    sec: i64,
    nsec: u32,
}

#[derive(Serialize)]
struct FieldHead<'a> {
    name: &'a str,
    offset: u32,
    #[serde(rename = "type")]
    kind: i32,
}

impl<'a> FieldHead<'a> {
    fn of(field: &'a PointField) -> Self {
        FieldHead { name: &field.name, offset: field.offset, kind: code(field.datatype) }
    }
}

/// Length of the data in a message: in JSON as base64, in other formats as it is.
pub(super) fn data_len(format: CloudFormat, length: usize) -> usize {
    match format {
        CloudFormat::FoxgloveJson => length.div_ceil(3) * 4,
        _ => length,
    }
}

/// Appends the message with data that `fill` appends.
pub(super) fn encode(
    cloud: &CloudMessage,
    length: usize,
    out: &mut Vec<u8>,
    fill: impl FnOnce(&mut Vec<u8>),
) {
    let head = Head {
        timestamp: StampParts { sec: cloud.stamp_sec, nsec: cloud.stamp_nanosec },
        frame_id: &cloud.frame_id,
        pose: cloud.pose.as_ref().map(Pose::of),
        point_stride: cloud.point_step,
        fields: cloud.fields.iter().map(FieldHead::of).collect(),
    };
    serde_json::to_writer(&mut *out, &head).expect("numbers and text are JSON");
    out.pop(); // the brace that would close it
    out.extend_from_slice(br#","data":""#);
    put_base64(length, out, fill);
    out.extend_from_slice(br#""}"#);
}

fn put_base64(length: usize, out: &mut Vec<u8>, fill: impl FnOnce(&mut Vec<u8>)) {
    let mut data = Vec::with_capacity(length);
    fill(&mut data);
    let start = out.len();
    out.resize(start + data_len(CloudFormat::FoxgloveJson, data.len()), 0);
    BASE64.encode_slice(&data, &mut out[start..]).expect("there is room for all letters");
}
