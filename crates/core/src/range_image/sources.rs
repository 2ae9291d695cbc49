//! Clouds merged of several sensors: an image each, one below the other.

use std::collections::BTreeMap;

use super::band::Band;
use super::image::{NOWHERE, RangeImage};
use super::one_sensor::one_sensor;
use super::params::{ProjectionParams, Wrap};
use super::projection::Projection;
use crate::cloud::{PointCloud, PointColumns};
use crate::geometry::grid::Grid;

/// No vehicle carries more; a column of more numbers is something else.
const MOST_SOURCES: usize = 32;

/// The points of each sensor. `None` unless the cloud tells several sensors apart.
pub(super) fn of(cloud: &PointCloud) -> Option<BTreeMap<u16, Vec<u32>>> {
    let mut sources: BTreeMap<u16, Vec<u32>> = BTreeMap::new();
    for (point, &source) in (0..).zip(cloud.source.as_ref()?) {
        if cloud.is_return(point as usize) {
            sources.entry(source).or_default().push(point);
            if sources.len() > MOST_SOURCES {
                return None;
            }
        }
    }
    (sources.len() > 1).then_some(sources)
}

/// Projects the points of each sensor for itself.
///
/// Columns are those of the sensor with the most; one with fewer has all its beams in the same ones
/// of them. None has more than twice as many as it needs, so that neighbours stay within two
/// columns.
pub(super) fn project(
    cloud: &PointCloud,
    sources: &BTreeMap<u16, Vec<u32>>,
    params: &ProjectionParams,
) -> RangeImage {
    let images: Vec<RangeImage> =
        sources.values().map(|points| one_sensor(&part(cloud, points), params)).collect();
    let widths = images.iter().map(RangeImage::columns);
    let columns = widths.clone().max().unwrap_or(1).min(2 * widths.min().unwrap_or(1));
    let rows = images.iter().map(RangeImage::rows).sum();
    let mut merged = RangeImage {
        projection: Projection::Sources,
        wraps: params.wrap != Wrap::Never,
        top_row_first: true,
        stagger: 0,
        bands: Vec::new(),
        point_of_pixel: Grid::filled(rows, columns, NOWHERE),
        pixel_of_point: vec![NOWHERE; cloud.len()],
    };
    let mut first = 0;
    for ((&source, points), image) in sources.iter().zip(&images) {
        let rows = first..first + image.rows();
        first = rows.end;
        let band = Band { source: Some(source), rows, ..image.bands[0].clone() };
        place(cloud, points, image, &band, &mut merged);
        merged.bands.push(band);
    }
    merged
}

/// The points of one sensor as a cloud.
fn part(cloud: &PointCloud, points: &[u32]) -> PointCloud {
    let floats = |column: &[f32]| points.iter().map(|&p| column[p as usize]).collect();
    let ring = cloud.ring.as_ref();
    let columns = PointColumns {
        x: floats(&cloud.x),
        y: floats(&cloud.y),
        z: floats(&cloud.z),
        ring: ring.map(|ring| points.iter().map(|&p| ring[p as usize]).collect()),
        height: 1,
        width: points.len(),
        ..PointColumns::default()
    };
    columns.checked().expect("as many of each")
}

/// Puts an image into its band.
fn place(
    cloud: &PointCloud,
    points: &[u32],
    image: &RangeImage,
    band: &Band,
    merged: &mut RangeImage,
) {
    let (own, columns) = (image.columns(), merged.columns());
    let range = |point: u32| {
        let from = band.from_sensor(cloud.position(point as usize).map(f64::from));
        from.iter().map(|along| along * along).sum::<f64>()
    };
    for (&point, &pixel) in points.iter().zip(&image.pixel_of_point) {
        if pixel == NOWHERE {
            continue;
        }
        let (row, column) = (pixel as usize / own, pixel as usize % own);
        let pixel = (band.rows.start + row) * columns + column * columns / own;
        merged.pixel_of_point[point as usize] = pixel as u32;
        let seen = &mut merged.point_of_pixel.values_mut()[pixel];
        if *seen == NOWHERE || range(point) < range(*seen) {
            *seen = point;
        }
    }
}
