//! A beam that turns about an axis sweeps a cone: all its returns are seen from the sensor under
//! one angle to the axis, however far each is.
//!
//! Origin and axis are those under which the angles of each ring agree best: five numbers, found by
//! damped least squares on the sines of those angles, each ring's own angle being eliminated, and
//! returns that fit badly weighing little (Cauchy's weights). Only rings are needed, no order and
//! no time. Noise of the range does not matter, because it moves a return along its ray.

use nalgebra::{Isometry3, Matrix5, Translation3, UnitQuaternion, Vector3, Vector5};

use crate::geometry::statistics::median;

/// A return and the ring that it belongs to.
#[derive(Debug, Clone, Copy)]
pub(super) struct RingReturn {
    pub position: Vector3<f64>,
    pub ring: usize,
}

/// A supposed sensor: where its beams leave from, and the unit vector that they turn about.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    pub origin: Vector3<f64>,
    pub axis: Vector3<f64>,
}

impl View {
    /// A sensor whose axis is the frame's z.
    pub fn upright(origin: Vector3<f64>) -> Self {
        View { origin, axis: Vector3::z() }
    }

    /// Two directions across the axis.
    fn across(&self) -> [Vector3<f64>; 2] {
        let one = self.axis.cross(&Vector3::x());
        let one = if one.norm() > 0.1 { one } else { self.axis.cross(&Vector3::y()) }.normalize();
        [one, self.axis.cross(&one)]
    }

    fn moved(&self, step: &Vector5<f64>) -> View {
        let [one, other] = self.across();
        View {
            origin: self.origin + Vector3::new(step[0], step[1], step[2]),
            axis: (self.axis + one * step[3] + other * step[4]).normalize(),
        }
    }

    /// The sensor's pose in the cloud's frame.
    pub fn pose(&self) -> Isometry3<f64> {
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &self.axis);
        let turn = turn.unwrap_or_else(UnitQuaternion::identity);
        Isometry3::from_parts(Translation3::from(self.origin), turn)
    }

    /// Sine of the angle between a position and the plane across the axis.
    fn sine(&self, position: &Vector3<f64>) -> f64 {
        const NEAREST: f64 = 0.3;
        let ray = position - self.origin;
        self.axis.dot(&ray) / ray.norm().max(NEAREST)
    }
}

/// Mean distance of the returns from the cone of their ring, 0 to 1, in quarters of the distance to
/// the nearest other cone: near 0 where each ring is a cone of its own, near 1 where the rings say
/// nothing. The plane of level ground looks like one cone to a view that lies in it, but to that
/// view all rings are the same cone.
pub(super) fn disagreement(returns: &[RingReturn], view: &View) -> f64 {
    const FEWEST_RINGS: usize = 4;
    const FEWEST_RETURNS: usize = 6;
    let rings = returns.iter().map(|of| of.ring + 1).max().unwrap_or(0);
    let mut sines: Vec<Vec<f64>> = vec![Vec::new(); rings];
    for of in returns {
        sines[of.ring].push(view.sine(&of.position));
    }
    sines.retain(|ring| ring.len() >= FEWEST_RETURNS);
    if sines.len() < FEWEST_RINGS {
        return 1.0;
    }
    let mut cones: Vec<(f64, Vec<f64>)> =
        sines.into_iter().map(|mut ring| (median(&mut ring).unwrap_or(0.0), ring)).collect();
    cones.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut sum, mut count) = (0.0, 0);
    for (number, (cone, sines)) in cones.iter().enumerate() {
        let gap = |other: Option<&(f64, Vec<f64>)>| other.map_or(f64::MAX, |o| (o.0 - cone).abs());
        let below = gap(number.checked_sub(1).and_then(|below| cones.get(below)));
        let quarter = (below.min(gap(cones.get(number + 1))) / 4.0).max(f64::MIN_POSITIVE);
        sum += sines.iter().map(|sine| ((sine - cone).abs() / quarter).min(1.0)).sum::<f64>();
        count += sines.len();
    }
    sum / f64::from(count as u32)
}

/// The view nearest to a first one under which the rings agree best.
pub(super) fn refined(returns: &[RingReturn], start: View) -> View {
    /// Scales of Cauchy's weights, sines: from coarse to fine, as far as a decimetre at 3 m and at
    /// 30 m moves one.
    const SCALES: [f64; 3] = [0.03, 0.01, 0.003];
    SCALES.into_iter().fold(start, |view, scale| descend(returns, view, scale).unwrap_or(view))
}

/// Damped least squares at one scale of the weights.
fn descend(returns: &[RingReturn], start: View, scale: f64) -> Option<View> {
    const STEPS: usize = 20;
    const LEAST_GAIN: f64 = 1e-4;
    let mut view = start;
    let mut damping = 1e-3;
    let mut residuals = Residuals::new(returns, &view)?;
    for _ in 0..STEPS {
        let next = view.moved(&residuals.step(scale, damping)?);
        let of_next = Residuals::new(returns, &next)?;
        let [cost, next_cost] = [residuals.cost(scale), of_next.cost(scale)];
        if next_cost < cost {
            (view, residuals, damping) = (next, of_next, damping * 0.3);
            if next_cost > (1.0 - LEAST_GAIN) * cost {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    Some(view)
}

/// How far the sine of each return's angle is from those of its ring, and how it changes with the
/// view.
struct Residuals {
    rows: Vec<(f64, Vector5<f64>, usize)>,
    rings: usize,
}

impl Residuals {
    fn new(returns: &[RingReturn], view: &View) -> Option<Self> {
        const NEAREST: f64 = 0.3;
        let across = view.across();
        let rings = returns.iter().map(|of| of.ring + 1).max()?;
        let mut of_ring: Vec<Vec<f64>> = vec![Vec::new(); rings];
        let mut rows = Vec::with_capacity(returns.len());
        for of in returns {
            let ray = of.position - view.origin;
            let range = ray.norm().max(NEAREST);
            let ray = ray / range;
            let sine = view.axis.dot(&ray);
            let by_origin = (ray * sine - view.axis) / range;
            let by_axis = across.map(|across| across.dot(&ray));
            of_ring[of.ring].push(sine);
            let slope = Vector5::new(by_origin.x, by_origin.y, by_origin.z, by_axis[0], by_axis[1]);
            rows.push((sine, slope, of.ring));
        }
        let medians: Vec<f64> =
            of_ring.iter_mut().map(|sines| median(sines).unwrap_or(0.0)).collect();
        for (sine, _, ring) in &mut rows {
            *sine -= medians[*ring];
        }
        Some(Residuals { rows, rings })
    }

    fn cost(&self, scale: f64) -> f64 {
        self.rows.iter().map(|(residual, ..)| (residual / scale).powi(2).ln_1p()).sum()
    }

    /// The step of damped least squares, each ring's mean being free.
    fn step(&self, scale: f64, damping: f64) -> Option<Vector5<f64>> {
        let weight = |residual: f64| 1.0 / (1.0 + (residual / scale).powi(2));
        let mut means = vec![(0.0, 0.0, Vector5::zeros()); self.rings];
        for (residual, slope, ring) in &self.rows {
            let (weight, mean) = (weight(*residual), &mut means[*ring]);
            *mean = (mean.0 + weight, mean.1 + weight * residual, mean.2 + weight * slope);
        }
        let (mut normal, mut right) = (Matrix5::zeros(), Vector5::zeros());
        for (residual, slope, ring) in &self.rows {
            let (total, residuals, slopes) = &means[*ring];
            let (weight, slope) = (weight(*residual), slope - slopes / *total);
            normal += weight * slope * slope.transpose();
            right -= weight * slope * (residual - residuals / *total);
        }
        for i in 0..5 {
            normal[(i, i)] *= 1.0 + damping;
        }
        normal.cholesky().map(|solve| solve.solve(&right))
    }
}
