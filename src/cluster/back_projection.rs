//! Back from pixels to points: what a shadowed point takes from the pixels around it (ALGORITHM section 6).

use super::params::{BackProjection, Nearest};
use crate::cloud::PointCloud;
use crate::range_image::RangeImage;

/// The pixel nearest to a point among the pixels of the window around the point's own pixel that
/// `accepts` allows. Columns wrap where the image does. Ties go to the first in row-major order of the
/// window.
pub fn nearest_pixel(
    cloud: &PointCloud,
    image: &RangeImage,
    point: usize,
    window: BackProjection,
    accepts: impl Fn(usize) -> bool,
) -> Option<usize> {
    let own = image.pixel_of(point)?;
    let columns = image.columns();
    let (row, column) = (own / columns, own % columns);
    let rows = row.saturating_sub(window.rows)..=(row + window.rows).min(image.rows() - 1);
    let half = window.columns.min((columns - 1) / 2) as isize;
    let mut best: Option<(f64, usize)> = None;
    for row in rows {
        for offset in -half..=half {
            let column = column as isize + offset;
            let column = if image.wraps {
                column.rem_euclid(columns as isize)
            } else if (0..columns as isize).contains(&column) {
                column
            } else {
                continue;
            };
            let pixel = row * columns + column as usize;
            let Some(other) = image.point_at(pixel).filter(|_| accepts(pixel)) else {
                continue;
            };
            let distance = distance(cloud, point, other, window.nearest);
            if best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, pixel));
            }
        }
    }
    best.map(|(_, pixel)| pixel)
}

/// Anything that orders as the distance does.
fn distance(cloud: &PointCloud, a: usize, b: usize, nearest: Nearest) -> f64 {
    match nearest {
        Nearest::Range => (cloud.squared_range(a).sqrt() - cloud.squared_range(b).sqrt()).abs(),
        Nearest::Space => {
            let (a, b) = (cloud.position(a), cloud.position(b));
            let along = |axis: usize| f64::from(a[axis]) - f64::from(b[axis]);
            (0..3).map(|axis| along(axis) * along(axis)).sum()
        }
    }
}
