//! The points of a file as a PointCloud2 message describes them.

use std::borrow::Cow;

use crate::error::FrameError;
use crate::error::frame::Result;
use crate::messages::clouds::{CloudMessage, Datatype, PointField};
use crate::messages::ros::ByteOrder;
use crate::messages::stamp::stamp;

/// The points of a file, described as a PointCloud2 message does.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Columns.
    pub fields: Vec<PointField>,
    /// Bytes from point to point.
    pub point_step: u32,
    /// Rows; 1 if unorganised.
    pub height: u32,
    /// Points per row.
    pub width: u32,
    /// Whether the numbers in `data` are big endian.
    pub is_bigendian: bool,
    /// The points, row by row without gaps.
    pub data: Vec<u8>,
    /// What the file holds and a message cannot.
    pub left_out: Vec<String>,
}

/// What a parser returns: a value, or what is wrong.
pub(super) type Parsed<T> = std::result::Result<T, String>;

impl Scan {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.height as usize * self.width as usize
    }

    /// Whether there is no point at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Adds two UINT16 fields behind each point: the low and the high half of its label word.
    ///
    /// # Errors
    /// [`FrameError::LabelCount`] unless there is a word for each point; [`FrameError::Malformed`]
    /// if there is a field of such a name, or the points become too long for a message.
    pub fn append_labels(&mut self, words: &[u32], [class, instance]: [&str; 2]) -> Result<()> {
        if words.len() != self.len() {
            return Err(FrameError::LabelCount { labels: words.len(), points: self.len() });
        }
        let malformed = |problem| FrameError::Malformed { message: "scan", problem };
        if let Some(name) = [class, instance].into_iter().find(|&name| self.has(name)) {
            return Err(malformed(format!("there is a field `{name}` already")));
        }
        let (order, step) = (self.order(), self.point_step);
        let longer =
            step.checked_add(4).filter(|&step| u64::from(step) * (self.len() as u64) <= MOST);
        self.point_step = longer.ok_or_else(|| malformed(too_long(self.len() as u64, step, 4)))?;
        let mut data = Vec::with_capacity(self.len() * self.point_step as usize);
        for (point, &word) in self.data.chunks_exact((step as usize).max(1)).zip(words) {
            data.extend_from_slice(point);
            data.extend(order.put_u16(word as u16));
            data.extend(order.put_u16((word >> 16) as u16));
        }
        self.data = data;
        for (name, offset) in [(class, step), (instance, step + 2)] {
            self.fields.push(field(name, offset, Datatype::UInt16, 1));
        }
        Ok(())
    }

    /// The scan as a message of a time in nanoseconds since 1970 and a coordinate frame.
    ///
    /// # Errors
    /// [`FrameError::MissingField`] without x, y and z.
    pub fn message(&self, stamp_ns: u64, frame_id: &str) -> Result<CloudMessage<'_>> {
        let (stamp_sec, stamp_nanosec) = stamp(stamp_ns);
        let mut message = CloudMessage {
            stamp_sec: stamp_sec.into(),
            stamp_nanosec,
            frame_id: frame_id.to_owned(),
            height: self.height,
            width: self.width,
            fields: self.fields.clone(),
            is_bigendian: self.is_bigendian,
            point_step: self.point_step,
            row_step: self.point_step * self.width,
            data: Cow::Borrowed(&self.data),
            is_dense: true,
            ..CloudMessage::default()
        };
        let cloud = message.to_cloud(None)?;
        let columns = [&cloud.x, &cloud.y, &cloud.z];
        message.is_dense = columns.iter().all(|column| column.iter().all(|x| x.is_finite()));
        Ok(message)
    }

    /// Names and types of the fields, as in `x f4, ring u2`.
    pub fn layout(&self) -> String {
        let fields = self.fields.iter().map(|field| {
            let count =
                if field.count == 1 { String::new() } else { format!(" x {}", field.count) };
            format!("{} {}{count}", field.name, short(field.datatype))
        });
        fields.collect::<Vec<_>>().join(", ")
    }

    fn has(&self, name: &str) -> bool {
        self.fields.iter().any(|field| field.name == name)
    }

    fn order(&self) -> ByteOrder {
        if self.is_bigendian { ByteOrder::Big } else { ByteOrder::Little }
    }

    /// Checks what every format requires: x, y and z, and no name twice.
    pub(super) fn checked(self) -> Parsed<Self> {
        for name in ["x", "y", "z"] {
            if !self.has(name) {
                return Err(format!("no field `{name}`; there is: {}", self.layout()));
            }
        }
        for (number, field) in self.fields.iter().enumerate() {
            if self.fields[..number].iter().any(|other| other.name == field.name) {
                return Err(format!("two fields `{}`", field.name));
            }
        }
        let bytes = u64::from(self.point_step) * u64::from(self.height) * u64::from(self.width);
        debug_assert_eq!(bytes, self.data.len() as u64);
        Ok(self)
    }
}

/// Most bytes that a message can hold.
const MOST: u64 = u32::MAX as u64;

fn too_long(points: u64, step: u32, more: u32) -> String {
    format!(
        "{points} points of {} bytes are more than a message can hold",
        u64::from(step) + u64::from(more)
    )
}

/// Height and width as a message has them, for points of so many bytes; the whole must fit into one
/// message.
pub(super) fn shape(height: u64, width: u64, step: u32) -> Parsed<[u32; 2]> {
    let bytes = height.checked_mul(width).and_then(|points| points.checked_mul(step.into()));
    match (u32::try_from(height), u32::try_from(width), bytes) {
        (Ok(height), Ok(width), Some(0..=MOST)) => Ok([height, width]),
        _ => Err(format!(
            "{height} x {width} points of {step} bytes are more than a message can hold"
        )),
    }
}

pub(super) fn field(name: &str, offset: u32, datatype: Datatype, count: u32) -> PointField {
    PointField { name: name.to_owned(), offset, datatype, count }
}

/// A type in numpy's letters.
fn short(datatype: Datatype) -> &'static str {
    match datatype {
        Datatype::Int8 => "i1",
        Datatype::UInt8 => "u1",
        Datatype::Int16 => "i2",
        Datatype::UInt16 => "u2",
        Datatype::Int32 => "i4",
        Datatype::UInt32 => "u4",
        Datatype::Float32 => "f4",
        Datatype::Float64 => "f8",
        Datatype::Unknown(_) => "?",
    }
}

/// The type of a kind (`f`, `i`, `u`) and a size in bytes, if a message has it.
pub(super) fn datatype(kind: char, size: u32) -> Option<Datatype> {
    match (kind, size) {
        ('i', 1) => Some(Datatype::Int8),
        ('u', 1) => Some(Datatype::UInt8),
        ('i', 2) => Some(Datatype::Int16),
        ('u', 2) => Some(Datatype::UInt16),
        ('i', 4) => Some(Datatype::Int32),
        ('u', 4) => Some(Datatype::UInt32),
        ('f', 4) => Some(Datatype::Float32),
        ('f', 8) => Some(Datatype::Float64),
        _ => None,
    }
}
