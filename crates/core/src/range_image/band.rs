//! The rows of an image that one sensor made, and where that sensor stands.

use std::ops::Range;

use nalgebra::{Isometry3, Point3};

use super::{NOWHERE, Projection, RangeImage};
use crate::cloud::point_cloud::PointCloud;
use crate::geometry::grid::Grid;

/// The rows of an image that one sensor made. An image has one band, but for a cloud merged of several sensors:
/// there they lie one below the other, and no pixel of one is a neighbour of another's.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// The sensor's number in the cloud, where the cloud has such numbers.
    pub source: Option<u16>,
    /// Its rows of the image.
    pub rows: Range<usize>,
    /// How its rows were found.
    pub projection: Projection,
    /// Angle from one shot of a beam to the next, radians.
    pub column_step: f64,
    /// Pose of the sensor in the cloud's frame, metres: where its beams leave from, and the axis that they turn
    /// about as z. The identity unless the data says otherwise.
    pub sensor: Isometry3<f64>,
}

impl Band {
    /// Whether ranges and angles are those of the cloud's own frame.
    pub fn is_at_origin(&self) -> bool {
        self.sensor == Isometry3::identity()
    }

    /// A position of the cloud as seen from where the sensor stands, in the directions of the cloud's frame,
    /// metres.
    #[inline]
    pub fn from_sensor(&self, position: [f64; 3]) -> [f64; 3] {
        let origin = &self.sensor.translation.vector;
        [position[0] - origin.x, position[1] - origin.y, position[2] - origin.z]
    }

    /// A position of the cloud in the sensor's own frame, metres.
    pub fn in_sensor(&self, position: [f32; 3]) -> [f64; 3] {
        let position = position.map(f64::from);
        if self.is_at_origin() {
            return position;
        }
        self.sensor.inverse_transform_point(&Point3::from(position)).into()
    }
}

/// A return seen from elsewhere, in single precision: still a return, even where it lies at the new origin or too far
/// away for a number.
pub(super) fn as_return(position: [f64; 3]) -> [f32; 3] {
    let [x, y, z] = position.map(|along| (along as f32).clamp(f32::MIN, f32::MAX));
    if [x, y, z] == [0.0; 3] { [0.0, 0.0, f32::MIN_POSITIVE] } else { [x, y, z] }
}

/// What one band shows, as a cloud and an image of its own.
pub struct BandView {
    /// Numbers of its points in the whole cloud, ascending.
    pub points: Vec<u32>,
    /// Those points, the sensor at the origin and the directions those of the whole cloud; positions alone.
    pub cloud: PointCloud,
    /// The band as an image of that cloud.
    pub image: RangeImage,
}

impl RangeImage {
    /// Whether the image is that of one sensor at the origin of the cloud's frame.
    pub fn is_plain(&self) -> bool {
        matches!(&self.bands[..], [band] if band.is_at_origin())
    }

    /// Number of the band that a row belongs to.
    pub fn band_of_row(&self, row: usize) -> usize {
        self.bands.iter().position(|band| band.rows.contains(&row)).unwrap_or(0)
    }

    /// The band that a pixel belongs to.
    pub fn band_of(&self, pixel: usize) -> &Band {
        match &self.bands[..] {
            [band] => band,
            bands => &bands[self.band_of_row(pixel / self.columns())],
        }
    }

    /// What each band shows by itself.
    pub fn views(&self, cloud: &PointCloud) -> Vec<BandView> {
        self.bands.iter().map(|band| self.view(cloud, band)).collect()
    }

    fn view(&self, cloud: &PointCloud, band: &Band) -> BandView {
        let columns = self.columns();
        let pixels = (band.rows.start * columns) as u32..(band.rows.end * columns) as u32;
        let is_own = |&point: &u32| pixels.contains(&self.pixel_of_point[point as usize]);
        let points: Vec<u32> = (0..cloud.len() as u32).filter(is_own).collect();
        let mut of_point = vec![NOWHERE; cloud.len()];
        let mut own = PointCloud { height: 1, width: points.len(), ..PointCloud::default() };
        for (number, &point) in (0..).zip(&points) {
            of_point[point as usize] = number;
            let position = cloud.position(point as usize).map(f64::from);
            let [x, y, z] = as_return(band.from_sensor(position));
            own.x.push(x);
            own.y.push(y);
            own.z.push(z);
        }
        let seen = &self.point_of_pixel.values()[pixels.start as usize..pixels.end as usize];
        let number = |&point: &u32| of_point.get(point as usize).copied().unwrap_or(NOWHERE);
        let seen: Vec<u32> = seen.iter().map(number).collect();
        let pixel = |&point: &u32| self.pixel_of_point[point as usize] - pixels.start;
        let mut sensor = band.sensor;
        sensor.translation.vector.fill(0.0);
        let image = RangeImage {
            projection: band.projection,
            bands: vec![Band { rows: 0..band.rows.len(), sensor, ..band.clone() }],
            point_of_pixel: Grid::from_rows(band.rows.len(), columns, seen),
            pixel_of_point: points.iter().map(pixel).collect(),
            ..*self
        };
        BandView { points, cloud: own, image }
    }
}
