//! The input image of a network, and which point is in which pixel.

use std::f64::consts::PI;

use super::config::{ChannelStatistics, InputChannel, SphericalImage};
use divmerge_core::cloud::PointCloud;
use divmerge_core::range_image::{NOWHERE, RangeImage};

/// N points in an image of H x W.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct InputImage {
    /// Rows H.
    pub rows: usize,
    /// Columns W.
    pub columns: usize,
    /// N: the pixel that each point falls into; [`NOWHERE`] if it is no return.
    pub pixel_of_point: Vec<u32>,
    /// H x W: the nearest point in each pixel, or [`NOWHERE`].
    pub point_of_pixel: Vec<u32>,
    /// N: distance from the sensor, metres.
    pub range: Vec<f32>,
}

impl InputImage {
    /// The projection of RangeNet++ (Milioto et al. 2019, section III.A). Columns follow the
    /// azimuth, clockwise from behind the sensor; rows are of equal elevation, and points above or
    /// below all rows fall into the first or the last. A pixel shows its nearest point, of several
    /// the first.
    pub fn spherical(cloud: &PointCloud, image: &SphericalImage) -> Self {
        let (rows, columns) = (image.rows, image.columns);
        let mut seen = InputImage {
            rows,
            columns,
            pixel_of_point: vec![NOWHERE; cloud.len()],
            point_of_pixel: vec![NOWHERE; rows * columns],
            range: vec![0.0; cloud.len()],
        };
        // In double precision: sensors round, and many ranges are equal in single precision.
        let mut nearest = vec![f64::INFINITY; rows * columns];
        let cell = |share: f64, count: usize| ((share * count as f64) as usize).min(count - 1);
        for point in (0..cloud.len()).filter(|&point| cloud.is_return(point)) {
            let [x, y, z] = cloud.position(point).map(f64::from);
            let range = (x * x + y * y + z * z).sqrt();
            let elevation = (z / range).clamp(-1.0, 1.0).asin();
            let row = cell((image.top - elevation) / (image.top - image.bottom), rows);
            let column = cell(0.5 * (1.0 - y.atan2(x) / PI), columns);
            seen.range[point] = range as f32;
            let pixel = row * columns + column;
            seen.pixel_of_point[point] = pixel as u32;
            if range < nearest[pixel] {
                nearest[pixel] = range;
                seen.point_of_pixel[pixel] = point as u32;
            }
        }
        seen
    }

    /// The image that is clustered, of a cloud from one sensor at the origin. Empty rows and
    /// columns at its ends make their numbers multiples of `multiple`, because networks halve
    /// images several times.
    pub fn of_range_image(cloud: &PointCloud, image: &RangeImage, multiple: usize) -> Self {
        let own = image.columns().max(1);
        let rows = image.rows().max(1).next_multiple_of(multiple);
        let columns = own.next_multiple_of(multiple);
        // Row 0 is the highest beam for a network.
        let row = |row: usize| if image.top_row_first { row } else { image.rows() - 1 - row };
        let pixel = |pixel: u32| match pixel {
            NOWHERE => NOWHERE,
            pixel => (row(pixel as usize / own) * columns + pixel as usize % own) as u32,
        };
        let mut point_of_pixel = vec![NOWHERE; rows * columns];
        for (own_row, points) in image.point_of_pixel.values().chunks(own).enumerate() {
            point_of_pixel[row(own_row) * columns..][..own].copy_from_slice(points);
        }
        InputImage {
            rows,
            columns,
            pixel_of_point: image.pixel_of_point.iter().map(|&own| pixel(own)).collect(),
            point_of_pixel,
            range: (0..cloud.len()).map(|point| cloud.squared_range(point).sqrt() as f32).collect(),
        }
    }

    /// Appends the channels one after the other, each row by row: values less the mean of their
    /// channel over its standard deviation, 0 where a pixel is empty. Remission that the cloud
    /// lacks is the mean.
    pub fn write(
        &self,
        cloud: &PointCloud,
        channels: &[ChannelStatistics],
        scale: f32,
        out: &mut Vec<f32>,
    ) {
        for &(channel, mean, std) in channels {
            let value = |point: usize| match channel {
                InputChannel::Range => self.range[point],
                InputChannel::X => cloud.x[point],
                InputChannel::Y => cloud.y[point],
                InputChannel::Z => cloud.z[point],
                InputChannel::Remission => {
                    cloud.remission.as_ref().map_or(mean, |remission| remission[point] * scale)
                }
            };
            out.extend(self.point_of_pixel.iter().map(|&point| match point {
                NOWHERE => 0.0,
                point => (value(point as usize) - mean) / std,
            }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use divmerge_core::range_image::ProjectionParams;

    fn cloud(points: &[[f32; 3]]) -> PointCloud {
        let axis = |axis: usize| points.iter().map(|point| point[axis]).collect();
        PointCloud::new(axis(0), axis(1), axis(2)).unwrap()
    }

    fn image() -> SphericalImage {
        SphericalImage { rows: 4, columns: 8, top: 0.4, bottom: -0.4 }
    }

    #[test]
    fn columns_run_from_behind_over_left_to_right() {
        let around = [
            [-1.0, 0.1, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 0.1, 0.0],
            [0.1, -1.0, 0.0],
            [-1.0, -0.1, 0.0],
        ];
        let seen = InputImage::spherical(&cloud(&around), &image());
        let columns: Vec<u32> = seen.pixel_of_point.iter().map(|pixel| pixel % 8).collect();
        assert_eq!(columns, [0, 2, 3, 5, 7]);
        assert!(seen.pixel_of_point.iter().all(|pixel| pixel / 8 == 2));
    }

    #[test]
    fn rows_run_down_and_take_what_lies_beyond() {
        let up = |elevation: f32| [elevation.cos(), -0.1, elevation.sin()];
        let seen = InputImage::spherical(
            &cloud(&[up(1.2), up(0.3), up(0.1), up(-0.1), up(-0.3), up(-1.2)]),
            &image(),
        );
        let rows: Vec<u32> = seen.pixel_of_point.iter().map(|pixel| pixel / 8).collect();
        assert_eq!(rows, [0, 0, 1, 2, 3, 3]);
    }

    #[test]
    fn the_nearest_is_seen_and_what_is_no_return_is_nowhere() {
        let seen = InputImage::spherical(
            &cloud(&[
                [9.0, -1.0, 0.1],
                [4.5, -0.5, 0.05],
                [f32::NAN, 0.0, 0.0],
                [0.0; 3],
                [4.5, -0.5, 0.05],
            ]),
            &image(),
        );
        let pixel = seen.pixel_of_point[0];
        assert_eq!(seen.pixel_of_point, [pixel, pixel, NOWHERE, NOWHERE, pixel]);
        assert_eq!(seen.point_of_pixel[pixel as usize], 1);
        assert_eq!(seen.point_of_pixel.iter().filter(|&&point| point != NOWHERE).count(), 1);
    }

    #[test]
    fn channels_are_normalised_and_empty_pixels_are_zero() {
        let cloud = cloud(&[[3.0, -0.001, 4.0]]);
        let channels = [
            (InputChannel::Range, 1.0, 2.0),
            (InputChannel::Z, 0.0, 4.0),
            (InputChannel::Remission, 0.5, 0.25),
        ];
        let mut out = Vec::new();
        let seen = InputImage::spherical(&cloud, &image());
        seen.write(&cloud, &channels, 1.0, &mut out);
        assert_eq!(out.len(), 3 * 32);
        let pixel = seen.pixel_of_point[0] as usize;
        assert!((out[pixel] - 2.0).abs() < 1e-6);
        assert_eq!([out[32 + pixel], out[64 + pixel]], [1.0, 0.0]);
        assert_eq!(out.iter().filter(|&&value| value != 0.0).count(), 2);
        let cloud = cloud.with(|columns| columns.remission = Some(vec![255.0])).unwrap();
        out.clear();
        seen.write(&cloud, &channels, 1.0 / 255.0, &mut out);
        assert_eq!(out[64 + pixel], 2.0);
    }

    #[test]
    fn the_clustering_s_image_stands_in_the_corner() {
        let points: Vec<[f32; 3]> =
            (0..6).map(|i| [5.0, i as f32 * -0.1, (i / 3) as f32 * -0.2]).collect();
        let cloud = cloud(&points).organised(2, 3).unwrap();
        let image = RangeImage::new(&cloud, &ProjectionParams::default());
        let seen = InputImage::of_range_image(&cloud, &image, 8);
        assert_eq!((seen.rows, seen.columns), (8, 8));
        assert_eq!(seen.pixel_of_point, [0, 1, 2, 8, 9, 10]);
        assert_eq!(seen.point_of_pixel[9], 4);
    }
}
