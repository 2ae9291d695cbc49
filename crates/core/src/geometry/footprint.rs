//! Regions on the bird's-eye plane: convex hulls, minimum-area rectangles, and whether two overlap.

/// A point on the bird's-eye plane: x and y in metres.
pub type PlanePoint = [f64; 2];

/// A rectangle on the bird's-eye plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// Centre in metres.
    pub centre: PlanePoint,
    /// Side lengths in metres, the longer first.
    pub size: [f64; 2],
    /// Direction of the longer side in radians from the x axis, in (-pi/2, pi/2].
    pub yaw: f64,
}

impl Rectangle {
    /// The rectangle whose one side has the direction `yaw`, in radians, and the other stands
    /// across it.
    pub fn new(centre: PlanePoint, [along, across]: [f64; 2], yaw: f64) -> Self {
        use std::f64::consts::{FRAC_PI_2, PI};
        let (size, yaw) = match along < across {
            true => ([across, along], yaw + FRAC_PI_2),
            false => ([along, across], yaw),
        };
        let yaw = yaw.rem_euclid(PI);
        Rectangle { centre, size, yaw: if yaw > FRAC_PI_2 { yaw - PI } else { yaw } }
    }

    /// The four corners in counter-clockwise order.
    pub fn corners(&self) -> [PlanePoint; 4] {
        let (sin, cos) = self.yaw.sin_cos();
        let [along, across] = self.size.map(|side| side / 2.0);
        [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(a, b)| {
            let (u, v) = (a * along, b * across);
            [self.centre[0] + u * cos - v * sin, self.centre[1] + u * sin + v * cos]
        })
    }
}

/// The convex hull in counter-clockwise order, without collinear points (Andrew's monotone chain,
/// O(n log n)). One point or two give themselves.
pub fn convex_hull(points: &[PlanePoint]) -> Vec<PlanePoint> {
    let mut sorted = outer_points(points);
    sorted.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let mut hull: Vec<PlanePoint> = Vec::with_capacity(16);
    let extend = |hull: &mut Vec<PlanePoint>, floor: usize, point: PlanePoint| {
        while hull.len() >= floor + 2
            && cross(hull[hull.len() - 2], hull[hull.len() - 1], point) <= 0.0
        {
            hull.pop();
        }
        hull.push(point);
    };
    for &point in &sorted {
        extend(&mut hull, 0, point);
    }
    let lower = hull.len() - 1;
    for &point in sorted.iter().rev().skip(1) {
        extend(&mut hull, lower, point);
    }
    hull.pop();
    hull
}

/// The points that are not strictly inside the octagon of the extreme points in eight directions;
/// none of the others is on the hull (Akl and Toussaint 1978).
fn outer_points(points: &[PlanePoint]) -> Vec<PlanePoint> {
    const FEW: usize = 16;
    if points.len() <= FEW {
        return points.to_vec();
    }
    // Directions 0, 45, 90 and 135 degrees, each with its least and greatest point.
    let keys = |p: &PlanePoint| [p[0], p[0] + p[1], p[1], p[1] - p[0]];
    let mut least = [points[0]; 4];
    let mut greatest = [points[0]; 4];
    let (mut low, mut high) = (keys(&points[0]), keys(&points[0]));
    for point in points {
        for (direction, key) in keys(point).into_iter().enumerate() {
            if key < low[direction] {
                (low[direction], least[direction]) = (key, *point);
            } else if key > high[direction] {
                (high[direction], greatest[direction]) = (key, *point);
            }
        }
    }
    let octagon = [greatest, least].concat();
    if octagon.iter().all(|corner| *corner == octagon[0]) {
        return vec![octagon[0]];
    }
    let is_inside = |p: PlanePoint| {
        (0..8).all(|i| {
            let (from, to) = (octagon[i], octagon[(i + 1) % 8]);
            from == to || cross(from, to, p) > 0.0
        })
    };
    points.iter().copied().filter(|&p| !is_inside(p)).collect()
}

fn cross(origin: PlanePoint, a: PlanePoint, b: PlanePoint) -> f64 {
    (a[0] - origin[0]) * (b[1] - origin[1]) - (a[1] - origin[1]) * (b[0] - origin[0])
}

/// Area of a convex region in square metres (shoelace formula).
pub fn area(hull: &[PlanePoint]) -> f64 {
    let Some(&first) = hull.first() else {
        return 0.0;
    };
    hull.windows(2).map(|side| cross(first, side[0], side[1])).sum::<f64>() / 2.0
}

/// The rectangle of least area around a convex hull; one of its sides lies along a side of the hull
/// (Freeman and Shapira 1975). `None` of an empty hull. O(h^2) in the corners of the hull.
pub fn minimum_area_rectangle(hull: &[PlanePoint]) -> Option<Rectangle> {
    let first = *hull.first()?;
    if hull.len() == 1 {
        return Some(Rectangle { centre: first, size: [0.0, 0.0], yaw: 0.0 });
    }
    let spans = (0..hull.len()).map(|i| {
        let (a, b) = (hull[i], hull[(i + 1) % hull.len()]);
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let axis = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
        (axis, span(hull, axis), span(hull, [-axis[1], axis[0]]))
    });
    let area = |u: (f64, f64), v: (f64, f64)| (u.1 - u.0) * (v.1 - v.0);
    spans
        .min_by(|a, b| area(a.1, a.2).total_cmp(&area(b.1, b.2)))
        .map(|(axis, u, v)| rectangle(axis, u, v))
}

/// The rectangle that spans `u` along a unit axis and `v` to the left of it.
fn rectangle([cos, sin]: [f64; 2], u: (f64, f64), v: (f64, f64)) -> Rectangle {
    let middle = [(u.0 + u.1) / 2.0, (v.0 + v.1) / 2.0];
    let centre = [middle[0] * cos - middle[1] * sin, middle[0] * sin + middle[1] * cos];
    Rectangle::new(centre, [u.1 - u.0, v.1 - v.0], sin.atan2(cos))
}

/// Least and greatest coordinate along an axis.
pub fn span(points: &[PlanePoint], axis: [f64; 2]) -> (f64, f64) {
    /// So many at a time, since each comparison waits for the one before.
    const LANES: usize = 4;
    let along = |p: &PlanePoint| p[0] * axis[0] + p[1] * axis[1];
    let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
    let (whole, rest) = points.as_chunks::<LANES>();
    for chunk in whole {
        let at = chunk.each_ref().map(along);
        for lane in 0..LANES {
            low[lane] = if at[lane] < low[lane] { at[lane] } else { low[lane] };
            high[lane] = if at[lane] > high[lane] { at[lane] } else { high[lane] };
        }
    }
    for (lane, point) in rest.iter().enumerate() {
        (low[lane], high[lane]) = (low[lane].min(along(point)), high[lane].max(along(point)));
    }
    (low.into_iter().fold(low[0], f64::min), high.into_iter().fold(high[0], f64::max))
}

/// Whether two convex regions touch or overlap (separating axes), their corners in
/// counter-clockwise order. Points and segments count as regions.
pub fn overlap(a: &[PlanePoint], b: &[PlanePoint]) -> bool {
    !a.is_empty() && !b.is_empty() && !separated_by_a_side(a, b) && !separated_by_a_side(b, a)
}

/// Distance between two convex regions in metres, 0 where they touch or overlap; infinite from an
/// empty region.
pub fn distance(a: &[PlanePoint], b: &[PlanePoint]) -> f64 {
    if overlap(a, b) {
        return 0.0;
    }
    corners_to_sides(a, b).min(corners_to_sides(b, a)).sqrt()
}

/// Least squared distance from the corners of one region to the sides of another.
fn corners_to_sides(corners: &[PlanePoint], region: &[PlanePoint]) -> f64 {
    let mut least = f64::INFINITY;
    let mut from = match region.last() {
        Some(&last) => last,
        None => return least,
    };
    for &to in region {
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0] * along[0] + along[1] * along[1];
        let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
        for corner in corners {
            let [x, y] = [corner[0] - from[0], corner[1] - from[1]];
            let t = ((x * along[0] + y * along[1]) * scale).clamp(0.0, 1.0);
            let (x, y) = (x - t * along[0], y - t * along[1]);
            least = least.min(x * x + y * y);
        }
        from = to;
    }
    least
}

fn separated_by_a_side(a: &[PlanePoint], b: &[PlanePoint]) -> bool {
    let apart = |axis: [f64; 2]| {
        let (a, b) = (span(a, axis), span(b, axis));
        a.1 < b.0 || b.1 < a.0
    };
    if apart([1.0, 0.0]) || apart([0.0, 1.0]) {
        return true;
    }
    (0..a.len()).any(|i| {
        let (from, to) = (a[i], a[(i + 1) % a.len()]);
        let side = [to[0] - from[0], to[1] - from[1]];
        side != [0.0, 0.0]
            && (b.iter().all(|&p| cross(from, to, p) < 0.0) || (a.len() == 2 && apart(side)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hull_of_a_square_with_points_inside_and_on_its_sides() {
        let points =
            [[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [2.0, 2.0], [1.0, 1.0], [0.0, 2.0], [0.0, 0.0]];
        let hull = convex_hull(&points);
        assert_eq!(hull, [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
    }

    #[test]
    fn hull_of_many_points_in_one_place() {
        assert_eq!(convex_hull(&[[3.0, -1.0]; 40]), [[3.0, -1.0]]);
    }

    proptest::proptest! {
        /// Against the extents along the sides of both, to all sides.
        #[test]
        fn regions_apart_are_told_by_their_outer_sides(
            corners in proptest::collection::vec((-8..8_i8, -8..8_i8), 2..12),
            split in 1..11_usize,
        ) {
            let points: Vec<PlanePoint> =
                corners.iter().map(|&(x, y)| [f64::from(x), f64::from(y)]).collect();
            let (one, other) = points.split_at(split.min(points.len() - 1));
            let (one, other) = (convex_hull(one), convex_hull(other));
            let mut axes = vec![[1.0, 0.0], [0.0, 1.0]];
            for hull in [&one, &other] {
                for (from, to) in hull.iter().zip(hull.iter().cycle().skip(1)) {
                    let [x, y] = [to[0] - from[0], to[1] - from[1]];
                    axes.extend([[-y, x], [x, y]]);
                }
            }
            let is_apart = axes.into_iter().any(|axis| {
                let (a, b) = (span(&one, axis), span(&other, axis));
                a.1 < b.0 || b.1 < a.0
            });
            proptest::prop_assert_eq!(overlap(&one, &other), !is_apart);
        }

        #[test]
        fn a_span_is_from_the_least_to_the_greatest(
            values in proptest::collection::vec(-50..50_i8, 1..15),
        ) {
            let points: Vec<PlanePoint> = values.iter().map(|&v| [f64::from(v), 7.0]).collect();
            let [least, greatest] = [values.iter().min(), values.iter().max()]
                .map(|value| f64::from(*value.expect("there are values")));
            proptest::prop_assert_eq!(span(&points, [1.0, 0.0]), (least, greatest));
        }

        /// Few distinct coordinates, so that many points coincide or lie on a line.
        #[test]
        fn discarding_inner_points_changes_no_hull(
            grid in proptest::collection::vec((0..12_u8, 0..12_u8), 17..80),
        ) {
            let points: Vec<PlanePoint> =
                grid.iter().map(|&(x, y)| [f64::from(x), f64::from(y)]).collect();
            let hull = convex_hull(&points);
            let is_outside = |p: &PlanePoint| {
                (0..hull.len()).any(|i| cross(hull[i], hull[(i + 1) % hull.len()], *p) < 0.0)
            };
            assert!(hull.len() < 3 || !points.iter().any(is_outside), "{hull:?} of {points:?}");
            assert!(hull.iter().all(|corner| points.contains(corner)));
        }
    }

    #[test]
    fn rectangle_of_a_turned_box() {
        let truth = Rectangle { centre: [3.0, -1.0], size: [4.0, 1.5], yaw: 0.6 };
        let found = minimum_area_rectangle(&convex_hull(&truth.corners())).unwrap();
        assert!((found.yaw - truth.yaw).abs() < 1e-9, "{found:?}");
        for axis in 0..2 {
            assert!((found.centre[axis] - truth.centre[axis]).abs() < 1e-9);
            assert!((found.size[axis] - truth.size[axis]).abs() < 1e-9);
        }
    }

    #[test]
    fn diagonal_neighbours_do_not_overlap_though_their_boxes_do() {
        let car = |x: f64| Rectangle { centre: [x, 0.0], size: [4.5, 1.8], yaw: 1.0 }.corners();
        assert!(!overlap(&car(0.0), &car(2.6)));
        assert!(overlap(&car(0.0), &car(1.5)));
    }

    #[test]
    fn areas_by_hand() {
        assert_eq!(area(&[[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]]), 6.0);
        assert_eq!(area(&[[0.0, 0.0], [3.0, 0.0]]), 0.0);
        assert_eq!(area(&[]), 0.0);
    }

    #[test]
    fn distances_by_hand() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert_eq!(distance(&square, &[[0.5, 0.5]]), 0.0);
        assert_eq!(distance(&square, &[[4.0, 5.0]]), 5.0);
        assert_eq!(distance(&[[3.0, -9.0], [3.0, 9.0]], &square), 2.0);
        assert_eq!(distance(&square, &[]), f64::INFINITY);
    }

    #[test]
    fn points_and_segments_are_regions() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert!(overlap(&[[0.5, 0.5]], &square));
        assert!(!overlap(&[[1.5, 0.5]], &square));
        assert!(overlap(&[[0.5, 0.5], [3.0, 0.5]], &square));
        assert!(!overlap(&[[2.0, 0.0], [3.0, 0.0]], &[[0.0, 0.0], [1.0, 0.0]]));
        assert!(overlap(&[[1.0, 1.0]], &[[1.0, 1.0]]));
        assert!(!overlap(&[[1.0, 1.0]], &[[1.0, 1.1]]));
    }
}
