//! A point cloud: columns of equal length, metres, sensor frame.

use nalgebra::{Point3, UnitQuaternion};

use crate::error::CloudError;

/// N points of one sweep in the sensor's own frame (x forward, y left, z up for most drivers).
///
/// Columns all have length N. An organised cloud of `height` rows and `width` columns stores point
/// (row, column) at `row * width + column`; an unorganised one has `height == 1`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointCloud {
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
    /// unless [`turn`](Self::turn) was called.
    pub turned: UnitQuaternion<f64>,
    /// Rows of an organised cloud, else 1.
    pub height: usize,
    /// Columns of an organised cloud, else N.
    pub width: usize,
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

impl PointCloud {
    /// An unorganised cloud from coordinates in metres.
    ///
    /// # Errors
    /// [`CloudError::ColumnLength`] if the columns differ in length.
    pub fn new(x: Vec<f32>, y: Vec<f32>, z: Vec<f32>) -> Result<Self, CloudError> {
        let cloud = PointCloud { height: 1, width: x.len(), x, y, z, ..PointCloud::default() };
        cloud.check()?;
        Ok(cloud)
    }

    /// The same points declared as `height` rows of `width`.
    ///
    /// # Errors
    /// [`CloudError::Shape`] if that is not the number of points.
    pub fn organised(mut self, height: usize, width: usize) -> Result<Self, CloudError> {
        (self.height, self.width) = (height, width);
        self.check()?;
        Ok(self)
    }

    /// The same points with a beam number each.
    ///
    /// # Errors
    /// [`CloudError::ColumnLength`] if there is not one for each point.
    pub fn with_ring(mut self, ring: Vec<u16>) -> Result<Self, CloudError> {
        self.ring = Some(ring);
        self.check()?;
        Ok(self)
    }

    /// The same points with a semantic class each.
    ///
    /// # Errors
    /// [`CloudError::ColumnLength`] if there is not one for each point.
    pub fn with_class(mut self, class: Vec<u16>) -> Result<Self, CloudError> {
        self.class = Some(class);
        self.check()?;
        Ok(self)
    }

    /// The same points with a class each, and with how sure those are.
    ///
    /// # Errors
    /// [`CloudError::ColumnLength`] if there is not one for each point.
    pub fn with_classes(mut self, classes: PointClasses) -> Result<Self, CloudError> {
        self.class = Some(classes.class);
        self.confidence = classes.confidence;
        self.entropy = classes.entropy;
        self.check()?;
        Ok(self)
    }

    /// Checks that all columns have one length and that the shape holds them.
    ///
    /// # Errors
    /// [`CloudError::ColumnLength`] or [`CloudError::Shape`].
    pub fn check(&self) -> Result<(), CloudError> {
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
        ];
        for (column, found) in columns {
            if let Some(found) = found.filter(|&found| found != expected) {
                return Err(CloudError::ColumnLength { column, expected, found });
            }
        }
        if self.height.checked_mul(self.width) != Some(expected) {
            return Err(CloudError::Shape {
                height: self.height,
                width: self.width,
                points: expected,
            });
        }
        Ok(())
    }

    /// Turns all returns about the origin.
    pub fn turn(&mut self, by: UnitQuaternion<f64>) {
        if by == UnitQuaternion::identity() {
            return;
        }
        for point in (0..self.len()).filter(|&point| self.is_return(point)).collect::<Vec<_>>() {
            let at = by * Point3::from(wide(self.position(point)));
            (self.x[point], self.y[point], self.z[point]) = (at.x as f32, at.y as f32, at.z as f32);
        }
        self.turned = by * self.turned;
    }

    /// A position of this cloud in the recording's frame, metres.
    pub fn recorded(&self, position: [f64; 3]) -> [f64; 3] {
        if self.turned == UnitQuaternion::identity() {
            return position;
        }
        self.turned.inverse_transform_point(&Point3::from(position)).into()
    }

    /// A position in the recording's frame as this cloud has it, metres.
    pub fn from_recorded(&self, position: [f64; 3]) -> [f64; 3] {
        if self.turned == UnitQuaternion::identity() {
            return position;
        }
        (self.turned * Point3::from(position)).into()
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
