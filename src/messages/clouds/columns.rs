//! The numbers of a cloud's columns: as a [`PointCloud`], or one column by its name.

use super::fields::{Datatype, PointField};
use super::message::CloudMessage;
use crate::error::frame::{FrameError, Result};
use divmerge_core::cloud::{PointClasses, PointCloud, PointColumns};

/// Fields that say which sensor measured a point of a merged cloud, as drivers and mergers name
/// them.
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

impl CloudMessage<'_> {
    /// Name of the first of `label`, `semantic`, `class_id` and `class_ids` that the cloud has as
    /// integers.
    pub fn semantic_field(&self) -> Option<&str> {
        ["label", "semantic", "class_id", "class_ids"]
            .into_iter()
            .find(|name| self.field(name).is_some_and(|f| f.datatype.is_integer()))
    }

    /// The points as a cloud: `x`, `y`, `z` of any type, the beam number from `ring`, or else
    /// `channel` or Livox's `line`, if there, and the class from `class_field` if given, with its
    /// confidence from a field `probability`.
    ///
    /// Positions that are fill values are NaN ([`PointCloud::without_fill_values`]).
    ///
    /// Classes above 65535 are words as in SemanticKITTI, of which the low 16 bits are the class.
    /// A beam number that does not fit 16 bits makes the beam numbers absent.
    ///
    /// # Errors
    /// [`FrameError::MissingField`] without one of them, [`FrameError::Malformed`] if one does not
    /// fit into a point. A message of no points is an empty cloud whatever fields it has.
    pub fn to_cloud(&self, class_field: Option<&str>) -> Result<PointCloud> {
        let mut columns = PointColumns {
            height: self.height as usize,
            width: self.width as usize,
            ..PointColumns::default()
        };
        if self.point_count() > 0 {
            ([columns.x, columns.y, columns.z], columns.offset) = self.coordinates()?;
            columns.ring = self.ring()?;
            columns.source = self.source()?;
        }
        let cloud = columns.checked()?.without_fill_values();
        match class_field {
            Some(name) => Ok(cloud.with_classes(self.classes(name)?)?),
            None => Ok(cloud),
        }
    }

    /// The class of each point from a field, with its confidence from a field `probability`.
    ///
    /// # Errors
    /// Those of [`to_cloud`](Self::to_cloud).
    pub fn classes(&self, name: &str) -> Result<PointClasses> {
        let class = self.class(name)?;
        let confidence = if class.is_empty() { None } else { self.probability()? };
        Ok(PointClasses { class, confidence, entropy: None })
    }

    /// How much of the light came back to each point, as the driver gives it: the first of the
    /// fields `intensity`, `remission` and `reflectivity`; what is no finite number is 0. `None` of
    /// a cloud without such a field.
    ///
    /// # Errors
    /// [`FrameError::Malformed`] if the field does not fit into a point.
    pub fn remission(&self) -> Result<Option<Vec<f32>>> {
        let mut names = ["intensity", "remission", "reflectivity"].into_iter();
        let Some(field) = names.find_map(|name| self.field(name)) else {
            return Ok(None);
        };
        let finite = |number: f64| if number.is_finite() { number as f32 } else { 0.0 };
        Ok(Some(self.column(&field.name, finite)?))
    }

    /// Confidence of each class: a float field `probability`, as Autoware writes it beside
    /// `class_id`.
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
    /// [`FrameError::MissingField`], or [`FrameError::Malformed`] if it does not fit into a point.
    pub fn column_f64(&self, name: &str) -> Result<Vec<f64>> {
        self.column(name, |number| number)
    }

    /// A field's values as integers; floats are rounded, not-a-number is 0.
    ///
    /// # Errors
    /// [`FrameError::MissingField`], or [`FrameError::Malformed`] if it does not fit into a point.
    pub fn column_i64(&self, name: &str) -> Result<Vec<i64>> {
        // No integer type of the message has more than 32 bits, so f64 holds each exactly.
        self.column(name, |number| number.round() as i64)
    }

    /// A field's values as `u32`; floats are rounded, what is out of range wraps.
    ///
    /// # Errors
    /// [`FrameError::MissingField`], or [`FrameError::Malformed`] if it does not fit into a point.
    pub fn column_u32(&self, name: &str) -> Result<Vec<u32>> {
        self.column(name, |number| number.round() as i64 as u32)
    }

    /// x, y and z, and what was subtracted from them.
    fn coordinates(&self) -> Result<([Vec<f32>; 3], [f64; 3])> {
        let [x, y, z] = ["x", "y", "z"].map(|name| self.readable(name));
        let fields = [x?, y?, z?];
        let plain = |field: &&PointField| field.datatype == Datatype::Float32;
        if self.is_bigendian || !fields.iter().all(plain) {
            let [x, y, z] = ["x", "y", "z"].map(|name| self.column_f64(name));
            return Ok(near_origin([x?, y?, z?]));
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
        Ok((columns, [0.0; 3]))
    }

    fn ring(&self) -> Result<Option<Vec<u16>>> {
        let mut names = ["ring", "channel", "line"].into_iter();
        let Some(name) = names.find(|name| self.field(name).is_some()) else {
            return Ok(None);
        };
        let ring = self.column(name, |number| u16::try_from(number.round() as i64).ok())?;
        Ok(ring.into_iter().collect())
    }

    /// The sensor that measured each point, if a field names more than one.
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
        let field = self.field(name).ok_or_else(|| FrameError::MissingField {
            name: name.to_owned(),
            present: self
                .fields
                .iter()
                .map(|field| field.name.as_str())
                .collect::<Vec<_>>()
                .join(", "),
        })?;
        if let Datatype::Unknown(code) = field.datatype {
            return Err(self.malformed(format!("field `{name}` has the unknown datatype {code}")));
        }
        let size = field.datatype.size() as u64;
        if u64::from(field.offset) + size > u64::from(self.point_step) {
            return Err(self.malformed(format!(
                "field `{name}` of {size} bytes at offset {} does not fit into a point of {} bytes",
                field.offset, self.point_step
            )));
        }
        Ok(field)
    }
}

/// Coordinates in single precision, less an offset of whole units where the cloud lies farther from
/// the origin than several times its own size, as in a frame of the Earth. Points at the origin
/// stay there: they are no returns.
fn near_origin([x, y, z]: [Vec<f64>; 3]) -> ([Vec<f32>; 3], [f64; 3]) {
    /// A sensor sees its surroundings, so that in its own frame this is below 1.
    const TIMES: f64 = 4.0;
    /// From there on single precision is coarser than 2 mm, if the unit is the metre.
    const COARSE: f64 = 20_000.0;
    let is_nothing = |point: usize| x[point] == 0.0 && y[point] == 0.0 && z[point] == 0.0;
    let limits = [&x, &y, &z].map(|column| {
        let found = column
            .iter()
            .enumerate()
            .filter(|(point, along)| along.is_finite() && !is_nothing(*point));
        found.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], (_, &along)| {
            [least.min(along), most.max(along)]
        })
    });
    let size = limits.map(|[least, most]| most - least).into_iter().fold(0.0, f64::max);
    let middle = limits.map(|[least, most]| ((least + most) / 2.0).round());
    let is_far = middle.iter().any(|along| along.abs() > (TIMES * size).max(COARSE));
    let offset = if is_far { middle } else { [0.0; 3] };
    let column = |column: &[f64], offset: f64| {
        let near = |(point, &along): (usize, &f64)| match is_nothing(point) {
            true => 0.0,
            false => (along - offset) as f32,
        };
        column.iter().enumerate().map(near).collect()
    };
    ([column(&x, offset[0]), column(&y, offset[1]), column(&z, offset[2])], offset)
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
