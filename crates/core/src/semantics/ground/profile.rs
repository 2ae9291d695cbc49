//! A range image as columns read from the bottom up.

use super::level::Level;
use crate::cloud::point_cloud::PointCloud;
use crate::range_image::{NOWHERE, RangeImage};

/// One return of a column.
#[derive(Debug, Clone, Copy)]
pub(super) struct Return {
    /// Horizontal place in metres, level frame; NaN without a return.
    pub place: [f32; 2],
    /// Horizontal distance from the sensor in metres; NaN without a return.
    pub distance: f32,
    /// z in metres, level frame; NaN without a return.
    pub height: f32,
    /// The point, or [`NOWHERE`].
    pub point: u32,
}

impl Return {
    const NONE: Return =
        Return { place: [f32::NAN; 2], distance: f32::NAN, height: f32::NAN, point: NOWHERE };

    /// A point at a position of the level frame.
    pub fn new([x, y, z]: [f32; 3], point: u32) -> Self {
        Return { place: [x, y], distance: (x * x + y * y).sqrt(), height: z, point }
    }

    /// x, y and z in metres, level frame.
    pub fn position(&self) -> [f32; 3] {
        [self.place[0], self.place[1], self.height]
    }

    /// Whether there is a return at all.
    pub fn exists(&self) -> bool {
        self.point != NOWHERE
    }
}

/// The returns column by column, each column from the bottom up: the return `up` rows above the
/// bottom of `column` is `returns[column * rows + up]`. (Columns are what every step reads, so they
/// lie together.)
#[derive(Debug)]
pub(super) struct Profile {
    /// Rows H of the image, the length of a column.
    pub rows: usize,
    /// Columns W of the image.
    pub columns: usize,
    /// Whether the first and the last column are neighbours.
    pub wraps: bool,
    /// H x W returns.
    pub returns: Vec<Return>,
    top_row_first: bool,
}

impl Profile {
    /// The profile of an image over `cloud`, turned level.
    pub fn new(cloud: &PointCloud, image: &RangeImage, level: &Level) -> Self {
        let mut profile = Profile {
            rows: image.rows(),
            columns: image.columns(),
            wraps: image.wraps,
            returns: vec![Return::NONE; image.point_of_pixel.len()],
            top_row_first: image.top_row_first != level.is_upside_down,
        };
        for row in 0..profile.rows {
            let up = profile.up(row);
            for (column, &point) in image.point_of_pixel.row(row).iter().enumerate() {
                if point != NOWHERE {
                    profile.returns[column * profile.rows + up] =
                        Return::new(level.turn(cloud.position(point as usize)), point);
                }
            }
        }
        profile
    }

    /// By row from the bottom up: how much steeper its returns look up than those of the row below,
    /// as the difference of the tangents; the lowest row as the one above it.
    pub fn row_steps(&self) -> Vec<f32> {
        const SAMPLES: usize = 64;
        let mut sums = vec![(0.0_f32, 0_u32); self.rows];
        let stride = self.columns.div_ceil(SAMPLES);
        for column in self.returns.chunks_exact(self.rows).step_by(stride) {
            for pair in 1..self.rows {
                let [below, here] = [column[pair - 1], column[pair]];
                if below.exists() && here.exists() {
                    let step = here.height / here.distance - below.height / below.distance;
                    sums[pair] = (sums[pair].0 + step, sums[pair].1 + 1);
                }
            }
        }
        if self.rows > 1 {
            sums[0] = sums[1];
        }
        sums.into_iter().map(|(sum, count)| sum / count as f32).collect()
    }

    fn up(&self, row: usize) -> usize {
        if self.top_row_first { self.rows - 1 - row } else { row }
    }
}
