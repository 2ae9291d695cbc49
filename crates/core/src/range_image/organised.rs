//! Organised clouds: the image as it stands.
//!
//! Three things are put right. Some drivers call a cloud organised whose rows are no sweeps
//! (modules, returns in the order of firing, all first returns before all second ones): that is
//! projected as if it were not. Rows in the order of the sensor's channels are sorted by elevation.
//! And where a column is a moment of measurement, beams that are turned against each other make
//! neighbouring rows stand aside from one another (Ouster's staggered form; an organised VLP-32C):
//! each row is then turned by whole columns until the columns look one way.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use super::angles::{azimuth, elevation};
use super::band::Band;
use super::evidence::Evidence;
use super::image::{NOWHERE, RangeImage};
use super::params::{ProjectionParams, Wrap};
use super::projection::Projection;
use crate::cloud::point_cloud::PointCloud;
use crate::geometry::grid::Grid;
use crate::geometry::statistics::median;
use nalgebra::Isometry3;

/// The elevation of one beam stays within this standard deviation over a turn, radians: offsets of
/// the lasers and a tilted mount included, and well below the field of view of any scanner.
const BEAM_SPREAD: f64 = 0.5 * PI / 180.0;

/// Where the points of an organised cloud lie in the image.
#[derive(Debug, Clone, Copy)]
struct Layout<'a> {
    cloud: &'a PointCloud,
    rows: usize,
    columns: usize,
    is_transposed: bool,
    /// By row of the image the row of the cloud, where they differ.
    order: Option<&'a [usize]>,
}

impl Layout<'_> {
    #[inline]
    fn point(&self, row: usize, column: usize) -> usize {
        let row = self.order.map_or(row, |order| order[row]);
        if self.is_transposed { column * self.rows + row } else { row * self.columns + column }
    }

    /// Azimuths of the returns of a row with their columns, one column in so many.
    fn azimuths(&self, row: usize, every: usize) -> impl Iterator<Item = (usize, f64)> {
        let points = (0..self.columns).step_by(every).map(move |c| (c, self.point(row, c)));
        let returns = points.filter(|&(_, point)| self.cloud.is_return(point));
        returns.map(|(column, point)| (column, azimuth(self.cloud, point)))
    }
}

/// `None` of a cloud that is not organised, or whose rows are no sweeps.
pub(super) fn project(cloud: &PointCloud, params: &ProjectionParams) -> Option<RangeImage> {
    if !cloud.is_organised() {
        return None;
    }
    let layout = layout(cloud);
    if leaps(&layout) || splits_beams(&layout) {
        return None;
    }
    let order = row_order(&layout);
    let layout = Layout { order: order.as_deref(), ..layout };
    let step = column_step(&layout);
    if step.is_some_and(|step| step.abs() * layout.columns as f64 > MOST_TURNS * TAU) {
        return None;
    }
    let closes = step.is_some_and(|step| {
        (0.95 * TAU..1.05 * TAU).contains(&(step.abs() * layout.columns as f64))
    });
    let shifts = shifts(&layout, step.filter(|_| closes));
    Some(image(&layout, params, step, closes, &shifts))
}

/// The rows from the highest down, where they are stored otherwise than up or down: drivers that
/// store a row for each channel follow the order of the laser boards.
///
/// The elevation of a row is the median over its returns. Rows are out of order where, in all, they
/// go up and down much more than from one end to the other; or, where each keeps its elevation far
/// better than it differs from the next, where one falls behind the rows before it at all.
fn row_order(layout: &Layout) -> Option<Vec<usize>> {
    /// Ups and downs of rows in order, seen from another place than the sensor's, are fewer.
    const MOST_TRAVEL: f64 = 2.0;
    const FEWEST_ROWS: usize = 4;
    let found = (0..layout.rows).map(|row| (row, row_elevation(layout, row)));
    let mut rows: Vec<(usize, f64, f64)> = found
        .filter_map(|(row, found)| found.map(|(middle, spread)| (row, middle, spread)))
        .collect();
    if rows.len() < FEWEST_ROWS {
        return None;
    }
    let steps: Vec<f64> = rows.windows(2).map(|pair| pair[1].1 - pair[0].1).collect();
    let travel: f64 = steps.iter().map(|step| step.abs()).sum();
    let back = least_reversal(&steps);
    let mut spreads: Vec<f64> = rows.iter().map(|row| row.2).collect();
    let spread = median(&mut spreads)?;
    rows.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let span = rows[0].1 - rows[rows.len() - 1].1;
    let mut gaps: Vec<f64> = rows.windows(2).map(|pair| pair[0].1 - pair[1].1).collect();
    let gap = median(&mut gaps)?;
    let is_sharp = spread < gap / 4.0;
    if !(travel > MOST_TRAVEL * span || is_sharp && back > gap / 2.0) {
        return None;
    }
    let mut order: Vec<usize> = rows.into_iter().map(|row| row.0).collect();
    let is_empty = |row: &usize| !order.contains(row);
    let empty: Vec<usize> = (0..layout.rows).filter(is_empty).collect();
    order.extend(empty);
    Some(order)
}

/// How far a walk of these steps goes back at most, the lesser of up and down.
fn least_reversal(steps: &[f64]) -> f64 {
    let farthest_back = |sign: f64| {
        let walk = steps.iter().scan((0.0_f64, 0.0_f64), |(at, best), step| {
            *at += sign * step;
            *best = best.max(*at);
            Some(*best - *at)
        });
        walk.fold(0.0, f64::max)
    };
    farthest_back(1.0).min(farthest_back(-1.0))
}

/// Median elevation of a row's returns and their median distance from it, radians: of some of its
/// columns, or of all where those have few. `None` without a return.
fn row_elevation(layout: &Layout, row: usize) -> Option<(f64, f64)> {
    const COLUMNS: usize = 128;
    const FEW: usize = 16;
    let elevations = |every: usize| {
        let points = (0..layout.columns).step_by(every).map(|column| layout.point(row, column));
        let returns = points.filter(|&point| layout.cloud.is_return(point));
        returns.map(|point| elevation(layout.cloud, point)).collect::<Vec<f64>>()
    };
    let mut found = elevations(layout.columns.div_ceil(COLUMNS).max(1));
    if found.len() < FEW {
        found = elevations(1);
    }
    let middle = median(&mut found)?;
    found.iter_mut().for_each(|elevation| *elevation = (*elevation - middle).abs());
    median(&mut found).map(|spread| (middle, spread))
}

/// Whether returns that follow each other in a row leap in elevation, as those in the order of
/// firing do.
fn leaps(layout: &Layout) -> bool {
    const CALM: f64 = 1.5 * PI / 180.0;
    const ROWS: usize = 16;
    const PAIRS: usize = 64;
    const FEWEST_PAIRS: usize = 64;
    let mut changes = Vec::new();
    for row in (0..layout.rows).step_by(layout.rows.div_ceil(ROWS).max(1)) {
        for column in (1..layout.columns).step_by(layout.columns.div_ceil(PAIRS).max(1)) {
            let pair = [layout.point(row, column - 1), layout.point(row, column)];
            if pair.iter().all(|&point| layout.cloud.is_return(point)) {
                let [before, after] = pair.map(|point| elevation(layout.cloud, point));
                changes.push((after - before).abs());
            }
        }
    }
    changes.len() >= FEWEST_PAIRS && median(&mut changes).is_some_and(|change| change > CALM)
}

/// Whether several rows are one beam by the ring field: rows of one number that have one elevation.
/// A cloud in the order of firing whose declared rows hold whole shots looks so. (Rows of one
/// number that differ in elevation belong to one module of a sensor that numbers those.)
fn splits_beams(layout: &Layout) -> bool {
    const EACH: usize = 8;
    let Some(ring) = &layout.cloud.ring else {
        return false;
    };
    // By the number: rows, and the lowest and highest of their elevations.
    let mut beams: BTreeMap<u16, (usize, f64, f64)> = BTreeMap::new();
    for row in 0..layout.rows {
        let points = (0..layout.columns).map(|column| layout.point(row, column));
        let returns: Vec<usize> =
            points.filter(|&point| layout.cloud.is_return(point)).take(EACH).collect();
        let mut elevations: Vec<f64> =
            returns.iter().map(|&point| elevation(layout.cloud, point)).collect();
        if let (Some(&first), Some(found)) = (returns.first(), median(&mut elevations)) {
            let (rows, low, high) = beams.entry(ring[first]).or_insert((0, found, found));
            (*rows, *low, *high) = (*rows + 1, low.min(found), high.max(found));
        }
    }
    let shared = beams.values().filter(|(rows, ..)| *rows > 1);
    let mut spans: Vec<f64> = shared.map(|(_, low, high)| high - low).collect();
    2 * spans.len() > beams.len() && median(&mut spans).is_some_and(|span| span < BEAM_SPREAD)
}

/// Rows that go round more often than that are no sweeps.
const MOST_TURNS: f64 = 1.5;

fn layout(cloud: &PointCloud) -> Layout<'_> {
    let (height, width) = (cloud.height, cloud.width);
    let along_row = spread(cloud, height, width, |row, column| row * width + column);
    let along_column = spread(cloud, width, height, |column, row| row * width + column);
    let is_beam = |spread: Option<f64>| spread.is_some_and(|spread| spread < BEAM_SPREAD);
    let is_swept = |spread: Option<f64>| spread.is_some_and(|spread| spread > 4.0 * BEAM_SPREAD);
    let is_transposed = is_beam(along_column) && is_swept(along_row);
    let (rows, columns) = if is_transposed { (width, height) } else { (height, width) };
    Layout { cloud, rows, columns, is_transposed, order: None }
}

fn image(
    layout: &Layout,
    params: &ProjectionParams,
    step: Option<f64>,
    closes: bool,
    shifts: &[usize],
) -> RangeImage {
    let Layout { cloud, rows, columns, is_transposed, .. } = *layout;
    let mut point_of_pixel = Grid::filled(rows, columns, NOWHERE);
    let mut pixel_of_point = vec![NOWHERE; cloud.len()];
    for (row, &shift) in shifts.iter().enumerate() {
        for column in 0..columns {
            let point = layout.point(row, column);
            if cloud.is_return(point) {
                let moved = column + shift;
                let moved = if moved >= columns { moved - columns } else { moved };
                let pixel = point_of_pixel.pixel(row, moved);
                point_of_pixel.values_mut()[pixel] = point as u32;
                pixel_of_point[point] = pixel as u32;
            }
        }
    }
    let projection =
        if is_transposed { Projection::OrganisedTransposed } else { Projection::Organised };
    let wraps = match params.wrap {
        Wrap::Always => true,
        Wrap::Never => false,
        Wrap::WhereScanCloses => closes,
    };
    let is_sector = !wraps && step.is_some_and(|step| step != 0.0);
    RangeImage {
        projection,
        bands: vec![Band {
            source: None,
            rows: 0..rows,
            projection,
            column_step: if is_sector { step.unwrap_or(0.0).abs() } else { TAU / columns as f64 },
            sensor: Isometry3::identity(),
            evidence: Evidence::Origin,
        }],
        wraps,
        stagger: shifts.iter().map(|&shift| shift.min(columns - shift)).max().unwrap_or(0),
        top_row_first: top_row_first(cloud, rows, columns, |row, column| layout.point(row, column)),
        point_of_pixel,
        pixel_of_point,
    }
}

/// Median over lines of the standard deviation of the elevation within a line, in radians. `None`
/// where fewer than four lines have enough returns to tell.
fn spread(
    cloud: &PointCloud,
    lines: usize,
    length: usize,
    point: impl Fn(usize, usize) -> usize,
) -> Option<f64> {
    const SAMPLED_LINES: usize = 64;
    const FEWEST_LINES: usize = 4;
    const FEWEST_RETURNS: f64 = 8.0;
    let mut deviations: Vec<f64> = (0..lines)
        .step_by(lines.div_ceil(SAMPLED_LINES).max(1))
        .filter_map(|line| {
            let points = (0..length).map(|along| point(line, along));
            let returns = points.filter(|&point| cloud.is_return(point));
            let (n, sum, squares) = returns.fold((0.0, 0.0, 0.0), |(n, sum, squares), point| {
                let elevation = elevation(cloud, point);
                (n + 1.0, sum + elevation, squares + elevation * elevation)
            });
            (n >= FEWEST_RETURNS).then(|| (squares / n - (sum / n).powi(2)).max(0.0).sqrt())
        })
        .collect();
    median(&mut deviations).filter(|_| deviations.len() >= FEWEST_LINES)
}

/// Median azimuth step from column to column, radians; `None` of too few returns.
fn column_step(layout: &Layout) -> Option<f64> {
    let (rows, cloud) = (layout.rows, layout.cloud);
    let mut steps = Vec::new();
    for row in (0..rows).step_by(rows.div_ceil(16).max(1)) {
        for column in 1..layout.columns {
            let (before, after) = (layout.point(row, column - 1), layout.point(row, column));
            if cloud.is_return(before) && cloud.is_return(after) {
                let step = azimuth(cloud, after) - azimuth(cloud, before);
                steps.push((step + PI).rem_euclid(TAU) - PI);
            }
        }
    }
    median(&mut steps)
}

/// By how many columns each row is turned to the right so that all columns look one way; all 0
/// where they do so already, and where the scan does not close (`step` is the azimuth step of one
/// that does, radians).
///
/// Rounding in the driver leaves up to half a column either way, so only what differs by
/// [`LEAST_STAGGER`] columns is taken for a stagger; a few columns tell whether there is one.
fn shifts(layout: &Layout, step: Option<f64>) -> Vec<usize> {
    const FEW: usize = 32;
    let none = vec![0; layout.rows];
    let Some(step) = step else {
        return none;
    };
    let per_column = TAU.copysign(step) / layout.columns as f64;
    let every = layout.columns.div_ceil(FEW);
    let is_staggered = |places: &[Option<f64>]| {
        limits(places).is_some_and(|[least, most]| most - least >= LEAST_STAGGER)
    };
    if !is_staggered(&places(layout, per_column, every)) {
        return none;
    }
    let places = places(layout, per_column, 1);
    let Some([least, most]) = limits(&places).filter(|_| is_staggered(&places)) else {
        return none;
    };
    let middle = (least + most) / 2.0;
    let shift = |place: Option<f64>| place.map_or(0, |place| (place - middle).round() as i64);
    places.into_iter().map(|p| shift(p).rem_euclid(layout.columns as i64) as usize).collect()
}

/// By how many columns each row is turned to the right against the first one that has returns:
/// circular means of the azimuths of its returns, one column in so many, less those that their
/// columns stand for. `None` of too few.
fn places(layout: &Layout, per_column: f64, every: usize) -> Vec<Option<f64>> {
    const FEWEST_RETURNS: usize = 6;
    let place = |row: usize| {
        let returns = layout.azimuths(row, every);
        let (n, sin, cos) = returns.fold((0, 0.0, 0.0), |(n, sin, cos), (column, azimuth)| {
            let (s, c) = (azimuth - column as f64 * per_column).sin_cos();
            (n + 1, sin + s, cos + c)
        });
        (n >= FEWEST_RETURNS).then(|| f64::atan2(sin, cos))
    };
    let places: Vec<Option<f64>> = (0..layout.rows).map(place).collect();
    let first = places.iter().flatten().next().copied().unwrap_or(0.0);
    let turned = |place: f64| ((place - first + PI).rem_euclid(TAU) - PI) / per_column;
    places.into_iter().map(|place| place.map(turned)).collect()
}

/// The least and the most of some places, if there is any.
fn limits(places: &[Option<f64>]) -> Option<[f64; 2]> {
    places.iter().flatten().fold(None, |limits, &place| match limits {
        None => Some([place; 2]),
        Some([least, most]) => Some([f64::min(least, place), f64::max(most, place)]),
    })
}

/// Rows that differ by less, in columns, stand in line.
const LEAST_STAGGER: f64 = 2.0;

/// Whether the upper half of the rows lies higher than the lower half.
fn top_row_first(
    cloud: &PointCloud,
    rows: usize,
    columns: usize,
    point: impl Fn(usize, usize) -> usize,
) -> bool {
    let mut halves = [Vec::new(), Vec::new()];
    for row in 0..rows {
        let half = usize::from(row >= rows / 2);
        for column in (0..columns).step_by(columns.div_ceil(128).max(1)) {
            let point = point(row, column);
            if cloud.is_return(point) {
                halves[half].push(elevation(cloud, point));
            }
        }
    }
    let [first, second] = halves.map(|mut half| median(&mut half));
    first.zip(second).is_none_or(|(first, second)| first >= second)
}
