//! Unorganised clouds: a row per beam, columns from the azimuth, nearest point wins.

use super::elevation;
use super::{
    NOWHERE, Projection, ProjectionParams, RangeImage, RowsFrom, Wrap, beams, columns::Columns,
    sweep::Sweep,
};
use crate::cloud::PointCloud;
use crate::grid::Grid;

/// Size of the paper's range image.
const PAPER_ROWS: usize = 64;
const PAPER_COLUMNS: usize = 2048;

/// The row of every point (anything for points that are no return) and how it was found.
struct Rows {
    projection: Projection,
    count: usize,
    of_point: Vec<u16>,
}

pub(super) fn project(cloud: &PointCloud, params: &ProjectionParams) -> RangeImage {
    let sweep = Sweep::new(cloud);
    let rows = rows(&sweep, params);
    let columns = match (rows.projection, params.columns) {
        (Projection::UniformElevation, given) => Columns::new(given.unwrap_or(PAPER_COLUMNS)),
        (_, given) => Columns::of_beams(&sweep, &rows.of_point, rows.count, given, PAPER_COLUMNS),
    };
    let pixel_of_point = columns.pixels(&sweep.azimuth, &rows.of_point, rows.count);
    RangeImage {
        projection: rows.projection,
        wraps: params.wrap != Wrap::Never,
        top_row_first: true,
        point_of_pixel: nearest_points(cloud, &pixel_of_point, rows.count, columns.count),
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

fn rows(sweep: &Sweep, params: &ProjectionParams) -> Rows {
    let found = match params.rows_from {
        RowsFrom::UniformElevation => None,
        RowsFrom::Best => {
            by_ring(sweep).or_else(|| by_scan_order(sweep)).or_else(|| by_elevations(sweep.cloud))
        }
    };
    found.unwrap_or_else(|| by_uniform_elevation(sweep.cloud, params))
}

fn by_ring(sweep: &Sweep) -> Option<Rows> {
    let ring = sweep.cloud.ring.as_ref()?;
    let row_of_ring = beams::row_of_ring(sweep, ring)?;
    Some(Rows {
        projection: Projection::Ring,
        count: row_of_ring.len(),
        of_point: ring
            .iter()
            .map(|&ring| row_of_ring.get(usize::from(ring)).copied().unwrap_or(0))
            .collect(),
    })
}

fn by_scan_order(sweep: &Sweep) -> Option<Rows> {
    let (of_point, count) = beams::rows_of_turns(sweep)?;
    Some(Rows { projection: Projection::ScanOrder, count, of_point })
}

fn by_elevations(cloud: &PointCloud) -> Option<Rows> {
    let beams = beams::elevation_peaks(cloud)?;
    Some(Rows {
        projection: Projection::Elevations,
        count: beams.len(),
        of_point: (0..cloud.len())
            .map(|point| beams::nearest(&beams, elevation(cloud, point)))
            .collect(),
    })
}

fn by_uniform_elevation(cloud: &PointCloud, params: &ProjectionParams) -> Rows {
    let count = params.rows.unwrap_or(PAPER_ROWS);
    let (upper, lower) = params.field_of_view.unwrap_or_else(|| beams::field_of_view(cloud));
    let of_point = (0..cloud.len())
        .map(|point| {
            let down = (upper - elevation(cloud, point)) / (upper - lower);
            // Casting saturates: above the field of view is row 0, NaN too.
            ((down * count as f64) as usize).min(count - 1) as u16
        })
        .collect();
    Rows { projection: Projection::UniformElevation, count, of_point }
}
