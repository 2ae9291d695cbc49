//! Organised clouds: the image as it stands.

use std::f64::consts::{PI, TAU};

use super::{NOWHERE, Projection, ProjectionParams, RangeImage, Wrap, azimuth, elevation, median};
use crate::cloud::PointCloud;
use crate::grid::Grid;

/// The elevation of one beam stays within this standard deviation over a turn, radians: offsets of the
/// lasers and a tilted mount included, and well below the field of view of any scanner.
const BEAM_SPREAD: f64 = 0.5 * PI / 180.0;

/// The cloud's own grid.
pub(super) fn project(cloud: &PointCloud, params: &ProjectionParams) -> RangeImage {
    let (height, width) = (cloud.height, cloud.width);
    let along_row = spread(cloud, height, width, |row, column| row * width + column);
    let along_column = spread(cloud, width, height, |column, row| row * width + column);
    let is_beam = |spread: Option<f64>| spread.is_some_and(|spread| spread < BEAM_SPREAD);
    let is_swept = |spread: Option<f64>| spread.is_some_and(|spread| spread > 4.0 * BEAM_SPREAD);
    let transposed = is_beam(along_column) && is_swept(along_row);
    let (rows, columns) = if transposed { (width, height) } else { (height, width) };
    let point = |row: usize, column: usize| {
        if transposed { column * width + row } else { row * width + column }
    };

    let mut point_of_pixel = Grid::filled(rows, columns, NOWHERE);
    let mut pixel_of_point = vec![NOWHERE; cloud.len()];
    for row in 0..rows {
        for column in 0..columns {
            let point = point(row, column);
            if cloud.is_return(point) {
                let pixel = point_of_pixel.pixel(row, column);
                point_of_pixel.values_mut()[pixel] = point as u32;
                pixel_of_point[point] = pixel as u32;
            }
        }
    }
    let wraps = match params.wrap {
        Wrap::Always => true,
        Wrap::Never => false,
        Wrap::WhereScanCloses => closes(cloud, rows, columns, point),
    };
    RangeImage {
        projection: if transposed {
            Projection::OrganisedTransposed
        } else {
            Projection::Organised
        },
        wraps,
        top_row_first: top_row_first(cloud, rows, columns, point),
        point_of_pixel,
        pixel_of_point,
    }
}

/// Median over lines of the standard deviation of the elevation within a line, in radians. `None` where
/// fewer than four lines have enough returns to tell.
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

/// Whether the columns go all the way round: the median azimuth step times the columns is a turn.
fn closes(
    cloud: &PointCloud,
    rows: usize,
    columns: usize,
    point: impl Fn(usize, usize) -> usize,
) -> bool {
    let mut steps = Vec::new();
    for row in (0..rows).step_by(rows.div_ceil(16).max(1)) {
        for column in 1..columns {
            let (before, after) = (point(row, column - 1), point(row, column));
            if cloud.is_return(before) && cloud.is_return(after) {
                let step = azimuth(cloud, after) - azimuth(cloud, before);
                steps.push((step + PI).rem_euclid(TAU) - PI);
            }
        }
    }
    let turn = median(&mut steps).map_or(0.0, |step| step.abs() * columns as f64);
    (0.95 * TAU..1.05 * TAU).contains(&turn)
}

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
