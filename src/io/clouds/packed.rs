//! A cloud as a message of any format has it: points packed in bytes, and what says how to read them.

use std::borrow::Cow;
use std::collections::BTreeSet;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::CloudFormat;
use crate::cloud::{PointClasses, PointCloud};
use crate::error::{Error, Result};
use crate::io::ros::ByteOrder;

/// Most columns that a message may declare. No sensor has a thousandth of it; a message that declares millions is
/// broken, and would cost more memory than it has bytes.
pub(super) const MOST_FIELDS: usize = 1 << 16;

/// Type of a field's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Datatype {
    /// Signed, 8 bits.
    Int8,
    /// Unsigned, 8 bits.
    UInt8,
    /// Signed, 16 bits.
    Int16,
    /// Unsigned, 16 bits.
    UInt16,
    /// Signed, 32 bits.
    Int32,
    /// Unsigned, 32 bits.
    UInt32,
    /// IEEE 754, 32 bits.
    Float32,
    /// IEEE 754, 64 bits.
    Float64,
    /// A code that the format does not name. Such a field is kept but cannot be read.
    Unknown(i32),
}

impl Datatype {
    /// Bytes of one value; 0 if unknown.
    pub fn size(self) -> usize {
        match self {
            Datatype::Int8 | Datatype::UInt8 => 1,
            Datatype::Int16 | Datatype::UInt16 => 2,
            Datatype::Int32 | Datatype::UInt32 | Datatype::Float32 => 4,
            Datatype::Float64 => 8,
            Datatype::Unknown(_) => 0,
        }
    }

    fn unknown_code(self) -> i32 {
        match self {
            Datatype::Unknown(code) => code,
            _ => 0,
        }
    }

    /// Whether the values are integers.
    pub fn is_integer(self) -> bool {
        !matches!(self, Datatype::Float32 | Datatype::Float64 | Datatype::Unknown(_))
    }
}

/// One column of a cloud's data.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PointField {
    /// Name, such as `x`.
    pub name: String,
    /// Bytes from the start of a point.
    pub offset: u32,
    /// Type of the values.
    pub datatype: Datatype,
    /// Values per point. Only the first of several is ever read here.
    pub count: u32,
}

/// Where a cloud's points are in its coordinate frame: numbers as the message has them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudPose {
    /// x, y, z, metres.
    pub position: [f64; 3],
    /// Quaternion x, y, z, w.
    pub orientation: [f64; 4],
}

impl Default for CloudPose {
    fn default() -> Self {
        CloudPose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] }
    }
}

impl CloudPose {
    /// Takes the points to the cloud's coordinate frame. A quaternion of length zero, which is what a message without
    /// one has in protobuf, does not rotate; nor does one that is not finite.
    pub fn isometry(&self) -> Isometry3<f64> {
        let [i, j, k, w] = self.orientation;
        let rotation = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), f64::MIN_POSITIVE)
            .filter(|rotation| rotation.coords.iter().all(|value| value.is_finite()))
            .unwrap_or_default();
        let [x, y, z] = self.position.map(|value| if value.is_finite() { value } else { 0.0 });
        Isometry3::from_parts(Translation3::new(x, y, z), rotation)
    }
}

/// A cloud as it lies in a message. [`CloudFormat::decode`] has checked that the sizes agree.
#[derive(Debug, Clone, PartialEq)]
pub struct PackedCloud<'a> {
    /// Format of the message.
    pub format: CloudFormat,
    /// Order of the bytes of the message's own numbers, where its format leaves that open: CDR (the numbers in `data`
    /// have an order of their own).
    pub byte_order: ByteOrder,
    /// Whole seconds of the stamp.
    pub stamp_sec: i64,
    /// Nanoseconds of the stamp beyond the seconds.
    pub stamp_nanosec: u32,
    /// Coordinate frame.
    pub frame_id: String,
    /// Where the points are in `frame_id`, if the message says so. Clustering sees the points as they are; what is
    /// said in `frame_id`, as boxes are, has to take it into account.
    pub pose: Option<CloudPose>,
    /// Rows; 1 if unorganised.
    pub height: u32,
    /// Points per row.
    pub width: u32,
    /// Columns.
    pub fields: Vec<PointField>,
    /// Whether the numbers in `data` are big endian.
    pub is_bigendian: bool,
    /// Bytes from point to point.
    pub point_step: u32,
    /// Bytes from row to row as declared; see [`PackedCloud::row_stride`].
    pub row_step: u32,
    /// The points.
    pub data: Cow<'a, [u8]>,
    /// Whether the writer says that every point is finite.
    pub is_dense: bool,
}

/// Fields that say which sensor measured a point of a merged cloud, as drivers and mergers name them.
const SOURCE_FIELDS: [&str; 11] = [
    "source",
    "source_id",
    "sensor",
    "sensor_id",
    "sensor_index",
    "lidar",
    "lidar_id",
    "lidar_index",
    "device",
    "device_id",
    "scanner_id",
];

impl Default for PackedCloud<'_> {
    fn default() -> Self {
        PackedCloud {
            format: CloudFormat::Ros2,
            byte_order: ByteOrder::Little,
            stamp_sec: 0,
            stamp_nanosec: 0,
            frame_id: String::new(),
            pose: None,
            height: 1,
            width: 0,
            fields: Vec::new(),
            is_bigendian: false,
            point_step: 0,
            row_step: 0,
            data: Cow::Borrowed(&[]),
            is_dense: false,
        }
    }
}

impl PackedCloud<'_> {
    /// Number of points.
    pub fn point_count(&self) -> usize {
        self.height as usize * self.width as usize
    }

    /// Stamp in nanoseconds; what does not fit is cut off at the ends of the range.
    pub fn stamp_ns(&self) -> i64 {
        stamp_ns(self.stamp_sec, self.stamp_nanosec)
    }

    /// Byte order of the numbers in `data`.
    pub fn data_order(&self) -> ByteOrder {
        if self.is_bigendian { ByteOrder::Big } else { ByteOrder::Little }
    }

    /// Bytes from row to row as the data has them: packed if the data is exactly that long, whatever
    /// `row_step` says.
    pub fn row_stride(&self) -> usize {
        let packed = self.width as usize * self.point_step as usize;
        if self.data.len() == packed * self.height as usize {
            packed
        } else {
            self.row_step as usize
        }
    }

    /// The bytes of each point, row by row.
    pub fn points(&self) -> impl Iterator<Item = &[u8]> {
        let step = (self.point_step as usize).max(1);
        self.rows().flat_map(move |row| row.chunks_exact(step))
    }

    /// The bytes of each row's points, without what is behind them.
    pub(in crate::io) fn rows(&self) -> impl Iterator<Item = &[u8]> {
        let packed = self.width as usize * self.point_step as usize;
        self.data.chunks_exact(self.row_stride().max(1)).map(move |row| &row[..packed])
    }

    /// Where the points are in `frame_id`: takes their coordinates there.
    pub fn isometry(&self) -> Isometry3<f64> {
        self.pose.map_or_else(Isometry3::identity, |pose| pose.isometry())
    }

    /// A name that several fields have; of them the first is read.
    pub fn repeated_field(&self) -> Option<&str> {
        let mut seen = BTreeSet::new();
        self.fields.iter().map(|field| field.name.as_str()).find(|name| !seen.insert(*name))
    }

    /// The field of a name; of several the first.
    pub fn field(&self, name: &str) -> Option<&PointField> {
        self.fields.iter().find(|field| field.name == name)
    }

    /// Name of the first of `label`, `semantic`, `class_id` and `class_ids` that the cloud has as
    /// integers.
    pub fn semantic_field(&self) -> Option<&str> {
        ["label", "semantic", "class_id", "class_ids"]
            .into_iter()
            .find(|name| self.field(name).is_some_and(|f| f.datatype.is_integer()))
    }

    /// The points as a cloud: `x`, `y`, `z` of any type, the beam number from `ring` or else
    /// `channel` if there, and the class from `class_field` if given, with its confidence from a field `probability`.
    ///
    /// Classes above 65535 are words as in SemanticKITTI, of which the low 16 bits are the class.
    /// A beam number that does not fit 16 bits makes the beam numbers absent.
    ///
    /// # Errors
    /// [`Error::MissingField`] without one of them, [`Error::Malformed`] if one does not fit into a
    /// point. A message of no points is an empty cloud whatever fields it has.
    pub fn to_cloud(&self, class_field: Option<&str>) -> Result<PointCloud> {
        let mut cloud = PointCloud {
            height: self.height as usize,
            width: self.width as usize,
            ..PointCloud::default()
        };
        if self.point_count() > 0 {
            [cloud.x, cloud.y, cloud.z] = self.coordinates()?;
            cloud.ring = self.ring()?;
            cloud.source = self.source()?;
        }
        cloud.check()?;
        match class_field {
            Some(name) => Ok(cloud.with_classes(self.classes(name)?)?),
            None => Ok(cloud),
        }
    }

    /// The class of each point from a field, and how sure it is from a field `probability`.
    ///
    /// # Errors
    /// Those of [`to_cloud`](Self::to_cloud).
    pub fn classes(&self, name: &str) -> Result<PointClasses> {
        let class = self.class(name)?;
        let confidence = if class.is_empty() { None } else { self.probability()? };
        Ok(PointClasses { class, confidence, entropy: None })
    }

    /// How much of the light came back to each point, as the driver gives it: the first of the fields `intensity`,
    /// `remission` and `reflectivity`; what is no finite number is 0. `None` of a cloud without such a field.
    ///
    /// # Errors
    /// [`Error::Malformed`] if the field does not fit into a point.
    pub fn remission(&self) -> Result<Option<Vec<f32>>> {
        let mut names = ["intensity", "remission", "reflectivity"].into_iter();
        let Some(field) = names.find_map(|name| self.field(name)) else {
            return Ok(None);
        };
        let finite = |number: f64| if number.is_finite() { number as f32 } else { 0.0 };
        Ok(Some(self.column(&field.name, finite)?))
    }

    /// How sure each class is: a field `probability` of floats, as Autoware writes it beside `class_id`.
    fn probability(&self) -> Result<Option<Vec<f32>>> {
        let is_float =
            |field: &&PointField| matches!(field.datatype, Datatype::Float32 | Datatype::Float64);
        match self.field("probability").filter(is_float) {
            // NaN is not sure at all.
            Some(field) => {
                self.column(&field.name, |p| p.clamp(0.0, 1.0).max(0.0) as f32).map(Some)
            }
            None => Ok(None),
        }
    }

    /// A field's values as `f64`.
    ///
    /// # Errors
    /// [`Error::MissingField`], or [`Error::Malformed`] if it does not fit into a point.
    pub fn column_f64(&self, name: &str) -> Result<Vec<f64>> {
        self.column(name, |number| number)
    }

    /// A field's values as integers; floats are rounded, not-a-number is 0.
    ///
    /// # Errors
    /// [`Error::MissingField`], or [`Error::Malformed`] if it does not fit into a point.
    pub fn column_i64(&self, name: &str) -> Result<Vec<i64>> {
        // No integer type of the message has more than 32 bits, so f64 holds each exactly.
        self.column(name, |number| number.round() as i64)
    }

    /// A field's values as `u32`; floats are rounded, what is out of range wraps.
    ///
    /// # Errors
    /// [`Error::MissingField`], or [`Error::Malformed`] if it does not fit into a point.
    pub fn column_u32(&self, name: &str) -> Result<Vec<u32>> {
        self.column(name, |number| number.round() as i64 as u32)
    }

    fn coordinates(&self) -> Result<[Vec<f32>; 3]> {
        let [x, y, z] = ["x", "y", "z"].map(|name| self.readable(name));
        let fields = [x?, y?, z?];
        let plain = |field: &&PointField| field.datatype == Datatype::Float32;
        if self.is_bigendian || !fields.iter().all(plain) {
            let [x, y, z] = ["x", "y", "z"].map(|name| self.column(name, |n| n as f32));
            return Ok([x?, y?, z?]);
        }
        let [i, j, k] = fields.map(|field| field.offset as usize);
        let (step, width) = (self.point_step as usize, self.width as usize);
        let mut columns = [(); 3].map(|()| vec![0.0; self.point_count()]);
        let [x, y, z] = columns.each_mut().map(|column| column.chunks_exact_mut(width));
        for (row, ((x, y), z)) in self.rows().zip(x.zip(y).zip(z)) {
            let places = x.iter_mut().zip(y).zip(z);
            for (point, ((x, y), z)) in row.chunks_exact(step).zip(places) {
                (*x, *y, *z) = (f32_le(point, i), f32_le(point, j), f32_le(point, k));
            }
        }
        Ok(columns)
    }

    fn ring(&self) -> Result<Option<Vec<u16>>> {
        let Some(name) = ["ring", "channel"].into_iter().find(|name| self.field(name).is_some())
        else {
            return Ok(None);
        };
        let ring = self.column(name, |number| u16::try_from(number.round() as i64).ok())?;
        Ok(ring.into_iter().collect())
    }

    /// The sensor of each point, where a field tells and tells more than one apart.
    fn source(&self) -> Result<Option<Vec<u16>>> {
        let is_told =
            |name: &&str| self.field(name).is_some_and(|field| field.datatype.is_integer());
        let Some(name) = SOURCE_FIELDS.into_iter().find(is_told) else {
            return Ok(None);
        };
        let source = self.column(name, |number| u16::try_from(number as i64).ok())?;
        let source: Option<Vec<u16>> = source.into_iter().collect();
        Ok(source.filter(|source| source.windows(2).any(|pair| pair[0] != pair[1])))
    }

    fn class(&self, name: &str) -> Result<Vec<u16>> {
        if self.point_count() == 0 {
            return Ok(Vec::new());
        }
        let field = self.readable(name)?;
        // Integers need no rounding.
        match (self.is_bigendian, field.datatype) {
            (false, Datatype::UInt16) => Ok(self.gather(field, u16::from_le_bytes)),
            (false, Datatype::UInt32) => Ok(self.gather(field, |b| u32::from_le_bytes(b) as u16)),
            _ => self.column(name, |number| number.round() as i64 as u16),
        }
    }

    /// A readable field's bytes at every point, converted.
    fn gather<const N: usize, T>(
        &self,
        field: &PointField,
        convert: impl Fn([u8; N]) -> T,
    ) -> Vec<T> {
        let (step, at) = ((self.point_step as usize).max(1), field.offset as usize);
        let mut column = Vec::with_capacity(self.point_count());
        for row in self.rows() {
            column.extend(row.chunks_exact(step).map(|point| convert(take(point, at))));
        }
        column
    }

    fn column<T>(&self, name: &str, convert: impl Fn(f64) -> T) -> Result<Vec<T>> {
        let field = self.readable(name)?;
        let (order, at) = (self.data_order(), field.offset as usize);
        let step = (self.point_step as usize).max(1);
        let mut column = Vec::with_capacity(self.point_count());
        macro_rules! read {
            ($get:ident) => {
                for row in self.rows() {
                    let numbers = row.chunks_exact(step).map(|point| order.$get(take(point, at)));
                    column.extend(numbers.map(|number| convert(number.into())));
                }
            };
        }
        match field.datatype {
            Datatype::Int8 => read!(get_i8),
            Datatype::UInt8 => read!(get_u8),
            Datatype::Int16 => read!(get_i16),
            Datatype::UInt16 => read!(get_u16),
            Datatype::Int32 => read!(get_i32),
            Datatype::UInt32 => read!(get_u32),
            Datatype::Float32 => read!(get_f32),
            Datatype::Float64 => read!(get_f64),
            Datatype::Unknown(_) => {}
        }
        Ok(column)
    }

    /// The field of a name, if its values can be read from every point.
    fn readable(&self, name: &str) -> Result<&PointField> {
        let field = self.field(name).ok_or_else(|| Error::MissingField {
            name: name.to_owned(),
            present: self
                .fields
                .iter()
                .map(|field| field.name.as_str())
                .collect::<Vec<_>>()
                .join(", "),
        })?;
        let size = field.datatype.size() as u64;
        if size == 0 {
            return Err(self.malformed(format!(
                "field `{name}` has the unknown datatype {}",
                field.datatype.unknown_code()
            )));
        }
        if u64::from(field.offset) + size > u64::from(self.point_step) {
            return Err(self.malformed(format!(
                "field `{name}` of {size} bytes at offset {} does not fit into a point of {} bytes",
                field.offset, self.point_step
            )));
        }
        Ok(field)
    }

    /// An error about this message.
    pub(in crate::io) fn malformed(&self, problem: String) -> Error {
        Error::Malformed { message: self.format.type_name(), problem }
    }

    /// Checks that height, width, both steps and the data's length agree.
    pub(super) fn check(&self) -> Result<()> {
        let [height, width, point_step, row_step] =
            [self.height, self.width, self.point_step, self.row_step].map(u128::from);
        let length = self.data.len() as u128;
        let shape = format!(
            "{height} x {width} points of {point_step} bytes in rows of {row_step} bytes, {length} \
             bytes of data"
        );
        if point_step == 0 && height * width > 0 {
            return Err(self.malformed(format!("points without bytes: {shape}")));
        }
        if length == height * width * point_step {
            return Ok(());
        }
        if row_step < width * point_step {
            return Err(self.malformed(format!("rows shorter than their points: {shape}")));
        }
        if length != height * row_step {
            return Err(self.malformed(format!("the data is not as long as its rows: {shape}")));
        }
        Ok(())
    }
}

/// Seconds and nanoseconds as nanoseconds; what does not fit is cut off at the ends of the range.
pub(super) fn stamp_ns(sec: i64, nanosec: u32) -> i64 {
    sec.saturating_mul(1_000_000_000).saturating_add(i64::from(nanosec))
}

#[inline]
fn take<const N: usize>(point: &[u8], at: usize) -> [u8; N] {
    let mut bytes = [0; N];
    bytes.copy_from_slice(&point[at..at + N]);
    bytes
}

#[inline]
fn f32_le(point: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(take(point, at))
}

#[cfg(test)]
pub(in crate::io) mod tests {
    use super::*;

    pub(in crate::io) fn field(name: &str, offset: u32, datatype: Datatype) -> PointField {
        PointField { name: name.to_owned(), offset, datatype, count: 1 }
    }

    /// A cloud of one row of points of the given bytes.
    pub(in crate::io) fn cloud<'a>(
        fields: Vec<PointField>,
        point_step: u32,
        data: &'a [u8],
    ) -> PackedCloud<'a> {
        PackedCloud {
            stamp_sec: 1_700_000_000,
            stamp_nanosec: 5,
            frame_id: "lidar".to_owned(),
            height: 1,
            width: data.len() as u32 / point_step,
            fields,
            is_bigendian: false,
            point_step,
            row_step: data.len() as u32,
            data: Cow::Borrowed(data),
            is_dense: true,
            ..PackedCloud::default()
        }
    }

    pub(in crate::io) fn xyz() -> Vec<PointField> {
        ["x", "y", "z"]
            .into_iter()
            .zip([0, 4, 8])
            .map(|(name, offset)| field(name, offset, Datatype::Float32))
            .collect()
    }

    fn encoded(cloud: &PackedCloud) -> Vec<u8> {
        let mut cdr = Vec::new();
        cloud.encode(&mut cdr).unwrap();
        cdr
    }

    fn problem(cloud: &PackedCloud) -> String {
        cloud.check().unwrap_err().to_string()
    }

    #[test]
    fn known_bytes() {
        let data = [1.0_f32, 2.0, 3.0].map(f32::to_le_bytes).concat();
        let mut cloud = cloud(vec![field("x", 0, Datatype::Float32)], 12, &data);
        cloud.frame_id = "ab".to_owned();
        let expected = [
            [0, 1, 0, 0].as_slice(),
            &1_700_000_000_i32.to_le_bytes(),
            &[5, 0, 0, 0, 3, 0, 0, 0, b'a', b'b', 0, 0],
            &[1, 0, 0, 0, 1, 0, 0, 0], // height, width
            &[1, 0, 0, 0, 2, 0, 0, 0, b'x', 0, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0],
            &[0, 0, 0, 0, 12, 0, 0, 0, 12, 0, 0, 0, 12, 0, 0, 0],
            &data,
            &[1],
        ]
        .concat();
        assert_eq!(encoded(&cloud), expected);
        assert_eq!(CloudFormat::Ros2.decode(&expected).unwrap(), cloud);
        assert_eq!(cloud.stamp_ns(), 1_700_000_000_000_000_005);
    }

    #[test]
    fn every_datatype_in_both_orders_of_message_and_data() {
        use Datatype::*;
        let types = [Int8, UInt8, Int16, UInt16, Int32, UInt32, Float32, Float64];
        for (message, data) in [ByteOrder::Little, ByteOrder::Big]
            .into_iter()
            .flat_map(|m| [ByteOrder::Little, ByteOrder::Big].map(|d| (m, d)))
        {
            // Unaligned on purpose: one byte in front, none between.
            let (mut fields, mut point) = (Vec::new(), vec![0xee]);
            for datatype in types {
                let offset = point.len() as u32;
                fields.push(field(&format!("{datatype:?}"), offset, datatype));
                match datatype {
                    Int8 => point.extend(data.put_i8(-7)),
                    UInt8 => point.extend(data.put_u8(200)),
                    Int16 => point.extend(data.put_i16(-300)),
                    UInt16 => point.extend(data.put_u16(60_000)),
                    Int32 => point.extend(data.put_i32(-70_000)),
                    UInt32 => point.extend(data.put_u32(4_000_000_000)),
                    Float32 => point.extend(data.put_f32(-1.5)),
                    _ => point.extend(data.put_f64(0.1)),
                }
            }
            point.push(0xee);
            let bytes = [point.as_slice(), &point].concat();
            let mut cloud = cloud(fields, point.len() as u32, &bytes);
            cloud.byte_order = message;
            cloud.is_bigendian = data == ByteOrder::Big;
            let cdr = encoded(&cloud);
            let parsed = CloudFormat::Ros2.decode(&cdr).unwrap();
            assert_eq!(parsed, cloud);
            let expected = [-7.0, 200.0, -300.0, 6e4, -7e4, 4e9, -1.5, 0.1];
            for (datatype, value) in types.into_iter().zip(expected) {
                let column = parsed.column_f64(&format!("{datatype:?}")).unwrap();
                assert_eq!(column, [value; 2]);
            }
            assert_eq!(parsed.column_u32("UInt32").unwrap(), [4_000_000_000; 2]);
            assert_eq!(parsed.column_i64("Float32").unwrap(), [-2; 2]);
        }
    }

    #[test]
    fn coordinates_of_any_type_order_and_place() {
        let place = |x: f64, y: i16, z: f32| {
            let z = z.to_be_bytes();
            [[9].as_slice(), &z, &y.to_be_bytes(), &[9, 9, 9], &x.to_be_bytes()].concat()
        };
        let data = [place(1.25, -2, 3.5), place(-4.0, 5, 6.0)].concat();
        let fields = vec![
            field("z", 1, Datatype::Float32),
            field("y", 5, Datatype::Int16),
            field("x", 10, Datatype::Float64),
        ];
        let mut cloud = cloud(fields, 18, &data);
        cloud.is_bigendian = true;
        let points = cloud.to_cloud(None).unwrap();
        assert_eq!(points.x, [1.25, -4.0]);
        assert_eq!(points.y, [-2.0, 5.0]);
        assert_eq!(points.z, [3.5, 6.0]);
        assert_eq!((points.height, points.width), (1, 2));
    }

    /// 2 rows of 3 points of 13 bytes, and 5 bytes behind each row.
    fn padded_rows() -> Vec<u8> {
        let mut data = Vec::new();
        for row in 0..2_u8 {
            for column in 0..3_u8 {
                for value in [f32::from(row), f32::from(column), 1.0] {
                    data.extend(value.to_le_bytes());
                }
                data.push(row * 3 + column);
            }
            data.extend([0xee; 5]);
        }
        data
    }

    #[test]
    fn organised_with_padded_rows() {
        let data = padded_rows();
        let mut fields = xyz();
        fields.push(field("ring", 12, Datatype::UInt8));
        let mut cloud = cloud(fields, 13, &data);
        (cloud.height, cloud.width, cloud.row_step) = (2, 3, 44);
        let cdr = encoded(&cloud);
        let points = CloudFormat::Ros2.decode(&cdr).unwrap().to_cloud(None).unwrap();
        assert!(points.is_organised());
        assert_eq!(points.x, [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        assert_eq!(points.y, [0.0, 1.0, 2.0, 0.0, 1.0, 2.0]);
        assert_eq!(points.ring, Some(vec![0, 1, 2, 3, 4, 5]));
    }

    #[test]
    fn packed_rows_whatever_the_row_step_says() {
        let data = vec![0; 2 * 3 * 12];
        for row_step in [0, 7, 36, 1000, u32::MAX] {
            let mut cloud = cloud(xyz(), 12, &data);
            (cloud.height, cloud.width, cloud.row_step) = (2, 3, row_step);
            let cdr = encoded(&cloud);
            let parsed = CloudFormat::Ros2.decode(&cdr).unwrap();
            assert_eq!(parsed.row_stride(), 36);
            assert_eq!(parsed.to_cloud(None).unwrap().len(), 6);
        }
    }

    #[test]
    fn sizes_that_lie_are_told_with_their_numbers() {
        let data = padded_rows();
        let honest = PackedCloud { height: 2, width: 3, row_step: 44, ..cloud(xyz(), 13, &data) };
        assert!(honest.check().is_ok());
        let lies: [fn(&mut PackedCloud); 7] = [
            |cloud| cloud.height = 3,
            |cloud| cloud.width = 4,
            |cloud| cloud.width = u32::MAX,
            |cloud| (cloud.height, cloud.width, cloud.point_step) = (u32::MAX, u32::MAX, u32::MAX),
            |cloud| cloud.point_step = 0,
            |cloud| cloud.row_step = 38,
            |cloud| cloud.data.to_mut().truncate(1),
        ];
        for lie in lies {
            let mut cloud = honest.clone();
            lie(&mut cloud);
            let problem = problem(&cloud);
            assert!(problem.contains(&format!("{} bytes of data", cloud.data.len())), "{problem}");
            assert!(cloud.encode(&mut Vec::new()).is_err());
        }
        for offset in [2, 9, 10, u32::MAX] {
            let mut cloud = honest.clone();
            cloud.fields[2].offset = offset;
            assert_eq!(cloud.to_cloud(None).is_ok(), offset <= 9, "{offset}");
        }
    }

    #[test]
    fn no_points_are_fine() {
        for (height, width, row_step) in [(0, 0, 0), (1, 0, 0), (0, u32::MAX, 0), (1, 0, 16)] {
            for data in [&[][..], &[0; 16][..row_step as usize]] {
                let mut cloud = cloud(Vec::new(), 16, data);
                (cloud.height, cloud.width, cloud.row_step) = (height, width, row_step);
                let cdr = encoded(&cloud);
                let points =
                    CloudFormat::Ros2.decode(&cdr).unwrap().to_cloud(Some("label")).unwrap();
                assert!(points.is_empty());
                assert_eq!(points.class, Some(vec![]));
            }
        }
    }

    #[test]
    fn classes_are_the_low_bits_of_words() {
        let label = |value: u32| [[0; 12].as_slice(), &value.to_le_bytes()].concat();
        let data = [label(40), label(0x0012_00fc), label(65_535)].concat();
        let mut fields = xyz();
        fields.push(field("label", 12, Datatype::UInt32));
        let mut cloud = cloud(fields, 16, &data);
        assert_eq!(cloud.semantic_field(), Some("label"));
        let points = cloud.to_cloud(Some("label")).unwrap();
        assert_eq!(points.class, Some(vec![40, 252, 65_535]));
        assert!(matches!(
            cloud.to_cloud(Some("semantic")),
            Err(Error::MissingField { name, present }) if name == "semantic" && present == "x, y, z, label"
        ));
        let data = [[0; 12].as_slice(), &39.6_f32.to_le_bytes()].concat();
        (cloud.data, cloud.width) = (Cow::Borrowed(data.as_slice()), 1);
        cloud.fields[3].datatype = Datatype::Float32;
        assert_eq!(cloud.semantic_field(), None);
        assert_eq!(cloud.to_cloud(Some("label")).unwrap().class, Some(vec![40]));
    }

    #[test]
    fn beam_numbers_that_do_not_fit_are_absent() {
        let ring = |value: i32| [[0; 12].as_slice(), &value.to_le_bytes()].concat();
        for (second, expected) in [(63, Some(vec![3, 63])), (70_000, None), (-1, None)] {
            let data = [ring(3), ring(second)].concat();
            let mut fields = xyz();
            fields.push(field("channel", 12, Datatype::Int32));
            let points = cloud(fields, 16, &data).to_cloud(None).unwrap();
            assert_eq!(points.ring, expected);
        }
    }

    #[test]
    fn fields_of_unknown_type_are_kept_but_not_read() {
        let mut fields = xyz();
        fields.push(field("odd", 0, Datatype::Unknown(77)));
        let data = [0; 12];
        let cdr = encoded(&cloud(fields, 12, &data));
        let parsed = CloudFormat::Ros2.decode(&cdr).unwrap();
        assert_eq!(parsed.field("odd").unwrap().datatype, Datatype::Unknown(77));
        assert!(parsed.to_cloud(None).is_ok());
        assert!(matches!(parsed.column_f64("odd"), Err(Error::Malformed { .. })));
    }

    #[test]
    fn cut_messages_are_errors() {
        let data = padded_rows();
        let cdr = encoded(&cloud(xyz(), 1, &data));
        for length in 0..cdr.len() {
            assert!(CloudFormat::Ros2.decode(&cdr[..length]).is_err(), "{length}");
        }
    }

    proptest::proptest! {
        #[test]
        fn changed_bytes_never_panic(
            changes in proptest::collection::vec((0_usize..400, proptest::num::u8::ANY), 1..6)
        ) {
            let data = padded_rows();
            let mut fields = xyz();
            fields.push(field("ring", 12, Datatype::UInt8));
            let mut cloud = cloud(fields, 13, &data);
            (cloud.height, cloud.width, cloud.row_step) = (2, 3, 44);
            let mut cdr = encoded(&cloud);
            for (at, value) in changes {
                let at = at % cdr.len();
                cdr[at] = value;
            }
            if let Ok(cloud) = CloudFormat::Ros2.decode(&cdr) {
                let _ = cloud.to_cloud(Some("ring"));
            }
        }
    }
}
