//! Convex shapes and where a ray enters and leaves them.

use nalgebra::{Point3, Vector3};

/// A half-line; `direction` has unit length, so that parameters along it are metres.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    pub origin: Point3<f64>,
    pub direction: Vector3<f64>,
}

impl Ray {
    /// The point `range` metres along the ray.
    pub fn at(&self, range: f64) -> Point3<f64> {
        self.origin + self.direction * range
    }
}

/// A plane as outward unit normal and its distance from the origin along that normal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    normal: Vector3<f64>,
    offset: f64,
}

/// A convex solid in its object's frame, metres.
#[derive(Debug, Clone)]
pub(super) enum Shape {
    /// What lies behind all planes, and a box that it fits into.
    Hull { planes: Vec<Plane>, low: Point3<f64>, high: Point3<f64> },
    /// An ellipsoid with axes along x, y and z.
    Ellipsoid { centre: Point3<f64>, semi_axes: Vector3<f64> },
    /// All points within `radius` of a segment.
    Capsule { from: Point3<f64>, to: Point3<f64>, radius: f64 },
    /// A round bar from `base` along the unit vector `axis`.
    Cylinder { base: Point3<f64>, axis: Vector3<f64>, length: f64, radius: f64 },
}

/// Where a ray enters and leaves a solid, metres along the ray; the entry may lie behind the
/// origin.
pub(super) type Span = (f64, f64);

impl Shape {
    /// An axis-aligned box.
    pub fn cuboid(low: [f64; 3], high: [f64; 3]) -> Self {
        let planes = (0..3).flat_map(|axis| {
            let unit = Vector3::ith(axis, 1.0);
            [(unit, high[axis]), (-unit, -low[axis])]
        });
        Shape::Hull {
            planes: planes.map(|(normal, offset)| Plane { normal, offset }).collect(),
            low: low.into(),
            high: high.into(),
        }
    }

    /// A hull without what lies beyond the plane through `point` with outward `normal`; other
    /// shapes stay as they are.
    pub fn cut(mut self, normal: [f64; 3], point: [f64; 3]) -> Self {
        if let Shape::Hull { planes, .. } = &mut self {
            let normal = Vector3::from(normal).normalize();
            let offset = normal.dot(&Vector3::from(point));
            planes.push(Plane { normal, offset });
        }
        self
    }

    /// An ellipsoid from centre and semi-axes.
    pub fn ellipsoid(centre: [f64; 3], semi_axes: [f64; 3]) -> Self {
        Shape::Ellipsoid { centre: centre.into(), semi_axes: semi_axes.into() }
    }

    /// A capsule around the segment between two points.
    pub fn capsule(from: [f64; 3], to: [f64; 3], radius: f64) -> Self {
        Shape::Capsule { from: from.into(), to: to.into(), radius }
    }

    /// A round bar between the centres of its two ends.
    pub fn cylinder(from: [f64; 3], to: [f64; 3], radius: f64) -> Self {
        let along = Point3::from(to) - Point3::from(from);
        Shape::Cylinder { base: from.into(), axis: along.normalize(), length: along.norm(), radius }
    }

    /// Where `ray` enters and leaves the solid, or `None` if its line misses.
    pub fn span(&self, ray: &Ray) -> Option<Span> {
        match self {
            Shape::Hull { planes, .. } => clip(planes, ray),
            Shape::Ellipsoid { centre, semi_axes } => {
                let origin = (ray.origin - centre).component_div(semi_axes);
                unit_ball(origin, ray.direction.component_div(semi_axes))
            }
            Shape::Capsule { from, to, radius } => capsule(ray, from, to, *radius),
            Shape::Cylinder { base, axis, length, radius } => {
                cylinder(ray, base, axis, *length, *radius)
            }
        }
    }

    /// Outward unit normal at a point of the surface.
    pub fn normal_at(&self, point: &Point3<f64>) -> Vector3<f64> {
        match self {
            Shape::Hull { planes, .. } => {
                let outside = |plane: &Plane| plane.normal.dot(&point.coords) - plane.offset;
                let nearest = planes.iter().max_by(|a, b| outside(a).total_cmp(&outside(b)));
                nearest.map_or(Vector3::z(), |plane| plane.normal)
            }
            Shape::Ellipsoid { centre, semi_axes } => {
                (point - centre).component_div(&semi_axes.component_mul(semi_axes)).normalize()
            }
            Shape::Capsule { from, to, .. } => {
                let along = to - from;
                let share = (point - from).dot(&along) / along.norm_squared();
                (point - (from + along * share.clamp(0.0, 1.0))).normalize()
            }
            Shape::Cylinder { base, axis, length, .. } => {
                let along = (point - base).dot(axis);
                match along {
                    _ if along < 1e-6 => -axis,
                    _ if along > length - 1e-6 => *axis,
                    _ => (point - (base + axis * along)).normalize(),
                }
            }
        }
    }

    /// Opposite corners of an axis-aligned box around the solid.
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        match self {
            Shape::Hull { low, high, .. } => (*low, *high),
            Shape::Ellipsoid { centre, semi_axes } => (centre - semi_axes, centre + semi_axes),
            Shape::Capsule { from, to, radius } => {
                let margin = Vector3::repeat(*radius);
                (from.inf(to) - margin, from.sup(to) + margin)
            }
            Shape::Cylinder { base, axis, length, radius } => {
                let end = base + axis * *length;
                let margin = axis.map(|a| radius * (1.0 - a * a).max(0.0).sqrt());
                (base.inf(&end) - margin, base.sup(&end) + margin)
            }
        }
    }
}

/// The part of a ray's line behind all planes.
fn clip(planes: &[Plane], ray: &Ray) -> Option<Span> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for plane in planes {
        let slope = plane.normal.dot(&ray.direction);
        let inside = plane.offset - plane.normal.dot(&ray.origin.coords);
        if slope.abs() < 1e-12 {
            if inside < 0.0 {
                return None;
            }
        } else if slope < 0.0 {
            enter = enter.max(inside / slope);
        } else {
            leave = leave.min(inside / slope);
        }
        if enter >= leave {
            return None;
        }
    }
    Some((enter, leave))
}

/// The part of a line inside the ball of radius 1 around the origin.
fn unit_ball(origin: Vector3<f64>, direction: Vector3<f64>) -> Option<Span> {
    quadratic(direction.norm_squared(), origin.dot(&direction), origin.norm_squared() - 1.0)
}

/// Where `a t^2 + 2 b t + c` is negative, for positive `a`.
fn quadratic(a: f64, b: f64, c: f64) -> Option<Span> {
    let discriminant = b * b - a * c;
    if discriminant <= 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    Some(((-b - root) / a, (-b + root) / a))
}

fn cylinder(
    ray: &Ray,
    base: &Point3<f64>,
    axis: &Vector3<f64>,
    length: f64,
    radius: f64,
) -> Option<Span> {
    let origin = ray.origin - base;
    let (start, climb) = (origin.dot(axis), ray.direction.dot(axis));
    let (low, high) = if climb.abs() < 1e-12 {
        if !(0.0..=length).contains(&start) {
            return None;
        }
        (f64::NEG_INFINITY, f64::INFINITY)
    } else {
        let ends = [-start / climb, (length - start) / climb];
        (ends[0].min(ends[1]), ends[0].max(ends[1]))
    };
    let across = origin - axis * start;
    let sideways = ray.direction - axis * climb;
    let speed = sideways.norm_squared();
    let gap = across.norm_squared() - radius * radius;
    let (enter, leave) = if speed < 1e-12 {
        if gap > 0.0 {
            return None;
        }
        (low, high)
    } else {
        let (enter, leave) = quadratic(speed, across.dot(&sideways), gap)?;
        (enter.max(low), leave.min(high))
    };
    (enter < leave).then_some((enter, leave))
}

fn capsule(ray: &Ray, from: &Point3<f64>, to: &Point3<f64>, radius: f64) -> Option<Span> {
    let along = to - from;
    let length = along.norm();
    let ball = |centre: &Point3<f64>| {
        let origin = ray.origin - centre;
        let gap = origin.norm_squared() - radius * radius;
        quadratic(1.0, origin.dot(&ray.direction), gap)
    };
    let middle = cylinder(ray, from, &(along / length), length, radius);
    [middle, ball(from), ball(to)].into_iter().flatten().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray { origin: origin.into(), direction: Vector3::from(direction).normalize() }
    }

    fn assert_span(shape: &Shape, ray: &Ray, expected: Option<Span>) {
        let found = shape.span(ray);
        let close = match (found, expected) {
            (Some(a), Some(b)) => (a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9,
            (None, None) => true,
            _ => false,
        };
        assert!(close, "{found:?} instead of {expected:?}");
    }

    #[test]
    fn box_and_cut_box() {
        let solid = Shape::cuboid([4.0, -1.0, -1.0], [6.0, 1.0, 1.0]);
        let ahead = ray([0.0; 3], [1.0, 0.0, 0.0]);
        assert_span(&solid, &ahead, Some((4.0, 6.0)));
        assert_span(&solid, &ray([0.0; 3], [0.0, 1.0, 0.0]), None);
        assert_span(&solid, &ray([0.0, 2.0, 0.0], [1.0, 0.0, 0.0]), None);
        assert_span(&solid, &ray([5.0, 0.0, 0.0], [1.0, 0.0, 0.0]), Some((-1.0, 1.0)));
        // The plane x + z = 5 leaves the ray at z = 0.5 inside up to x = 4.5 only.
        let cut = solid.cut([1.0, 0.0, 1.0], [5.0, 0.0, 0.0]);
        assert_span(&cut, &ray([0.0, 0.0, 0.5], [1.0, 0.0, 0.0]), Some((4.0, 4.5)));
        let slanted = cut.normal_at(&Point3::new(4.5, 0.0, 0.5));
        assert!((slanted - Vector3::new(0.5, 0.0, 0.5).normalize()).norm() < 1e-12);
    }

    #[test]
    fn ellipsoid() {
        let solid = Shape::ellipsoid([5.0, 0.0, 0.0], [2.0, 1.0, 1.0]);
        assert_span(&solid, &ray([0.0; 3], [1.0, 0.0, 0.0]), Some((3.0, 7.0)));
        // At half the height of the ellipsoid the chord is 2 * 2 * sqrt(1 - 0.25).
        let half = 3.0_f64.sqrt();
        assert_span(&solid, &ray([0.0, 0.0, 0.5], [1.0, 0.0, 0.0]), Some((5.0 - half, 5.0 + half)));
        assert_span(&solid, &ray([0.0, 0.0, 1.1], [1.0, 0.0, 0.0]), None);
    }

    #[test]
    fn standing_and_lying_cylinders() {
        let post = Shape::cylinder([3.0, 0.0, 0.0], [3.0, 0.0, 2.0], 0.5);
        assert_span(&post, &ray([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]), Some((2.5, 3.5)));
        assert_span(&post, &ray([0.0, 0.0, 2.1], [1.0, 0.0, 0.0]), None);
        assert_span(&post, &ray([3.0, 0.0, 5.0], [0.0, 0.0, -1.0]), Some((3.0, 5.0)));
        assert_eq!(post.normal_at(&Point3::new(3.0, 0.0, 2.0)), Vector3::z());
        let wheel = Shape::cylinder([0.0, -0.1, 0.3], [0.0, 0.1, 0.3], 0.3);
        assert_span(&wheel, &ray([-1.0, 0.0, 0.3], [1.0, 0.0, 0.0]), Some((0.7, 1.3)));
        let (low, high) = wheel.bounds();
        assert!((low - Point3::new(-0.3, -0.1, 0.0)).norm() < 1e-12);
        assert!((high - Point3::new(0.3, 0.1, 0.6)).norm() < 1e-12);
    }

    #[test]
    fn capsule_has_round_ends() {
        let limb = Shape::capsule([3.0, 0.0, 0.0], [3.0, 0.0, 2.0], 0.5);
        assert_span(&limb, &ray([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]), Some((2.5, 3.5)));
        // 0.3 above the upper end the chord's half is sqrt(0.25 - 0.09) = 0.4.
        assert_span(&limb, &ray([0.0, 0.0, 2.3], [1.0, 0.0, 0.0]), Some((2.6, 3.4)));
        assert_span(&limb, &ray([3.0, 0.0, 5.0], [0.0, 0.0, -1.0]), Some((2.5, 5.5)));
        assert_span(&limb, &ray([0.0, 0.0, 2.6], [1.0, 0.0, 0.0]), None);
    }
}
