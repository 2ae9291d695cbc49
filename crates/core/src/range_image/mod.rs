//! The range image: H x W pixels, row 0 the highest beam, columns in scan order (paper, section III;
//! ALGORITHM section 1).
//!
//! Several projections lead there: an organised cloud is the image as it stands (beams that are turned against
//! each other brought back into line); a `ring` or `channel` field gives the rows; without one the rows come
//! from the order of storage or from the elevation, its beams estimated from the data; where there are no
//! beams, pixels are as fine as the points lie. Columns then come from the azimuth. A cloud merged of several
//! sensors that tells them apart is an image of each ([`Band`]), one below the other.
//! Where several points fall into one pixel the nearest wins
//! (ties: the lower point index); the others are *shadowed* and get their label after the clustering.

mod azimuth;
mod band;
mod beams;
mod columns;
mod coverage;
mod geometry;
mod neighbours;
mod organised;
mod pixel_set;
mod project;
mod sources;
mod spacing;
mod sweep;
mod viewpoint;

use serde::Serialize;

use crate::cloud::point_cloud::PointCloud;
use crate::geometry::grid::Grid;

pub use band::{Band, BandView};
pub use geometry::{BandGeometry, Geometry};
pub use neighbours::{NEIGHBOURS, NO_NEIGHBOUR, Reach, neighbours};
pub use pixel_set::PixelSet;

/// Marks a pixel without a point, or a point without a pixel.
pub const NOWHERE: u32 = u32::MAX;

/// How clouds become images. Unset sizes are estimated from the data.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ProjectionParams {
    /// What gives the rows of a cloud that is not organised. Default: the best that the cloud offers.
    pub rows_from: RowsFrom,
    /// Rows of equal elevation, in place of any beams; an organised cloud stays as it stands. Default: the beams,
    /// where there are any; else as fine as the points lie, or 64 (the paper's) where few points tell.
    pub rows: Option<usize>,
    /// Columns of the full circle. Default: from the azimuth step between returns of one beam, or as fine as
    /// the points lie where there are no beams; 2048 (the paper's) where few points tell.
    pub columns: Option<usize>,
    /// Elevation of the image's upper and lower edge in radians, for rows of equal elevation in place of any
    /// beams. Default: the elevations that hold all but 0.2 % of the returns.
    pub field_of_view: Option<(f64, f64)>,
    /// Whether the first and the last column are neighbours.
    pub wrap: Wrap,
}

/// Where the rows of an unorganised cloud come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RowsFrom {
    /// The ring field, else beams found in the data, else equal steps of elevation.
    #[default]
    Best,
    /// Equal steps of elevation, whatever the cloud offers.
    UniformElevation,
}

/// Whether the first and the last column are neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Wrap {
    /// Always, as ALGORITHM section 1 has it.
    Always,
    /// Never, as in the released C++.
    Never,
    /// Where the columns go all the way round; a sensor with a limited field of view has an edge there.
    #[default]
    WhereScanCloses,
}

/// Which projection made an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Projection {
    /// The cloud's own rows and columns.
    Organised,
    /// The cloud's own rows and columns, exchanged: its driver stores a beam per column.
    OrganisedTransposed,
    /// Rows from the ring field, columns from the azimuth.
    Ring,
    /// Rows from the order in which the points are stored, one turn of the azimuth per beam.
    ScanOrder,
    /// Rows from peaks in the distribution of the elevation.
    Elevations,
    /// Rows of equal elevation.
    UniformElevation,
    /// An image for each of several sensors.
    Sources,
}

impl Projection {
    /// A few words for people.
    pub fn describe(self) -> &'static str {
        match self {
            Projection::Organised => "organised cloud",
            Projection::OrganisedTransposed => "organised cloud, one column per beam",
            Projection::Ring => "ring field",
            Projection::ScanOrder => "storage order, one turn per beam",
            Projection::Elevations => "beams found in the elevations",
            Projection::UniformElevation => "equal steps of elevation",
            Projection::Sources => "an image for each sensor",
        }
    }
}

/// An H x W range image over a cloud of N points: pixel to point and point to pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeImage {
    /// Which projection made it.
    pub projection: Projection,
    /// The sensors that made it, from the upper rows to the lower ones: one, but for a merged cloud.
    pub bands: Vec<Band>,
    /// Whether columns 0 and W-1 are neighbours.
    pub wraps: bool,
    /// By how many columns the rows of an organised cloud were turned against each other at most, before they
    /// were brought into line; 0 if they stood in line.
    pub stagger: usize,
    /// Whether row 0 is the highest beam. Always so but for an organised cloud stored bottom up, which
    /// stays as it stands.
    pub top_row_first: bool,
    /// H x W: the point in each pixel, or [`NOWHERE`].
    pub point_of_pixel: Grid<u32>,
    /// N: the pixel that each point falls into, or [`NOWHERE`] if it is no return. A shadowed point has
    /// the pixel of the point that shadows it.
    pub pixel_of_point: Vec<u32>,
}

impl RangeImage {
    /// Projects a cloud.
    ///
    /// Steps: rows and a column count from whichever projection fits; pixel of each return; nearest
    /// point of each pixel. Time O(N), plus sorting a sample of the azimuths.
    pub fn new(cloud: &PointCloud, params: &ProjectionParams) -> RangeImage {
        match organised::project(cloud, params) {
            Some(image) => image,
            None => project::project(cloud, params),
        }
    }

    /// Number of rows H.
    pub fn rows(&self) -> usize {
        self.point_of_pixel.rows()
    }

    /// Number of columns W.
    pub fn columns(&self) -> usize {
        self.point_of_pixel.columns()
    }

    /// The point seen in a pixel.
    #[inline]
    pub fn point_at(&self, pixel: usize) -> Option<usize> {
        let point = self.point_of_pixel.values()[pixel];
        (point != NOWHERE).then_some(point as usize)
    }

    /// The pixel that a point falls into.
    #[inline]
    pub fn pixel_of(&self, point: usize) -> Option<usize> {
        let pixel = self.pixel_of_point[point];
        (pixel != NOWHERE).then_some(pixel as usize)
    }

    /// Whether a nearer point occupies the point's pixel.
    #[inline]
    pub fn is_shadowed(&self, point: usize) -> bool {
        self.pixel_of(point)
            .is_some_and(|pixel| self.point_of_pixel.values()[pixel] != point as u32)
    }

    /// How many points have a pixel but are not seen in it.
    pub fn shadowed_count(&self) -> usize {
        let placed = self.pixel_of_point.iter().filter(|&&pixel| pixel != NOWHERE);
        let seen = self.point_of_pixel.values().iter().filter(|&&point| point != NOWHERE);
        placed.count() - seen.count()
    }

    /// For each row the angle to the farther of the two rows next to it, radians, by the mean elevations of
    /// a sample of its returns. A row without any has the mean step of all; so has the only row.
    pub fn row_steps(&self, cloud: &PointCloud) -> Vec<f64> {
        const EVERY: usize = 16;
        let of_row = |row: usize| {
            let pixels = (0..self.columns()).step_by(EVERY).map(|c| row * self.columns() + c);
            let band = &self.bands[self.band_of_row(row)];
            let from_sensor = |point| match band.is_at_origin() {
                true => elevation(cloud, point),
                false => elevation_of(band.in_sensor(cloud.position(point))),
            };
            let seen: Vec<f64> =
                pixels.filter_map(|pixel| self.point_at(pixel).map(from_sensor)).collect();
            (!seen.is_empty()).then(|| seen.iter().sum::<f64>() / seen.len() as f64)
        };
        let rows: Vec<Option<f64>> = (0..self.rows()).map(of_row).collect();
        let mut steps = Vec::with_capacity(self.rows());
        for band in &self.bands {
            steps.extend(row_steps(&rows[band.rows.clone()]));
        }
        steps
    }

    /// Elevations in radians of the highest and the lowest return seen, if there is any return.
    pub fn elevation_span(&self, cloud: &PointCloud) -> Option<(f64, f64)> {
        let seen = self.point_of_pixel.values().iter().filter(|&&point| point != NOWHERE);
        seen.map(|&point| elevation(cloud, point as usize)).fold(None, |span, e| match span {
            None => Some((e, e)),
            Some((high, low)) => Some((e.max(high), e.min(low))),
        })
    }
}

/// For each row of one sensor the angle to the farther of the two next to it, given the elevation of each.
fn row_steps(rows: &[Option<f64>]) -> Vec<f64> {
    let known: Vec<(usize, f64)> =
        rows.iter().enumerate().filter_map(|(row, e)| Some((row, (*e)?))).collect();
    let step = |a: &(usize, f64), b: &(usize, f64)| (a.1 - b.1).abs() / (b.0 - a.0) as f64;
    let mean = match (known.first(), known.last()) {
        (Some(first), Some(last)) if first.0 < last.0 => step(first, last),
        _ => 0.0,
    };
    let mut steps = vec![mean; rows.len()];
    for row in &known {
        steps[row.0] = 0.0;
    }
    for pair in known.windows(2) {
        let between = step(&pair[0], &pair[1]);
        for row in [pair[0].0, pair[1].0] {
            steps[row] = steps[row].max(between);
        }
    }
    steps
}

/// Elevation of a position above the horizontal plane in radians.
fn elevation_of([x, y, z]: [f64; 3]) -> f64 {
    z.atan2(x.hypot(y))
}

/// Elevation of a point above the sensor's horizontal plane in radians.
fn elevation(cloud: &PointCloud, point: usize) -> f64 {
    elevation_of(cloud.position(point).map(f64::from))
}

/// Azimuth of a point in radians, counter-clockwise from the x axis.
fn azimuth(cloud: &PointCloud, point: usize) -> f64 {
    f64::from(cloud.y[point]).atan2(f64::from(cloud.x[point]))
}

/// The median of a list, reordering it; `None` of an empty one.
fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    let (_, median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median)
}

#[cfg(test)]
mod tests {
    use super::*;

    proptest::proptest! {
        #[test]
        fn every_return_of_any_cloud_has_a_pixel(
            picks in proptest::collection::vec((0..12_usize, 0..12_usize, 0..12_usize, 0..6_u16, 0..3_u16), 0..600),
            rows in 1..3_usize,
            told in 0..4,
        ) {
            let odd = [
                0.0, 1.0, -3.0, 1e-40, 1e38, -3e38, f32::NAN, f32::INFINITY, 15.999_999, -15.999_999, 1.8, 0.25,
            ];
            let count = picks.len() / rows * rows;
            let axis = |of: fn(&(usize, usize, usize, u16, u16)) -> usize| {
                picks[..count].iter().map(|pick| odd[of(pick)]).collect::<Vec<f32>>()
            };
            let cloud = PointCloud::new(axis(|p| p.0), axis(|p| p.1), axis(|p| p.2)).unwrap();
            let mut cloud = cloud.organised(rows, count / rows).unwrap();
            cloud.ring = (told % 2 == 1).then(|| picks[..count].iter().map(|pick| pick.3).collect());
            cloud.source = (told > 1).then(|| picks[..count].iter().map(|pick| pick.4).collect());
            let image = RangeImage::new(&cloud, &ProjectionParams::default());
            for point in 0..count {
                proptest::prop_assert_eq!(image.pixel_of(point).is_some(), cloud.is_return(point));
            }
            let bands: Vec<usize> = image.bands.iter().flat_map(|band| band.rows.clone()).collect();
            proptest::prop_assert_eq!(bands, (0..image.rows()).collect::<Vec<usize>>());
            Geometry::new(&cloud, &image);
            let views = image.views(&cloud);
            proptest::prop_assert!(views.iter().all(|view| view.cloud.check().is_ok()));
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
