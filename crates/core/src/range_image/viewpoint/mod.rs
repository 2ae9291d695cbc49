//! Where the sensor of a cloud stands, in whatever frame the cloud was brought into: the
//! vehicle's, a level one, a map's.
//!
//! The frame's origin is believed where the rows of the image say that the beams leave from there.
//! Else it is looked for: with rows that are known, as the point whose cones they are ([`cones`]);
//! without, as the point from which the positions look like a sweep ([`search`]), which then has to
//! show beams. Where neither says anything, a frame that lies on the ground is looked at from the
//! height of a roof.

mod cones;
mod lines;
mod search;

use nalgebra::{Isometry3, Vector3};

use super::coverage;
use super::evidence::Evidence;
use super::image::{NOWHERE, RangeImage};
use super::projection::Projection;
use super::sweep::Sweep;
use crate::cloud::point_cloud::{PointCloud, wide};
use crate::cloud::up::{Axis, lowest_returns};
use crate::geometry::plane_fit::plane_through;
use crate::geometry::statistics::median;
use cones::{RingReturn, View, disagreement, refined};

/// Where a sensor stands in the cloud's frame, z its axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Viewpoint {
    pub sensor: Isometry3<f64>,
    pub evidence: Evidence,
}

/// Rows are beams where their returns lie within this share of a quarter of the distance to the
/// next beam ([`disagreement`]). Beams of simulated and recorded sensors have 0.02 to 0.25, other
/// rows 0.6 to 1.
const BEAMS: f64 = 0.4;
/// Rows that fit so well are not fitted again from elsewhere; lines that were chosen to fit have to
/// fit so well (to 0.17 on simulated sensors, where three merged sensors have 0.25).
const CLEARLY_BEAMS: f64 = 0.2;

/// Whether the rows of an image are beams that leave from the origin.
pub(super) fn is_origin(cloud: &PointCloud, image: &RangeImage) -> bool {
    const RETURNS: usize = 2048;
    match image.projection {
        Projection::ScanOrder | Projection::Elevations => true,
        Projection::UniformElevation => false,
        _ => {
            let returns = returns_by_row(cloud, image, RETURNS);
            disagreement(&returns, &View::upright(Vector3::zeros())) < BEAMS
        }
    }
}

/// Where the sensor stands of a cloud whose image from the origin shows no beams. `None` if for all
/// that is known it is the origin.
pub(super) fn find(cloud: &PointCloud, image: &RangeImage) -> Option<Viewpoint> {
    const RETURNS: usize = 3000;
    const POSITIONS: usize = 6000;
    let of_beams = |view: View| Viewpoint { sensor: view.pose(), evidence: Evidence::Beams };
    let usual = [0.0, 1.0, 2.0].map(|height| Vector3::z() * height);
    let usual = || cloud.recorded_sensors.iter().chain(&usual).copied();
    let has_rows = image.projection != Projection::UniformElevation;
    let mut by_rows = Vec::new();
    if has_rows {
        by_rows = returns_by_row(cloud, image, RETURNS);
        if let Some(view) = beams_from(usual(), &by_rows) {
            return Some(of_beams(view));
        }
    }
    let sample = Sweep::new(cloud).sample;
    let positions = positions(cloud, &sample, POSITIONS);
    let elsewhere = Elsewhere::of(cloud, image, &positions)?;
    let mut nearby = None;
    if !has_rows {
        by_rows = returns_by_ring(cloud, &sample, RETURNS);
        nearby = beams_from(usual(), &by_rows);
    }
    let searched = || {
        let start = elsewhere.place().or_else(|| search::start(&positions))?;
        search::search(&positions, start).find_map(|place| {
            let view = View::upright(place.cast());
            let lines = || lines::returns_by_line(&positions, &place);
            checked(view, &by_rows, BEAMS).or_else(|| checked(view, &lines(), CLEARLY_BEAMS))
        })
    };
    nearby
        .or_else(|| beams_from(elsewhere.starts(), &by_rows))
        .or_else(searched)
        .map(of_beams)
        .or_else(|| elsewhere.assumed(cloud))
}

/// Why the sensor may not stand at the origin.
enum Elsewhere {
    /// The frame lies on the ground, where no sensor could see it.
    OverGround,
    /// Nothing was measured near the origin; the returns are most even from this place.
    Far(Vector3<f32>),
    /// From there the returns crowd in some directions, or stand behind each other; they are more
    /// even from this place.
    Uneven(Vector3<f32>),
    /// The frame is no sensor's by its name, or the recording has its only sensor elsewhere.
    Named,
}

impl Elsewhere {
    /// `None` where nothing speaks against the origin.
    fn of(cloud: &PointCloud, image: &RangeImage, positions: &[Vector3<f32>]) -> Option<Elsewhere> {
        /// Fewer positions do not tell.
        const FEWEST: usize = 64;
        /// Distance across the ground within which a sensor has returns, metres, and their share.
        const NEAR: f32 = 10.0;
        const SHARE: f32 = 0.01;
        /// A sensor that covers more of the circle, radians, looks all round.
        const ROUND: f64 = 4.0;
        /// A sweep has returns in the directions that it covers about as many as in others, nats.
        /// From the origin of their own frames simulated sensors that look all round have up to
        /// 0.3 less than from the best place, for objects near by; those with a sector up to 1.4,
        /// since the best place is then amid the points.
        const UNEVEN: f32 = 0.35;
        const UNEVEN_SECTOR: f32 = 1.7;
        /// Where returns fall on pixels by chance, a fifth share one; more share one where walls
        /// stand behind walls.
        const STACKED: f64 = 0.3;
        if positions.len() < FEWEST {
            return None;
        }
        if cloud.offset != [0.0; 3] {
            return search::start(positions).map(Elsewhere::Far);
        }
        if is_on_ground(cloud) {
            return Some(Elsewhere::OverGround);
        }
        let near = positions.iter().filter(|at| at.xy().norm() < NEAR).count();
        let is_far = (near as f32) < SHARE * positions.len() as f32;
        let azimuths = positions.iter().map(|at| at.y.atan2(at.x));
        let looks_round = coverage::covered(azimuths).1 > ROUND;
        if is_far || looks_round {
            let place = search::start(positions)?;
            let unevenness = search::unevenness(positions, &place);
            let is_stacked =
                || image.shadowed_count() as f64 > STACKED * image.return_count() as f64;
            if looks_round && (unevenness > UNEVEN || is_stacked()) {
                return Some(Elsewhere::Uneven(place));
            }
            if is_far && unevenness > UNEVEN_SECTOR {
                return Some(Elsewhere::Far(place));
            }
        }
        (cloud.is_named_elsewhere || cloud.recorded_sensors.len() == 1).then_some(Elsewhere::Named)
    }

    /// The place from which the returns are most even, where it was looked for.
    fn place(&self) -> Option<Vector3<f32>> {
        match self {
            Elsewhere::Far(place) | Elsewhere::Uneven(place) => Some(*place),
            Elsewhere::OverGround | Elsewhere::Named => None,
        }
    }

    /// Places where the sensor may stand, for rows to be fitted from. The directions say little of
    /// the height.
    fn starts(&self) -> impl Iterator<Item = Vector3<f64>> {
        let heights = (-8..=2).map(f64::from);
        self.place().into_iter().flat_map(move |place| {
            heights.clone().map(move |height| place.cast() + Vector3::z() * height)
        })
    }

    /// Where to look from, for want of better: where the recording has its only sensor, a car's
    /// roof over a frame on the ground, the place from which the returns are even, or the origin
    /// all the same. `None` for the origin where too little speaks against it to be said.
    fn assumed(&self, cloud: &PointCloud) -> Option<Viewpoint> {
        const ROOF: f64 = 1.8;
        let (origin, evidence) = match (&cloud.recorded_sensors[..], self) {
            ([only], _) => (*only, Evidence::Recorded),
            (_, Elsewhere::OverGround) => (Vector3::z() * ROOF, Evidence::Assumed),
            (_, Elsewhere::Far(place)) => (place.cast(), Evidence::Assumed),
            _ if cloud.is_named_elsewhere => (Vector3::zeros(), Evidence::Assumed),
            _ => return None,
        };
        Some(Viewpoint { sensor: View::upright(origin).pose(), evidence })
    }
}

/// The view under which rows are beams, sought from some places; `None` unless they clearly are.
fn beams_from(places: impl Iterator<Item = Vector3<f64>>, returns: &[RingReturn]) -> Option<View> {
    let views = places.map(|place| refined(returns, View::upright(place)));
    let views = views.filter(|view| fill_its_sight(returns, view));
    let scored = views.map(|view| (view, disagreement(returns, &view)));
    let (view, misfit) = scored.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (misfit < CLEARLY_BEAMS).then_some(view)
}

/// The view near a first one under which rows are beams, misfits at most so much.
fn checked(start: View, returns: &[RingReturn], most: f64) -> Option<View> {
    let view = refined(returns, start);
    (fill_its_sight(returns, &view) && disagreement(returns, &view) < most).then_some(view)
}

/// Whether the returns seen from a view span as much as a sensor sees. From far enough away the
/// returns of every row have one direction to the last digit, which fits cones perfectly.
fn fill_its_sight(returns: &[RingReturn], view: &View) -> bool {
    /// Half of the angle that the narrowest sensor sees, radians, as a tangent.
    const NARROWEST: f64 = 0.1;
    let along =
        |axis: usize| median(&mut returns.iter().map(|of| of.position[axis]).collect::<Vec<f64>>());
    let [Some(x), Some(y), Some(z)] = [0, 1, 2].map(along) else { return false };
    let middle = Vector3::new(x, y, z);
    let reach = returns.iter().map(|of| (of.position - middle).norm()).fold(0.0, f64::max);
    (view.origin - middle).norm() * NARROWEST <= reach
}

/// At most so many returns with their rows in an image, evenly spread over it.
fn returns_by_row(cloud: &PointCloud, image: &RangeImage, count: usize) -> Vec<RingReturn> {
    let every = (image.rows() * image.columns()).div_ceil(count).max(1);
    let of_row = |ring: usize| {
        // A shift of its own for each row, lest a narrow gap in the columns hide from the sample.
        let pixels = image.point_of_pixel.row(ring).iter().skip(ring % every).step_by(every);
        let seen = pixels.filter(|&&point| point != NOWHERE);
        seen.map(move |&point| RingReturn { position: position(cloud, point as usize), ring })
    };
    (0..image.rows()).flat_map(of_row).collect()
}

/// About so many of some returns with the rings that the cloud gives them.
fn returns_by_ring(cloud: &PointCloud, returns: &[u32], count: usize) -> Vec<RingReturn> {
    let Some(ring) = &cloud.ring else {
        return Vec::new();
    };
    let of = |point: usize| RingReturn {
        position: position(cloud, point),
        ring: usize::from(ring[point]),
    };
    thinned(returns, count).map(of).collect()
}

/// The positions of about so many of some returns.
fn positions(cloud: &PointCloud, returns: &[u32], count: usize) -> Vec<Vector3<f32>> {
    thinned(returns, count).map(|point| Vector3::from(cloud.position(point))).collect()
}

/// About so many of some points, evenly spread over them.
fn thinned(points: &[u32], count: usize) -> impl Iterator<Item = usize> {
    let every = points.len().div_ceil(count).max(1);
    points.iter().step_by(every).map(|&point| point as usize)
}

fn position(cloud: &PointCloud, point: usize) -> Vector3<f64> {
    Vector3::from(wide(cloud.position(point)))
}

/// Whether the origin of a cloud's frame lies on the ground, as those of vehicles do: the plane
/// through the lowest returns of most square metres around it passes through it, where no sensor
/// could see it.
fn is_on_ground(cloud: &PointCloud) -> bool {
    /// Metres around it.
    const AROUND: usize = 16;
    const FEWEST_CELLS: usize = 32;
    const ON_GROUND: f64 = 0.3;
    /// Fits, each to what lies within a band of the one before, metres; most cells must be left.
    const BANDS: [f64; 3] = [1.0, 0.5, 0.3];
    let lowest = lowest_returns(cloud, Axis::Z, AROUND, None);
    let mut cells: Vec<[f64; 3]> = lowest.into_iter().map(wide).collect();
    let count = cells.len();
    if count < FEWEST_CELLS {
        return false;
    }
    let heights = &mut cells.iter().map(|&[.., height]| height).collect::<Vec<f64>>();
    let mut plane = Vector3::new(median(heights).unwrap_or(0.0), 0.0, 0.0);
    for band in BANDS {
        cells.retain(|&[x, y, z]| (z - plane.dot(&Vector3::new(1.0, x, y))).abs() < band);
        plane = plane_through(cells.iter().copied(), [1e-6; 3]).unwrap_or(plane);
    }
    2 * cells.len() > count && plane.x.abs() < ON_GROUND
}

#[cfg(test)]
mod tests;
