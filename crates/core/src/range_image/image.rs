//! The range image: pixel to point and point to pixel.

use super::angles::{elevation, elevation_of};
use super::band::Band;
use super::evidence::Evidence;
use super::projection::Projection;
use crate::cloud::PointCloud;
use crate::geometry::grid::Grid;

/// Marks a pixel without a point, or a point without a pixel.
pub const NOWHERE: u32 = u32::MAX;

/// An H x W range image over a cloud of N points: pixel to point and point to pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeImage {
    /// Which projection made it.
    pub projection: Projection,
    /// The sensors that made it, from the upper rows to the lower ones: one, but for a merged
    /// cloud.
    pub bands: Vec<Band>,
    /// Whether columns 0 and W-1 are neighbours.
    pub wraps: bool,
    /// By how many columns the rows of an organised cloud were turned against each other at most,
    /// before they were brought into line; 0 if they stood in line.
    pub stagger: usize,
    /// Whether row 0 is the highest beam. Always so but for an organised cloud stored bottom up,
    /// which stays as it stands.
    pub top_row_first: bool,
    /// H x W: the point in each pixel, or [`NOWHERE`].
    pub point_of_pixel: Grid<u32>,
    /// N: the pixel that each point falls into, or [`NOWHERE`] if it is no return. A shadowed point
    /// has the pixel of the point that shadows it.
    pub pixel_of_point: Vec<u32>,
}

impl RangeImage {
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

    /// How many points have a pixel: those that are returns.
    pub fn return_count(&self) -> usize {
        self.pixel_of_point.iter().filter(|&&pixel| pixel != NOWHERE).count()
    }

    /// How many points have a pixel but are not seen in it.
    pub fn shadowed_count(&self) -> usize {
        let seen = self.point_of_pixel.values().iter().filter(|&&point| point != NOWHERE);
        self.return_count() - seen.count()
    }

    /// For each row the angle to the farther of the two rows next to it, radians, by the mean
    /// elevations of a sample of its returns. A row without any has the mean step of all; so has
    /// the only row.
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

    /// Whether the image is that of one sensor at the origin of the cloud's frame.
    pub fn is_plain(&self) -> bool {
        matches!(&self.bands[..], [band] if band.is_at_origin())
    }

    /// Whether nobody knows where a sensor stands, and the image shows what an assumed place would
    /// see: what lies next to each other in it need not in space.
    pub fn is_from_assumed_place(&self) -> bool {
        self.bands.iter().any(|band| band.evidence == Evidence::Assumed)
    }

    /// Number of the band that a row belongs to.
    pub fn band_of_row(&self, row: usize) -> usize {
        self.bands.iter().position(|band| band.rows.contains(&row)).unwrap_or(0)
    }

    /// Where the sensor stands in the cloud's frame, metres; the first of several.
    pub fn sensor_place(&self) -> [f64; 3] {
        self.bands.first().map_or([0.0; 3], |band| band.sensor.translation.vector.into())
    }

    /// The band that a pixel belongs to.
    pub fn band_of(&self, pixel: usize) -> &Band {
        match &self.bands[..] {
            [band] => band,
            bands => &bands[self.band_of_row(pixel / self.columns())],
        }
    }
}

/// For each row of one sensor the angle to the farther of the two next to it, given the elevation
/// of each.
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
