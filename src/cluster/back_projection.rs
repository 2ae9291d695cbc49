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
    if image.is_shadowed(point) {
        nearest_object(cloud, image, objects, point, mask.class[point], window)
    } else {
        image.pixel_of(point).and_then(|pixel| objects.at(pixel))
    }
}

/// The object pixel of a class nearest to a point in the window around the point's own pixel. Columns wrap
/// where the image does. Ties go to the nearer column, then to the left, then upwards.
fn nearest_object(
    cloud: &PointCloud,
    image: &RangeImage,
    objects: &ObjectPixels,
    point: usize,
    class: u16,
    window: BackProjection,
) -> Option<usize> {
    let own = image.pixel_of(point)?;
    let columns = image.columns();
    let (row, column) = (own / columns, own % columns);
    let rows = row.saturating_sub(window.rows)..=(row + window.rows).min(image.rows() - 1);
    let half = window.columns.min((columns - 1) / 2) as isize;
    let position = cloud.position(point);
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
            let object = objects.at(row * columns + column as usize);
            let Some(object) = object.filter(|&object| objects.class[object] == class) else {
                continue;
            };
            let distance = distance(position, objects.position[object], window.nearest);
            if best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, object));
            }
        }
    }
    best.map(|(_, object)| object)
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

/// Anything that orders as the distance of two positions (metres) does.
fn distance(a: [f32; 3], b: [f32; 3], nearest: Nearest) -> f64 {
    let (a, b) = (a.map(f64::from), b.map(f64::from));
    let squared = |[x, y, z]: [f64; 3]| x * x + y * y + z * z;
    match nearest {
        Nearest::Range => (squared(a).sqrt() - squared(b).sqrt()).abs(),
        Nearest::Space => squared([a[0] - b[0], a[1] - b[1], a[2] - b[2]]),
    }
}
