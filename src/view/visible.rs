//! What of a shape can be seen on a page. Coordinates of a cloud may be anything, and renderers
//! fail on lengths far beyond their page.

/// How far beyond the page shapes are kept, page units: more than half of any line is wide, so that
/// the edge along which a shape is cut is never seen.
const MARGIN: f64 = 64.0;

/// Straight lines from point to point.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline {
    pub points: Vec<[f64; 2]>,
    pub closed: bool,
}

/// The page with its margin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Visible {
    low: [f64; 2],
    high: [f64; 2],
}

impl Visible {
    /// What is visible of a page of a width and a height.
    pub fn of_page(width: f64, height: f64) -> Self {
        Visible { low: [-MARGIN; 2], high: [width + MARGIN, height + MARGIN] }
    }

    /// Whether a point lies on the page or its margin; nothing that is not finite does.
    pub fn holds(&self, point: [f64; 2]) -> bool {
        (0..2).all(|axis| point[axis] >= self.low[axis] && point[axis] <= self.high[axis])
    }

    /// The parts of a path that are visible. A region with a corner that is not finite is none.
    pub fn path(&self, points: &[[f64; 2]], closed: bool) -> Vec<Polyline> {
        if points.iter().all(|&point| self.holds(point)) {
            return vec![Polyline { points: points.to_vec(), closed }];
        }
        match closed {
            true => self.region(points).into_iter().collect(),
            false => self.lines(points),
        }
    }

    /// The lines that are visible of a circle; `None` if it lies within, and stays a circle.
    pub fn circle(&self, centre: [f64; 2], radius: f64) -> Option<Vec<Polyline>> {
        /// Sides of the polygon that stands for a circle: at a radius of ten pages it departs from
        /// the circle by a tenth of a page unit.
        const SIDES: u32 = 720;
        let corners = [-radius, radius].map(|by| centre.map(|along| along + by));
        if corners.iter().all(|&corner| self.holds(corner)) {
            return None;
        }
        if !radius.is_finite() {
            return Some(Vec::new());
        }
        let corner = |side: u32| {
            let (sin, cos) = (f64::from(side) / f64::from(SIDES) * std::f64::consts::TAU).sin_cos();
            [centre[0] + radius * cos, centre[1] + radius * sin]
        };
        Some(self.path(&(0..SIDES).map(corner).collect::<Vec<_>>(), true))
    }

    /// What of a closed polygon is inside (Sutherland and Hodgman 1974).
    fn region(&self, points: &[[f64; 2]]) -> Option<Polyline> {
        let mut points = points.to_vec();
        if points.iter().flatten().any(|along| !along.is_finite()) {
            return None;
        }
        for (axis, limit, sign) in self.sides() {
            let inside = |point: [f64; 2]| (point[axis] - limit) * sign <= 0.0;
            let mut kept = Vec::with_capacity(points.len() + 2);
            for (number, &to) in points.iter().enumerate() {
                let from = points[(number + points.len() - 1) % points.len()];
                if inside(from) != inside(to) {
                    kept.push(crossing(from, to, axis, limit));
                }
                if inside(to) {
                    kept.push(to);
                }
            }
            points = kept;
        }
        (points.len() > 1).then_some(Polyline { points, closed: true })
    }

    /// What of the lines from point to point is inside, cut at each side in turn.
    fn lines(&self, points: &[[f64; 2]]) -> Vec<Polyline> {
        let mut parts: Vec<Polyline> = Vec::new();
        for two in points.windows(2) {
            let Some([from, to]) = self.segment([two[0], two[1]]) else { continue };
            match parts.last_mut().filter(|part| part.points.last() == Some(&from)) {
                Some(part) => part.points.push(to),
                None => parts.push(Polyline { points: vec![from, to], closed: false }),
            }
        }
        parts
    }

    fn segment(&self, [mut from, mut to]: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
        if [from, to].iter().flatten().any(|along| !along.is_finite()) {
            return None;
        }
        for (axis, limit, sign) in self.sides() {
            let inside = |point: [f64; 2]| (point[axis] - limit) * sign <= 0.0;
            match (inside(from), inside(to)) {
                (true, true) => {}
                (false, false) => return None,
                (true, false) => to = crossing(from, to, axis, limit),
                (false, true) => from = crossing(from, to, axis, limit),
            }
        }
        Some([from, to])
    }

    /// Axis, limit, and 1 where what is beyond the limit is larger, else -1.
    fn sides(&self) -> [(usize, f64, f64); 4] {
        let side = |axis: usize| [(axis, self.low[axis], -1.0), (axis, self.high[axis], 1.0)];
        let ([left, right], [top, bottom]) = (side(0), side(1));
        [left, right, top, bottom]
    }
}

/// Where a line crosses a limit of an axis.
fn crossing(from: [f64; 2], to: [f64; 2], axis: usize, limit: f64) -> [f64; 2] {
    // Halves, so that the difference of the largest numbers is a number.
    let part = (limit / 2.0 - from[axis] / 2.0) / (to[axis] / 2.0 - from[axis] / 2.0);
    let other = 1 - axis;
    let mut place = [limit; 2];
    place[other] = from[other] * (1.0 - part) + to[other] * part;
    place
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: Visible = Visible { low: [0.0; 2], high: [10.0; 2] };

    fn parts(points: &[[f64; 2]], closed: bool) -> Vec<Vec<[f64; 2]>> {
        PAGE.path(points, closed).into_iter().map(|part| part.points).collect()
    }

    #[test]
    fn a_shape_on_the_page_stays_and_one_beside_it_goes() {
        let inside = [[1.0, 1.0], [9.0, 1.0], [5.0, 9.0]];
        assert_eq!(parts(&inside, true), [inside.to_vec()]);
        assert_eq!(parts(&inside, false), [inside.to_vec()]);
        let beside = inside.map(|[x, y]| [x + 20.0, y]);
        assert!(parts(&beside, true).is_empty() && parts(&beside, false).is_empty());
    }

    #[test]
    fn lines_are_cut_at_the_sides_and_parted_where_they_leave() {
        let through = [[-10.0, 5.0], [30.0, 5.0]];
        assert_eq!(parts(&through, false), [[[0.0, 5.0], [10.0, 5.0]]]);
        let out_and_back = [[5.0, 5.0], [15.0, 5.0], [15.0, 8.0], [5.0, 8.0]];
        let expected = [[[5.0, 5.0], [10.0, 5.0]], [[10.0, 8.0], [5.0, 8.0]]];
        assert_eq!(parts(&out_and_back, false), expected);
    }

    #[test]
    fn a_region_around_the_page_is_the_page() {
        for far in [100.0, 1e30, f64::MAX] {
            let around = [[-far, -far], [far, -far], [far, far], [-far, far]];
            let parts = parts(&around, true);
            let [x, y] = [0, 1].map(|axis| parts[0].iter().map(move |point| point[axis]));
            assert!(x.chain(y).all(|along| [0.0, 10.0].contains(&along)), "{far}: {parts:?}");
            assert_eq!(parts[0].len(), 4);
        }
    }

    #[test]
    fn what_is_not_finite_is_not_drawn() {
        for wild in [f64::NAN, f64::INFINITY] {
            assert!(parts(&[[1.0, 1.0], [wild, 1.0], [1.0, 9.0]], true).is_empty());
            let rest = parts(&[[1.0, 1.0], [2.0, 1.0], [wild, 1.0], [1.0, 9.0]], false);
            assert_eq!(rest, [[[1.0, 1.0], [2.0, 1.0]]]);
            assert_eq!(PAGE.circle([5.0, 5.0], wild), Some(Vec::new()));
            assert!(!PAGE.holds([wild, 5.0]));
        }
    }

    #[test]
    fn circles_are_cut_as_polygons() {
        assert_eq!(PAGE.circle([5.0, 5.0], 2.0), None);
        assert_eq!(PAGE.circle([50.0, 5.0], 2.0), Some(Vec::new()));
        let arc = PAGE.circle([0.0, 5.0], 4.0).unwrap();
        assert!(arc[0].points.iter().all(|&point| PAGE.holds(point)));
        assert!(arc[0].points.iter().any(|&[x, _]| x > 3.99));
        for far in [1e6, 1e300] {
            for part in PAGE.circle([far, 5.0], far).unwrap() {
                assert!(part.points.iter().all(|&point| PAGE.holds(point)));
            }
        }
    }
}
