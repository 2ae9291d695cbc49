//! The range image: H x W pixels, row 0 the highest beam, columns in scan order (paper, section
//! III; ALGORITHM section 1).
//!
//! Several projections lead there: an organised cloud is the image as it stands (beams that are
//! turned against each other brought back into line); a `ring` or `channel` field gives the rows;
//! without one the rows come from the order of storage or from the elevation, its beams estimated
//! from the data; where there are no beams, pixels are as fine as the points lie. Columns then come
//! from the azimuth. A cloud merged of several sensors that tells them apart is an image of each
//! ([`Band`]), one below the other. Where several points fall into one pixel the nearest wins
//! (ties: the lower point index); the others are *shadowed* and get their label after the
//! clustering.

mod angles;
mod azimuth;
mod band;
mod beams;
mod columns;
mod coverage;
mod evidence;
mod geometry;
mod image;
mod neighbours;
mod one_sensor;
mod organised;
mod params;
mod pixel_set;
mod project;
mod projection;
mod sources;
mod spacing;
mod sweep;
mod viewpoint;
mod views;

use crate::cloud::PointCloud;

pub use band::Band;
pub use beams::RingFlaw;
pub use evidence::Evidence;
pub use geometry::{BandGeometry, Geometry};
pub use image::{NOWHERE, RangeImage};
pub use neighbours::{NEIGHBOURS, NO_NEIGHBOUR, Reach, neighbours};
pub use params::{ProjectionParams, RowsFrom, Wrap};
pub use pixel_set::PixelSet;
pub use projection::Projection;
pub use views::BandView;

impl RangeImage {
    /// Projects a cloud.
    ///
    /// Steps: rows and a column count from whichever projection fits; pixel of each return; nearest
    /// point of each pixel. Time O(N), plus sorting a sample of the azimuths.
    pub fn new(cloud: &PointCloud, params: &ProjectionParams) -> RangeImage {
        match sources::of(cloud).filter(|_| params.rows_from == RowsFrom::Best) {
            Some(sources) if organised::project(cloud, params).is_none() => {
                sources::project(cloud, &sources, params)
            }
            _ => one_sensor::one_sensor(cloud, params),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    proptest::proptest! {
        #[test]
        fn every_return_of_any_cloud_has_a_pixel(
            picks in proptest::collection::vec(
                (0..12_usize, 0..12_usize, 0..12_usize, 0..6_u16, 0..3_u16),
                0..600,
            ),
            rows in 1..3_usize,
            told in 0..4,
        ) {
            let odd = [
                0.0, 1.0, -3.0, 1e-40, 1e38, -3e38, f32::NAN, f32::INFINITY, 15.999_999,
                -15.999_999, 1.8, 0.25,
            ];
            let count = picks.len() / rows * rows;
            let axis = |of: fn(&(usize, usize, usize, u16, u16)) -> usize| {
                picks[..count].iter().map(|pick| odd[of(pick)]).collect::<Vec<f32>>()
            };
            let cloud = PointCloud::new(axis(|p| p.0), axis(|p| p.1), axis(|p| p.2)).unwrap();
            let cloud = cloud.organised(rows, count / rows).unwrap();
            let picks = || picks[..count].iter();
            let ring = (told % 2 == 1).then(|| picks().map(|pick| pick.3).collect());
            let source = (told > 1).then(|| picks().map(|pick| pick.4).collect());
            let cloud = cloud
                .with(|columns| (columns.ring, columns.source) = (ring, source))
                .unwrap();
            let image = RangeImage::new(&cloud, &ProjectionParams::default());
            for point in 0..count {
                proptest::prop_assert_eq!(image.pixel_of(point).is_some(), cloud.is_return(point));
            }
            let bands: Vec<usize> = image.bands.iter().flat_map(|band| band.rows.clone()).collect();
            proptest::prop_assert_eq!(bands, (0..image.rows()).collect::<Vec<usize>>());
            Geometry::new(&cloud, &image);
            let views = image.views(&cloud);
            let points: usize = views.iter().map(|view| view.cloud.len()).sum();
            let returns = (0..count).filter(|&point| cloud.is_return(point)).count();
            proptest::prop_assert_eq!(points, returns);
        }
    }

    #[test]
    fn row_steps_are_those_to_the_farther_neighbour() {
        // Rows at 3, 2, 0 and -0.5 degrees, and one in between without a return.
        let elevations = [Some(3.0), Some(2.0), None, Some(0.0), Some(-0.5_f64)];
        let columns = 40;
        let mut points = Vec::new();
        for elevation in elevations {
            for column in 0..columns {
                let azimuth = std::f64::consts::TAU * f64::from(column) / f64::from(columns);
                let point = elevation.map_or([f32::NAN; 3], |degrees| {
                    let (up, out) = degrees.to_radians().sin_cos();
                    [out * azimuth.cos(), -out * azimuth.sin(), up].map(|x| (10.0 * x) as f32)
                });
                points.push(point);
            }
        }
        let axis = |i: usize| points.iter().map(|point| point[i]).collect::<Vec<f32>>();
        let cloud = PointCloud::new(axis(0), axis(1), axis(2)).unwrap();
        let cloud = cloud.organised(elevations.len(), columns as usize).unwrap();
        let image = RangeImage::new(&cloud, &ProjectionParams::default());
        let steps = image.row_steps(&cloud);
        let mean = 3.5 / 4.0;
        for (found, expected) in steps.iter().zip([1.0, 1.0, mean, 1.0, 0.5]) {
            assert!((found.to_degrees() - expected).abs() < 1e-3, "{steps:?}");
        }
    }
}
