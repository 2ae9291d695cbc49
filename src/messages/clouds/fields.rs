//! The columns of a cloud in a message, and where its points are in its frame.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Most columns that a message may declare. No sensor has a thousandth of it; a message that
/// declares millions is broken, and would cost more memory than it has bytes.
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
    /// A code that the format does not define. Such a field is kept but cannot be read.
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

    /// The type of a code in a format's list of types, whose first has code 1.
    pub(super) fn of_code(types: &[Datatype; 8], code: i32) -> Self {
        let place = usize::try_from(i64::from(code) - 1).ok();
        place.and_then(|place| types.get(place)).copied().unwrap_or(Datatype::Unknown(code))
    }

    /// The code in a format's list of types.
    pub(super) fn code_in(self, types: &[Datatype; 8]) -> i32 {
        match self {
            Datatype::Unknown(code) => code,
            known => types.iter().position(|&other| other == known).map_or(0, |at| at as i32 + 1),
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

/// Pose of a cloud's points in its coordinate frame, with the message's own numbers.
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
    /// Takes the points to the cloud's coordinate frame. A quaternion of length zero, which is what
    /// a message without one has in protobuf, does not rotate; nor does one that is not finite.
    pub fn isometry(&self) -> Isometry3<f64> {
        let [i, j, k, w] = self.orientation;
        let rotation = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), f64::MIN_POSITIVE)
            .filter(|rotation| rotation.coords.iter().all(|value| value.is_finite()))
            .unwrap_or_default();
        let [x, y, z] = self.position.map(|value| if value.is_finite() { value } else { 0.0 });
        Isometry3::from_parts(Translation3::new(x, y, z), rotation)
    }
}
