//! Back from pixels to points: what a shadowed point takes from the pixels around it (ALGORITHM
//! section 6).

use super::method::MethodInput;
use super::params::Nearest;
use crate::cloud::point_cloud::wide;

/// A shadowed point farther than this many lengths of its class from the nearest pixel belongs to
/// another object.
const BEYOND: f64 = 1.5;

/// Finds the object pixel whose label a point takes.
#[derive(Debug)]
pub struct BackProjector<'a> {
    input: &'a MethodInput<'a>,
    /// H x W: the object pixel at each pixel, or [`NO_OBJECT`]; read many times a point.
    object: Vec<u32>,
    /// H: cosine and sine of the lowest and of the highest direction in which a row has an object
    /// pixel; empty where the nearest is not looked for in space.
    edges: Vec<[[f64; 2]; 2]>,
    /// Squared sine of the angle between two pixels so many columns apart, at the least.
    squared_sine: Vec<f64>,
}

const NO_OBJECT: u32 = u32::MAX;

impl<'a> BackProjector<'a> {
    /// Writes down where the object pixels are.
    pub fn new(input: &'a MethodInput<'a>) -> Self {
        let (rows, columns) = (input.image.rows(), input.image.columns());
        let mut object = vec![NO_OBJECT; rows * columns];
        for (number, &pixel) in (0..).zip(&input.objects.pixel) {
            object[pixel as usize] = number;
        }
        let farthest = input.back_projection.columns.min(columns.saturating_sub(1) / 2);
        let squared_sine = (0..=farthest).map(|offset| {
            let between = offset.saturating_sub(1) as f64;
            (between * std::f64::consts::TAU / columns as f64).min(1.5).sin().powi(2)
        });
        let squared_sine = squared_sine.collect();
        let edges = match input.back_projection.nearest {
            Nearest::Space => edges(input),
            Nearest::Range => Vec::new(),
        };
        BackProjector { input, object, edges, squared_sine }
    }

    /// The object pixel whose label a point of an object takes: its own, or if it is shadowed the
    /// nearest of its class, with [`Nearest::Space`] else of its family. `None` for points that are
    /// no objects, and for shadowed ones without a match: with [`Nearest::Space`] also for those
    /// far beyond the length of their class.
    pub fn source(&self, point: usize) -> Option<usize> {
        let MethodInput { image, mask, objects, back_projection: window, .. } = *self.input;
        if !mask.is_object[point] {
            return None;
        }
        if !image.is_shadowed(point) {
            return image.pixel_of(point).and_then(|pixel| self.at(pixel));
        }
        let class = mask.class[point];
        let by_space = window.nearest == Nearest::Space;
        let size = mask.sizes[usize::from(class)].filter(|_| by_space);
        let in_reach = |&(_, distance): &(usize, f64)| {
            size.is_none_or(|size| distance <= (BEYOND * size.length).powi(2))
        };
        let found = self.nearest(point, |object| objects.class[object] == class).filter(in_reach);
        // One object may carry several classes of a family.
        let family = mask.families[usize::from(class)];
        let is_family = |object: usize| objects.family[object] == family;
        let of_family = || self.nearest(point, is_family).filter(in_reach);
        let found = found.or_else(|| by_space.then(of_family).flatten());
        found.map(|(object, _)| object)
    }

    /// The object pixel of a class nearest to a point in the window around the point's own pixel,
    /// and its [`distance`]. Columns wrap where the image does. Ties go to the nearer column, then
    /// to the left, then upwards.
    fn nearest(&self, point: usize, is_kin: impl Fn(usize) -> bool) -> Option<(usize, f64)> {
        let MethodInput { cloud, image, objects, back_projection: window, .. } = *self.input;
        let own = image.pixel_of(point)?;
        let columns = image.columns();
        let (row, column) = (own / columns, own % columns);
        let band = image.band_of(own);
        let highest = row.saturating_sub(window.rows).max(band.rows.start);
        let mut rows = highest..(row + window.rows + 1).min(band.rows.end);
        let position = cloud.position(point);
        let [x, y, z] = band.from_sensor(wide(position));
        let (squared, in_space) = (x * x + y * y, window.nearest == Nearest::Space);
        let on_plane = squared.sqrt();
        let apart = |object: usize| distance(position, objects.position[object], window.nearest);
        // Mostly near: what shadows the point itself.
        let shadowing = self.at(own).filter(|&object| is_kin(object)).map_or(f64::INFINITY, apart);
        let mut best: Option<(f64, usize)> = None;
        for (offset, sine) in self.squared_sine.iter().enumerate() {
            // No pixel so many columns away, or farther, is nearer than this, since its ray leaves
            // in another direction.
            let bound = if in_space { squared * sine } else { 0.0 };
            if in_space {
                let least = best.map_or(shadowing, |(least, _)| least.min(shadowing));
                let is_beyond = |row: usize| self.beyond(row, [on_plane, z]) > least;
                while rows.start < rows.end && is_beyond(rows.start) {
                    rows.start += 1;
                }
                while rows.start < rows.end && is_beyond(rows.end - 1) {
                    rows.end -= 1;
                }
            }
            for column in sides(column, offset, columns, image.wraps).into_iter().flatten() {
                if best.is_some_and(|(least, _)| least < bound) {
                    return best.map(|(distance, object)| (object, distance));
                }
                for row in rows.clone() {
                    let object = self.at(row * columns + column);
                    let Some(object) = object.filter(|&object| is_kin(object)) else {
                        continue;
                    };
                    let distance = apart(object);
                    if best.is_none_or(|(least, _)| distance < least) {
                        best = Some((distance, object));
                    }
                }
            }
        }
        best.map(|(distance, object)| (object, distance))
    }

    /// The square of a distance in metres: no object pixel of a row is nearer than this to a place
    /// that is seen so far away on the plane and so high.
    fn beyond(&self, row: usize, [on_plane, height]: [f64; 2]) -> f64 {
        /// More than rounding may add up to, metres.
        const ROUNDING: f64 = 1e-3;
        let [lowest, highest] = self.edges[row];
        let over = height * highest[0] - on_plane * highest[1];
        let under = on_plane * lowest[1] - height * lowest[0];
        (over.max(under) - ROUNDING).max(0.0).powi(2)
    }

    fn at(&self, pixel: usize) -> Option<usize> {
        Some(self.object[pixel]).filter(|&object| object != NO_OBJECT).map(|object| object as usize)
    }
}

/// Cosine and sine of the lowest and of the highest direction in which each row has an object
/// pixel, seen from its sensor.
fn edges(input: &MethodInput) -> Vec<[[f64; 2]; 2]> {
    let MethodInput { image, objects, .. } = *input;
    let mut slopes = vec![[f32::MAX, f32::MIN]; image.rows()];
    let (mut row, mut next) = (0, 0);
    for (&pixel, &position) in objects.pixel.iter().zip(&objects.position) {
        while pixel as usize >= next {
            row = next / image.columns();
            next += image.columns();
        }
        let [x, y, z] = image.bands[image.band_of_row(row)].from_sensor(wide(position));
        let slope = (z / (x * x + y * y).sqrt()) as f32;
        slopes[row] = [slopes[row][0].min(slope), slopes[row][1].max(slope)];
    }
    let direction = |slope: f32| {
        let cosine = (1.0 + f64::from(slope).powi(2)).sqrt().recip();
        [cosine, f64::from(slope) * cosine]
    };
    slopes.into_iter().map(|slopes| slopes.map(direction)).collect()
}

/// The columns `offset` to the left and to the right of a column; 0 to the left is the column
/// itself.
fn sides(column: usize, offset: usize, columns: usize, wraps: bool) -> [Option<usize>; 2] {
    let left = column.checked_sub(offset);
    let right = Some(column + offset).filter(|&right| right < columns);
    match offset {
        0 => [left, None],
        _ if wraps => [
            left.or(Some(column + columns - offset)),
            right.or_else(|| (column + offset).checked_sub(columns)),
        ],
        _ => [left, right],
    }
}

/// Anything that orders as the distance of two positions (metres) does; in space its square.
fn distance(a: [f32; 3], b: [f32; 3], nearest: Nearest) -> f64 {
    let (a, b) = (wide(a), wide(b));
    let squared = |[x, y, z]: [f64; 3]| x * x + y * y + z * z;
    match nearest {
        Nearest::Range => (squared(a).sqrt() - squared(b).sqrt()).abs(),
        Nearest::Space => squared([a[0] - b[0], a[1] - b[1], a[2] - b[2]]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_wrap_where_the_image_does() {
        assert_eq!(sides(3, 0, 10, true), [Some(3), None]);
        assert_eq!(sides(3, 2, 10, true), [Some(1), Some(5)]);
        assert_eq!(sides(1, 3, 10, true), [Some(8), Some(4)]);
        assert_eq!(sides(8, 4, 10, true), [Some(4), Some(2)]);
        assert_eq!(sides(1, 3, 10, false), [None, Some(4)]);
        assert_eq!(sides(8, 4, 10, false), [Some(4), None]);
    }
}
