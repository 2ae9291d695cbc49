//! The viewpoint of a sweep from its positions alone, wherever in space the sweep lies.
//!
//! Two things distinguish the place of the sensor from all others. Seen from there the returns
//! cover the sphere evenly, so that the entropy of their directions is high; and the returns of a
//! beam have one elevation, so that within a degree of elevation they lie on a few fine lines, at
//! whatever range.
//!
//! Steps: from the middle of the points uphill in the entropy, which leads to within 2 m; then to
//! the middle of the rings on the ground, which are circles seen from any height; then to the
//! height from which what stands on the ground lies on lines too.

use nalgebra::Vector3;

use crate::geometry::statistics::median_by;
use crate::range_image::azimuth::azimuth;

/// Cells of directions in which evenness is measured, radians: two degrees.
const CELL: f32 = std::f32::consts::PI / 90.0;
/// Cells around the horizon, and from nadir to zenith.
const AROUND: usize = 181;
const UPWARDS: usize = 91;
/// A degree, radians, within which the elevations of beams are lines.
const COARSE: f32 = std::f32::consts::PI / 180.0;
/// As many returns as planes and heights are scanned with.
const SOME: usize = 3000;
const FEW: usize = 1000;

/// Where the sensor of a sweep may stand, given some of its returns in metres and a place within
/// 2 m or so ([`start`]): first if its beams are a degree or two apart, then if they are closer.
/// Whether it does is for others to check.
pub(super) fn search(
    returns: &[Vector3<f32>],
    start: Vector3<f32>,
) -> impl Iterator<Item = Vector3<f32>> {
    let [ground, standing] = layers(returns);
    let [some, ground] = [returns, &ground].map(|all| thinned(all, SOME));
    let standing = thinned(&standing, FEW);
    [&WIDE, &NARROW].into_iter().filter_map(move |grids| {
        let place = upwards(&standing, across(&ground, start, grids))?;
        // At the right height all returns tell where the middle is.
        let place = upwards(&standing, across(&some, place, grids))?;
        Some(climb(&|place| -fuzziness(returns, place, FINEST), place, 0.02, 4))
    })
}

/// The place within 2 m or so of the sensor from which the directions of the returns are most even.
pub(super) fn start(returns: &[Vector3<f32>]) -> Option<Vector3<f32>> {
    /// Height above the middle of the points at which the search begins, metres.
    const ABOVE: f32 = 2.0;
    let returns = thinned(returns, SOME);
    let start = middle(&returns)? + Vector3::z() * ABOVE;
    Some(climb(&|place| evenness(&returns, place), start, 2.0, 3))
}

/// By how much more even the directions of the returns are from a place than from the origin, nats.
pub(super) fn unevenness(returns: &[Vector3<f32>], place: &Vector3<f32>) -> f32 {
    evenness(returns, place) - evenness(returns, &Vector3::zeros())
}

fn thinned(returns: &[Vector3<f32>], count: usize) -> Vec<Vector3<f32>> {
    returns.iter().step_by(returns.len().div_ceil(count).max(1)).copied().collect()
}

/// Steps of a grid in metres, lines in degrees, and the share of the returns left out for being
/// near: a false place blurs far returns least.
type Grids = [(f32, f32, f32); 4];
/// For beams a degree or two apart.
const WIDE: Grids = [(0.5, 0.6, 0.5), (0.125, 0.3, 0.3), (0.04, 0.15, 0.0), (0.01, FINEST, 0.0)];
/// For beams a third of a degree apart.
const NARROW: Grids =
    [(0.5, 0.1, 0.8), (0.125, 0.1, 0.5), (0.04, FINEST, 0.3), (0.01, FINEST, 0.0)];
/// The width of the finest lines, degrees.
const FINEST: f32 = 0.05;

/// The returns on the level surface that has the most of them, and all others.
fn layers(returns: &[Vector3<f32>]) -> [Vec<Vector3<f32>>; 2] {
    /// Thickness of a surface, metres, and how far from it returns stand on it.
    const LAYER: f32 = 0.2;
    const OFF: f32 = 0.3;
    let layer = |at: &Vector3<f32>| (at.z / LAYER).round() as i64;
    let mut numbers: Vec<i64> = returns.iter().map(layer).collect();
    numbers.sort_unstable();
    let fullest = numbers.chunk_by(|a, b| a == b).max_by_key(|layer| layer.len());
    let height = fullest.map_or(0.0, |layer| layer[0] as f32 * LAYER);
    let (standing, ground) = returns.iter().partition(|at| (at.z - height).abs() > OFF);
    [ground, standing]
}

/// To the place at the same height around which returns lie on the finest lines. Of the ground any
/// height will do: its rings are circles.
fn across(returns: &[Vector3<f32>], start: Vector3<f32>, grids: &Grids) -> Vector3<f32> {
    /// Steps to either side.
    const STEPS: i32 = 8;
    let mut place = start;
    let mut by_distance = returns.to_vec();
    let distance = |at: &Vector3<f32>| (at.xy() - start.xy()).norm();
    by_distance.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    for &(step, line, near) in grids {
        let far = &by_distance[(near * by_distance.len() as f32) as usize..];
        let grid = (-STEPS..=STEPS).flat_map(|x| (-STEPS..=STEPS).map(move |y| [x, y]));
        let scored = grid.map(|[x, y]| {
            let at = place + Vector3::new(x as f32, y as f32, 0.0) * step;
            (at, fuzziness(far, &at, line))
        });
        place = scored.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(place, |(at, _)| at);
    }
    place
}

/// To the height from which what stands on the ground lies on the finest lines; `None` where too
/// little stands there.
fn upwards(standing: &[Vector3<f32>], place: Vector3<f32>) -> Option<Vector3<f32>> {
    const STEP: f32 = 0.01;
    /// How far below and above the first guess the sensor may be, metres.
    const BELOW: f32 = 15.0;
    const ABOVE: f32 = 10.0;
    /// A step is finer than a line for returns at least so far away, metres.
    const FAR: f32 = 8.0;
    const FEWEST: usize = 64;
    let far: Vec<Vector3<f32>> =
        standing.iter().filter(|at| (at.xy() - place.xy()).norm() > FAR).copied().collect();
    if far.len() < FEWEST {
        return None;
    }
    let steps = ((BELOW + ABOVE) / STEP) as usize;
    let heights = (0..steps).map(|step| place.z - BELOW + step as f32 * STEP);
    let scored = heights.map(|z| {
        let at = Vector3::new(place.x, place.y, z);
        (at, fuzziness(&far, &at, FINEST))
    });
    scored.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at)
}

/// The median of each coordinate.
fn middle(returns: &[Vector3<f32>]) -> Option<Vector3<f32>> {
    let along = |axis: usize| {
        let mut along: Vec<f32> = returns.iter().map(|at| at[axis]).collect();
        median_by(&mut along, f32::total_cmp)
    };
    Some(Vector3::new(along(0)?, along(1)?, along(2)?))
}

/// Uphill along the axes until no step of the given size in metres leads higher, then with half of
/// it, so many times.
fn climb(
    score: &impl Fn(&Vector3<f32>) -> f32,
    start: Vector3<f32>,
    step: f32,
    halvings: usize,
) -> Vector3<f32> {
    /// A climb goes no farther than this many steps of one size.
    const MOST_STEPS: usize = 40;
    let (mut best, mut highest) = (start, score(&start));
    let mut step = step;
    for _ in 0..halvings {
        for _ in 0..MOST_STEPS {
            let before = highest;
            for axis in 0..3 {
                for change in [step, -step] {
                    let mut place = best;
                    place[axis] += change;
                    let height = score(&place);
                    if height > highest {
                        (best, highest) = (place, height);
                    }
                }
            }
            if highest <= before {
                break;
            }
        }
        step /= 2.0;
    }
    best
}

/// Entropy of the directions of the returns, nats.
fn evenness(returns: &[Vector3<f32>], place: &Vector3<f32>) -> f32 {
    let mut counts = vec![0_u16; AROUND * UPWARDS];
    for at in returns {
        let [around, elevation] = direction(at, place);
        let column = ((around + std::f32::consts::PI) / CELL) as usize;
        let row = ((elevation + std::f32::consts::FRAC_PI_2) / CELL) as usize;
        let cell = row.min(UPWARDS - 1) * AROUND + column.min(AROUND - 1);
        counts[cell] = counts[cell].saturating_add(1);
    }
    entropy(&counts)
}

/// Entropy of the elevations in lines of so many degrees, less that in whole degrees, nats: 0
/// where each degree has one line.
fn fuzziness(returns: &[Vector3<f32>], place: &Vector3<f32>, line: f32) -> f32 {
    let width = COARSE * line;
    let mut fine = vec![0_u16; (std::f32::consts::PI / width) as usize + 2];
    let mut coarse = [0_u16; 182];
    for at in returns {
        let up = direction(at, place)[1] + std::f32::consts::FRAC_PI_2;
        for (counts, width) in [(&mut fine[..], width), (&mut coarse[..], COARSE)] {
            let bin = ((up / width) as usize).min(counts.len() - 1);
            counts[bin] = counts[bin].saturating_add(1);
        }
    }
    entropy(&fine) - entropy(&coarse)
}

/// Azimuth and elevation of a position seen from a place, radians.
pub(super) fn direction(at: &Vector3<f32>, place: &Vector3<f32>) -> [f32; 2] {
    let ray = at - place;
    let around = azimuth(ray.x, ray.y, ray.z);
    let level = (ray.x * ray.x + ray.y * ray.y).sqrt();
    let elevation = azimuth(level, ray.z, 1.0);
    [around, elevation].map(|angle| if angle.is_nan() { 0.0 } else { angle })
}

fn entropy(counts: &[u16]) -> f32 {
    let (mut total, mut sum) = (0.0, 0.0);
    for &count in counts.iter().filter(|&&count| count > 0) {
        let count = f32::from(count);
        total += count;
        sum += count * count.ln();
    }
    if total > 0.0 { total.ln() - sum / total } else { 0.0 }
}
