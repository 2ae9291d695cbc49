//! Point clouds: columns of equal length, metres, sensor frame.

use std::ops::Deref;

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::length_unit::LengthUnit;
use crate::error::CloudError;

/// The columns of a cloud of N points of one sweep, in the sensor's own frame (x forward, y left, z
/// up for most drivers). Nothing is checked; [`checked`](Self::checked) makes a [`PointCloud`].
///
/// Columns all have length N. An organised cloud of `height` rows and `width` columns stores point
/// (row, column) at `row * width + column`; an unorganised one has `height == 1`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointColumns {
    /// x in metres, sensor frame.
    pub x: Vec<f32>,
    /// y in metres, sensor frame.
    pub y: Vec<f32>,
    /// z in metres, sensor frame.
    pub z: Vec<f32>,
    /// Beam number per point as the driver gives it (`ring` or `channel`), in either order.
    pub ring: Option<Vec<u16>>,
    /// Semantic class per point in the recording's own ids.
    pub class: Option<Vec<u16>>,
    /// How sure whoever gave the classes is of that of each point, 0 to 1. Without it all classes
    /// count alike.
    pub confidence: Option<Vec<f32>>,
    /// Entropy of the distribution over the classes at each point, as a share of the most that it
    /// can be: 0 where one class has all of it, 1 where all have the same.
    pub entropy: Option<Vec<f32>>,
    /// How much of the light came back, as the driver gives it (`intensity`); read only where a
    /// network asks for it.
    pub remission: Option<Vec<f32>>,
    /// Sensor per point of a cloud merged of several, as the recording numbers them.
    pub source: Option<Vec<u16>>,
    /// By what the points were turned from the recording's frame to one with z up; the identity
    /// unless [`turn`](PointCloud::turn) was called.
    pub turned: UnitQuaternion<f64>,
    /// What was subtracted from the recording's coordinates, in their unit, so that those of a
    /// place far off keep their precision.
    pub offset: [f64; 3],
    /// The unit of the recording's coordinates, which are metres here.
    pub unit: LengthUnit,
    /// Whether each point was left out on purpose ([`PointCloud::cropped`]), which then has no
    /// position and is no return.
    pub cropped: Option<Vec<bool>>,
    /// Whether z is known to point up: said by the user or by the recording's transforms. What lies
    /// above the sensor is then never the ground.
    pub is_z_up: bool,
    /// Where the sensor stands in this cloud's frame, metres, if the user says so.
    pub sensor_origin: Option<Vector3<f64>>,
    /// Where sensors stand in this cloud's frame by the recording's transforms, metres.
    pub recorded_sensors: Vec<Vector3<f64>>,
    /// Whether the frame is a vehicle's or a map's by its name, so that the sensor hardly stands at
    /// its origin.
    pub is_named_elsewhere: bool,
    /// Rows of an organised cloud, else 1.
    pub height: usize,
    /// Columns of an organised cloud, else N.
    pub width: usize,
}

/// A point cloud: [`PointColumns`] that were checked. They are read as fields of the cloud, and
/// cannot be changed so that they no longer fit together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointCloud {
    columns: PointColumns,
}

impl Deref for PointCloud {
    type Target = PointColumns;

    #[inline]
    fn deref(&self) -> &PointColumns {
        &self.columns
    }
}

/// Classes of N points, and how sure they are.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointClasses {
    /// N: the class in the recording's own ids.
    pub class: Vec<u16>,
    /// N: its probability, 0 to 1, where that is known.
    pub confidence: Option<Vec<f32>>,
    /// N: entropy over all classes as a share of the most that it can be, where that is known.
    pub entropy: Option<Vec<f32>>,
}

impl PointColumns {
    /// A cloud of these columns.
    ///
    /// # Errors
    /// [`CloudError::ColumnLength`] if they differ in length, [`CloudError::Shape`] if height and
    /// width do not multiply to the number of points.
    pub fn checked(self) -> Result<PointCloud, CloudError> {
        let expected = self.x.len();
        let columns = [
            ("y", Some(self.y.len())),
            ("z", Some(self.z.len())),
            ("ring", self.ring.as_ref().map(Vec::len)),
            ("class", self.class.as_ref().map(Vec::len)),
            ("confidence", self.confidence.as_ref().map(Vec::len)),
            ("entropy", self.entropy.as_ref().map(Vec::len)),
            ("remission", self.remission.as_ref().map(Vec::len)),
            ("source", self.source.as_ref().map(Vec::len)),
            ("cropped", self.cropped.as_ref().map(Vec::len)),
        ];
        for (column, found) in columns {
            if let Some(found) = found.filter(|&found| found != expected) {
                return Err(CloudError::ColumnLength { column, expected, found });
            }
        }
        let (height, width) = (self.height, self.width);
        if height.checked_mul(width) != Some(expected) {
            return Err(CloudError::Shape { height, width, points: expected });
        }
        Ok(PointCloud { columns: self })
    }
}

impl PointCloud {
    /// An unorganised cloud from coordinates in metres.
    ///
    /// # Errors
    /// [`CloudError::ColumnLength`] if the columns differ in length.
    pub fn new(x: Vec<f32>, y: Vec<f32>, z: Vec<f32>) -> Result<Self, CloudError> {
        PointColumns { height: 1, width: x.len(), x, y, z, ..PointColumns::default() }.checked()
    }

    /// The same cloud with some of its columns changed.
    ///
    /// # Errors
    /// Those of [`PointColumns::checked`].
    pub fn with(mut self, change: impl FnOnce(&mut PointColumns)) -> Result<Self, CloudError> {
        change(&mut self.columns);
        self.columns.checked()
    }

    /// The columns by themselves.
    pub fn into_columns(self) -> PointColumns {
        self.columns
    }

    /// The same points declared as `height` rows of `width`.
    ///
    /// # Errors
    /// [`CloudError::Shape`] if that is not the number of points.
    pub fn organised(self, height: usize, width: usize) -> Result<Self, CloudError> {
        self.with(|columns| (columns.height, columns.width) = (height, width))
    }

    /// The same points with a beam number each.
    ///
    /// # Errors
    /// [`CloudError::ColumnLength`] if there is not one for each point.
    pub fn with_ring(self, ring: Vec<u16>) -> Result<Self, CloudError> {
        self.with(|columns| columns.ring = Some(ring))
    }

    /// The same points with a semantic class each.
    ///
    /// # Errors
    /// [`CloudError::ColumnLength`] if there is not one for each point.
    pub fn with_class(self, class: Vec<u16>) -> Result<Self, CloudError> {
        self.with(|columns| columns.class = Some(class))
    }

    /// The same points with a class each, and with the certainty of those.
    ///
    /// # Errors
    /// [`CloudError::ColumnLength`] if there is not one for each point.
    pub fn with_classes(self, classes: PointClasses) -> Result<Self, CloudError> {
        let PointClasses { class, confidence, entropy } = classes;
        self.with(|columns| {
            columns.class = Some(class);
            (columns.confidence, columns.entropy) = (confidence, entropy);
        })
    }

    /// Moves point `index` to a position in metres.
    #[inline]
    pub fn set_position(&mut self, index: usize, [x, y, z]: [f32; 3]) {
        let PointColumns { x: xs, y: ys, z: zs, .. } = &mut self.columns;
        (xs[index], ys[index], zs[index]) = (x, y, z);
    }

    /// Turns all returns about the origin.
    pub fn turn(&mut self, by: UnitQuaternion<f64>) {
        if by == UnitQuaternion::identity() {
            return;
        }
        for point in (0..self.len()).filter(|&point| self.is_return(point)).collect::<Vec<_>>() {
            let at = by * Point3::from(wide(self.position(point)));
            self.set_position(point, [at.x as f32, at.y as f32, at.z as f32]);
        }
        self.columns.turned = by * self.turned;
    }

    /// Sets what is known of the cloud's frame: whether z is up for certain, where the recording
    /// has sensors, metres in the recording's frame, and whether its name is a vehicle's or a
    /// map's.
    pub(crate) fn set_frame(
        &mut self,
        is_z_up: bool,
        recorded_sensors: &[Vector3<f64>],
        is_named_elsewhere: bool,
    ) {
        self.columns.is_z_up = is_z_up;
        self.columns.is_named_elsewhere = is_named_elsewhere;
        self.columns.recorded_sensors =
            recorded_sensors.iter().map(|&at| self.metres_from_recorded(at)).collect();
    }

    /// Says where the sensor stands, in the recording's frame, metres.
    pub fn set_sensor_origin(&mut self, origin: [f64; 3]) {
        self.columns.sensor_origin = Some(self.metres_from_recorded(origin.into()));
    }

    fn metres_from_recorded(&self, at: Vector3<f64>) -> Vector3<f64> {
        self.from_recorded((at * self.unit.per_metre()).into()).into()
    }

    /// The same cloud in metres, if its coordinates are in a unit.
    pub fn from_unit(mut self, unit: LengthUnit) -> Self {
        if unit != LengthUnit::Metre {
            for point in 0..self.len() {
                let at = wide(self.position(point)).map(|along| (along / unit.per_metre()) as f32);
                self.set_position(point, at);
            }
        }
        self.columns.unit = unit;
        self
    }

    /// A position of this cloud, metres, in the recording's frame and unit.
    pub fn recorded(&self, position: [f64; 3]) -> [f64; 3] {
        let at = match self.turned == UnitQuaternion::identity() {
            true => position,
            false => self.turned.inverse_transform_point(&Point3::from(position)).into(),
        };
        std::array::from_fn(|axis| at[axis] * self.unit.per_metre() + self.offset[axis])
    }

    /// A position of this cloud in the recording's frame, both in metres.
    pub fn recorded_metres(&self, position: [f64; 3]) -> [f64; 3] {
        self.recorded(position).map(|along| along / self.unit.per_metre())
    }

    /// A position in the recording's frame and unit as this cloud has it, metres.
    pub fn from_recorded(&self, position: [f64; 3]) -> [f64; 3] {
        let at: [f64; 3] = std::array::from_fn(|axis| {
            (position[axis] - self.offset[axis]) / self.unit.per_metre()
        });
        match self.turned == UnitQuaternion::identity() {
            true => at,
            false => (self.turned * Point3::from(at)).into(),
        }
    }

    /// Number of points N.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there is no point at all.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Whether the cloud has rows and columns of its own. One without points has none, whatever
    /// height it claims.
    pub fn is_organised(&self) -> bool {
        self.height > 1 && self.width > 0
    }

    /// Position of point `index` in metres.
    #[inline]
    pub fn position(&self, index: usize) -> [f32; 3] {
        [self.x[index], self.y[index], self.z[index]]
    }

    /// Whether point `index` is a return: finite and not at the origin, where drivers put beams
    /// that came back with nothing.
    #[inline]
    pub fn is_return(&self, index: usize) -> bool {
        let [x, y, z] = self.position(index);
        x.is_finite() && y.is_finite() && z.is_finite() && (x != 0.0 || y != 0.0 || z != 0.0)
    }

    /// Squared range of point `index` in square metres.
    #[inline]
    pub fn squared_range(&self, index: usize) -> f64 {
        let [x, y, z] = wide(self.position(index));
        x * x + y * y + z * z
    }
}

/// A position in double precision. `map(f64::from)` does not vectorise.
#[inline]
pub fn wide([x, y, z]: [f32; 3]) -> [f64; 3] {
    [f64::from(x), f64::from(y), f64::from(z)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_must_agree() {
        let cloud = PointCloud::new(vec![1.0; 4], vec![0.0; 4], vec![0.0; 4]).unwrap();
        assert!(matches!(
            cloud.clone().with_ring(vec![0; 3]),
            Err(CloudError::ColumnLength { column: "ring", expected: 4, found: 3 })
        ));
        assert!(matches!(
            cloud.organised(3, 2),
            Err(CloudError::Shape { height: 3, width: 2, points: 4 })
        ));
    }

    #[test]
    fn origin_nan_and_infinity_are_no_returns() {
        let cloud =
            PointCloud::new(vec![0.0, f32::NAN, f32::INFINITY, 1.0], vec![0.0; 4], vec![-0.0; 4])
                .unwrap();
        let returns: Vec<bool> = (0..4).map(|i| cloud.is_return(i)).collect();
        assert_eq!(returns, [false, false, false, true]);
    }
}
