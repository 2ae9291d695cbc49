//! What each band shows, as a cloud and an image of its own.

use super::band::{Band, as_return};
use super::image::{NOWHERE, RangeImage};
use crate::cloud::{PointCloud, PointColumns};
use crate::geometry::grid::Grid;

/// What one band shows, as a cloud and an image of its own.
pub struct BandView {
    /// Numbers of its points in the whole cloud, ascending.
    pub points: Vec<u32>,
    /// Those points, the sensor at the origin and the directions those of the whole cloud;
    /// positions alone.
    pub cloud: PointCloud,
    /// The band as an image of that cloud.
    pub image: RangeImage,
}

impl RangeImage {
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
        let mut own = PointColumns {
            is_z_up: cloud.is_z_up,
            height: 1,
            width: points.len(),
            ..PointColumns::default()
        };
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
        BandView { points, cloud: own.checked().expect("as many of each"), image }
    }
}
