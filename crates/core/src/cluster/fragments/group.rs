//! Groups of pieces with their outlines on the bird's-eye plane, and how two of them compare with
//! the size of their class.

use serde::Serialize;

use crate::cloud::taxonomy::ClassSize;
use crate::cluster::params::FragmentMerge;
use crate::geometry::footprint::{
    PlanePoint, Rectangle, area, convex_hull, minimum_area_rectangle, span,
};

/// One piece of an object: its class and its outline on the bird's-eye plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Fragment {
    /// Its class.
    pub class: FragmentClass,
    /// Convex hull in metres; empty for a piece without points.
    pub hull: Vec<PlanePoint>,
    /// Its pixels.
    pub pixels: u32,
}

/// A class, the classes that it is confused with, and the usual size of its objects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FragmentClass {
    /// Class number.
    pub number: u16,
    /// Number of the family of classes that may be one object.
    pub family: u16,
    /// A bit for each group of look-alikes that the class is in; classes that share one may be one
    /// object where they touch.
    pub lookalikes: u8,
    /// Usual size of the class; pieces of a class without one are left alone.
    pub size: Option<ClassSize>,
}

impl FragmentClass {
    /// Whether pieces of the two classes may be one object: they are of one family or look alike.
    pub fn may_be_one_with(self, other: FragmentClass) -> bool {
        self.family == other.family || self.lookalikes & other.lookalikes != 0
    }
}

/// Pieces that have been put together. The class is that of the larger part.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    pub(super) hull: Vec<PlanePoint>,
    pub(super) low: PlanePoint,
    pub(super) high: PlanePoint,
    /// Square metres within the hull.
    pub(super) area: f64,
    /// Pixels of its pieces.
    pub(super) pixels: u32,
    /// Class of its larger part.
    pub(super) class: FragmentClass,
    /// How often it has grown; a candidate that knew it smaller is out of date.
    pub(super) version: u32,
}

impl Group {
    pub(super) fn of_piece(piece: &Fragment) -> Self {
        Group::new(piece.hull.clone(), piece.pixels, piece.class)
    }

    pub(super) fn new(hull: Vec<PlanePoint>, pixels: u32, class: FragmentClass) -> Self {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for corner in &hull {
            for axis in 0..2 {
                low[axis] = low[axis].min(corner[axis]);
                high[axis] = high[axis].max(corner[axis]);
            }
        }
        let area = area(&hull);
        Group { hull, low, high, area, pixels, class, version: 0 }
    }

    /// Class of the larger of two groups, and so of their union.
    pub(super) fn class_of_larger(&self, other: &Group) -> FragmentClass {
        if other.pixels > self.pixels { other.class } else { self.class }
    }

    /// Whether the rectangle of least area around two groups is surely no wider than that, metres.
    ///
    /// A wider one, of a length L and a width over `widest`, has an area over L times that, and
    /// reaches as far as the groups do: L^2 + widest^2 is at least the square of their length. So
    /// there is none if any rectangle around both has a smaller area; here one along their longest
    /// side.
    pub(super) fn is_narrow_with(&self, other: &Group, widest: f64) -> bool {
        let hulls = [&self.hull[..], &other.hull];
        let sides = hulls.iter().flat_map(|hull| hull.iter().zip(hull.iter().cycle().skip(1)));
        let squared = |[x, y]: PlanePoint| x * x + y * y;
        let sides = sides.map(|(from, to)| [to[0] - from[0], to[1] - from[1]]);
        let longest = sides.reduce(|a, b| if squared(a) < squared(b) { b } else { a });
        let Some([x, y]) = longest.filter(|&side| side != [0.0; 2]) else {
            return false;
        };
        let extent = |axis: PlanePoint| {
            let [one, two] = hulls.map(|hull| span(hull, axis));
            one.1.max(two.1) - one.0.min(two.0)
        };
        // Both are longer than they are by the length of the side.
        let scale = squared([x, y]);
        let (along, across) = (extent([x, y]), extent([-y, x]));
        let shortest = (along * along / scale - widest * widest).max(widest * widest).sqrt();
        along * across / scale < widest * shortest
    }

    /// The rectangle of least area around two groups.
    pub(super) fn rectangle_with(&self, other: &Group) -> Option<Rectangle> {
        let corners = [&self.hull[..], &other.hull].concat();
        minimum_area_rectangle(&convex_hull(&corners))
    }

    /// Whether the classes of the two groups may be one object.
    pub fn may_be_one_with(&self, other: &Group) -> bool {
        self.class.may_be_one_with(other.class)
    }

    /// How two groups compare with the size of their class. `None` where it is of no known size.
    pub fn compare(&self, other: &Group, params: &FragmentMerge) -> Option<SizeTest> {
        let size = self.class_of_larger(other).size?;
        let gap = crate::geometry::footprint::distance(&self.hull, &other.hull);
        SizeTest::new([self, other], gap, size, params)
    }
}

/// Two outlines against the usual size of their class.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SizeTest {
    /// Distance between the outlines, metres.
    pub gap: f64,
    /// Up to so far apart they are one unless the rectangle is too wide, metres.
    pub touching: f64,
    /// From this far apart on they are never compared, metres.
    pub too_far: f64,
    /// The widest rectangle around outlines that touch, metres; what is wider are two side by side.
    pub widest: f64,
    /// Sides of the rectangle around both, metres, the longer first.
    pub union: [f64; 2],
    /// The longest sides accepted across that gap, metres.
    pub limit: [f64; 2],
}

impl SizeTest {
    /// Measures two groups that lie `gap` metres apart; `size` is that of their class.
    pub(super) fn new(
        [one, other]: [&Group; 2],
        gap: f64,
        size: ClassSize,
        params: &FragmentMerge,
    ) -> Option<Self> {
        Some(SizeTest {
            gap,
            touching: params.touching_gap(size),
            too_far: params.bridged_gap(size),
            widest: params.widest(size),
            union: one.rectangle_with(other)?.size,
            limit: params.longest_sides(size, gap),
        })
    }

    /// Whether the rectangle is no wider than one object may be.
    pub(super) fn is_narrow(&self) -> bool {
        self.union[1] <= self.widest
    }

    /// Whether the rectangle is no longer and no wider than an object of the class across that gap.
    pub(super) fn fits(&self) -> bool {
        self.union[0] <= self.limit[0] && self.union[1] <= self.limit[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::footprint::PlanePoint;

    fn group(points: &[PlanePoint]) -> Group {
        let class = FragmentClass { number: 1, family: 1, lookalikes: 0, size: None };
        Group::new(convex_hull(points), points.len() as u32, class)
    }

    #[test]
    fn a_car_is_narrow_and_two_side_by_side_are_not() {
        let car = |turn: f64, beside: f64| {
            let corners = Rectangle::new([0.0, beside], [4.5, 1.9], 0.0).corners();
            let (sin, cos) = turn.sin_cos();
            group(&corners.map(|[x, y]| [x * cos - y * sin, x * sin + y * cos]))
        };
        for turn in [0.0, 0.3, 1.0, 2.5] {
            assert!(car(turn, 0.0).is_narrow_with(&car(turn, 0.1), 2.85));
            assert!(!car(turn, 0.0).is_narrow_with(&car(turn, 2.0), 2.85));
        }
    }

    proptest::proptest! {
        #[test]
        fn what_is_surely_narrow_is_narrow(
            points in proptest::collection::vec((-40..40_i8, -40..40_i8), 2..14),
            widest in 1..60_u8,
        ) {
            let points: Vec<PlanePoint> =
                points.into_iter().map(|(x, y)| [f64::from(x) / 8.0, f64::from(y) / 8.0]).collect();
            let (one, other) = points.split_at(points.len() / 2);
            let (one, other) = (group(one), group(other));
            let widest = f64::from(widest) / 8.0;
            if one.is_narrow_with(&other, widest) {
                let rectangle = one.rectangle_with(&other).expect("there are points");
                proptest::prop_assert!(rectangle.size[1] <= widest, "{:?}", rectangle);
            }
        }
    }
}
