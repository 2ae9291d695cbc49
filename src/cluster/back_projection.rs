//! Back from pixels to points: what a shadowed point takes from the pixels around it (ALGORITHM section 6).

use super::objects::ObjectPixels;
use super::params::{BackProjection, Nearest};
use crate::cloud::PointCloud;
use crate::range_image::RangeImage;
use crate::semantics::ObjectMask;

/// The object pixel whose label a point of an object takes: its own, or if it is shadowed the nearest of its
/// class. `None` for points that are no objects, and for shadowed ones without a match.
pub fn label_source(
    cloud: &PointCloud,
    image: &RangeImage,
    mask: &ObjectMask,
    objects: &ObjectPixels,
    point: usize,
    window: BackProjection,
) -> Option<usize> {
    if !mask.is_object[point] {
        return None;
    }
    let pixel = if image.is_shadowed(point) {
        nearest_pixel(cloud, image, point, window, |pixel| {
            objects.at(pixel).is_some_and(|object| objects.class[object] == mask.class[point])
        })
    } else {
        image.pixel_of(point)
    };
    pixel.and_then(|pixel| objects.at(pixel))
}

/// The pixel nearest to a point among the pixels of the window around the point's own pixel that
/// `accepts` allows. Columns wrap where the image does. Ties go to the nearer column, then to the left,
/// then upwards.
fn nearest_pixel(
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
    for offset in (0..=half).flat_map(|o| [-o, o]).skip(1) {
        if best
            .is_some_and(|(least, _)| least < least_distance(cloud, image, point, offset, window))
        {
            break;
        }
        let column = column as isize + offset;
        let column = if image.wraps { column.rem_euclid(columns as isize) } else { column };
        if !(0..columns as isize).contains(&column) {
            continue;
        }
        for row in rows.clone() {
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

/// No point so many columns away, or farther, is nearer than this: its ray leaves in another direction.
fn least_distance(
    cloud: &PointCloud,
    image: &RangeImage,
    point: usize,
    offset: isize,
    window: BackProjection,
) -> f64 {
    if window.nearest == Nearest::Range {
        return 0.0;
    }
    let between = (offset.unsigned_abs().saturating_sub(1)) as f64;
    let angle = (between * std::f64::consts::TAU / image.columns() as f64).min(1.5);
    let [x, y, _] = cloud.position(point).map(f64::from);
    (x * x + y * y) * angle.sin().powi(2)
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
