//! Unorganised clouds: a row per beam, columns from the azimuth, nearest point wins.

use std::f64::consts::TAU;

use nalgebra::Isometry3;

use super::angles::elevation;
use super::band::Band;
use super::beams::Rings;
use super::columns::Columns;
use super::evidence::Evidence;
use super::image::{NOWHERE, RangeImage};
use super::params::{ProjectionParams, RowsFrom, Wrap};
use super::projection::Projection;
use super::sweep::Sweep;
use super::{beams, coverage, spacing};
use crate::cloud::point_cloud::PointCloud;
use crate::geometry::grid::Grid;

/// Size of the paper's range image.
const PAPER_ROWS: usize = 64;
const PAPER_COLUMNS: usize = 2048;

/// The row of every point (anything for points that are no return) and how it was found.
struct Rows {
    projection: Projection,
    count: usize,
    of_point: Vec<u16>,
    /// Columns of the full circle, where the rows bring some with them.
    columns: Option<usize>,
}

/// The image of the points of one sensor at the origin, in whatever order they are stored.
pub(super) fn unorganised(cloud: &PointCloud, params: &ProjectionParams) -> RangeImage {
    let sweep = Sweep::new(cloud);
    let ring = cloud.ring.as_ref().filter(|_| params.rows_from == RowsFrom::Best);
    let rings = ring.and_then(|ring| Rings::of(&sweep, ring));
    image(&sweep, rings, params)
}

fn image(sweep: &Sweep, rings: Option<Rings>, params: &ProjectionParams) -> RangeImage {
    let rows = rows(sweep, rings, params);
    let columns = match (rows.projection, params.columns.or(rows.columns)) {
        (Projection::UniformElevation, given) => Columns::new(given.unwrap_or(PAPER_COLUMNS)),
        (_, given) => Columns::of_beams(sweep, &rows.of_point, rows.count, given, PAPER_COLUMNS),
    };
    let pixel_of_point = columns.pixels(&sweep.azimuth, &rows.of_point, rows.count);
    RangeImage {
        projection: rows.projection,
        wraps: match params.wrap {
            Wrap::Always => true,
            Wrap::Never => false,
            Wrap::WhereScanCloses => !coverage::is_open_behind(sweep),
        },
        top_row_first: true,
        stagger: 0,
        bands: vec![Band {
            source: None,
            rows: 0..rows.count,
            projection: rows.projection,
            column_step: TAU / columns.count as f64,
            sensor: Isometry3::identity(),
            evidence: Evidence::Origin,
        }],
        point_of_pixel: nearest_points(sweep.cloud, &pixel_of_point, rows.count, columns.count),
        pixel_of_point,
    }
}

fn nearest_points(
    cloud: &PointCloud,
    pixel_of_point: &[u32],
    rows: usize,
    columns: usize,
) -> Grid<u32> {
    let mut nearest = Grid::filled(rows, columns, NOWHERE);
    let pixels = nearest.values_mut();
    for (point, &pixel) in (0_u32..).zip(pixel_of_point) {
        // No pixel is numbered `NOWHERE`.
        let Some(seen) = pixels.get_mut(pixel as usize) else {
            continue;
        };
        let range = |point: u32| cloud.squared_range(point as usize);
        if *seen == NOWHERE || range(point) < range(*seen) {
            *seen = point;
        }
    }
    nearest
}

fn rows(sweep: &Sweep, rings: Option<Rings>, params: &ProjectionParams) -> Rows {
    let found = match (params.rows_from, params.rows, params.field_of_view) {
        (RowsFrom::Best, None, None) => by_ring(sweep, rings)
            .or_else(|| by_scan_order(sweep))
            .or_else(|| by_elevations(sweep.cloud)),
        _ => None,
    };
    found.unwrap_or_else(|| by_uniform_elevation(sweep, params))
}

fn by_ring(sweep: &Sweep, rings: Option<Rings>) -> Option<Rows> {
    let ring = sweep.cloud.ring.as_ref()?;
    let rings = rings.filter(|rings| rings.are_level() || beams::are_swept(sweep, ring))?;
    let row_of_ring = rings.rows();
    Some(Rows {
        projection: Projection::Ring,
        count: row_of_ring.len(),
        of_point: ring
            .iter()
            .map(|&ring| row_of_ring.get(usize::from(ring)).copied().unwrap_or(0))
            .collect(),
        columns: None,
    })
}

fn by_scan_order(sweep: &Sweep) -> Option<Rows> {
    let (of_point, count) = beams::rows_of_turns(sweep)?;
    Some(Rows { projection: Projection::ScanOrder, count, of_point, columns: None })
}

fn by_elevations(cloud: &PointCloud) -> Option<Rows> {
    let beams = beams::elevation_peaks(cloud)?;
    Some(Rows {
        projection: Projection::Elevations,
        count: beams.len(),
        of_point: (0..cloud.len())
            .map(|point| beams::nearest(&beams, elevation(cloud, point)))
            .collect(),
        columns: None,
    })
}

/// Rows of equal elevation: the size that is asked for, else as fine as the points lie, else the
/// paper's.
fn by_uniform_elevation(sweep: &Sweep, params: &ProjectionParams) -> Rows {
    let cloud = sweep.cloud;
    let (upper, lower) = params.field_of_view.unwrap_or_else(|| beams::field_of_view(cloud));
    let found = match params.rows_from {
        RowsFrom::Best => spacing::resolution(sweep, (upper, lower)),
        RowsFrom::UniformElevation => None,
    };
    let count = params.rows.or(found.map(|found| found.rows)).unwrap_or(PAPER_ROWS);
    let of_point = (0..cloud.len())
        .map(|point| {
            let down = (upper - elevation(cloud, point)) / (upper - lower);
            // Casting saturates: above the field of view is row 0, NaN too.
            ((down * count as f64) as usize).min(count - 1) as u16
        })
        .collect();
    let columns = found.map(|found| found.columns);
    Rows { projection: Projection::UniformElevation, count, of_point, columns }
}
