//! Unorganised clouds: a row per beam, columns from the azimuth, nearest point wins.

use super::azimuth::azimuths;
use super::elevation;
use super::{
    NOWHERE, Projection, ProjectionParams, RangeImage, RowsFrom, Wrap, beams, columns::Columns,
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
    let azimuths = azimuths(cloud);
    let rows = rows(cloud, &azimuths, params);
    let columns = match (rows.projection, params.columns) {
        (Projection::UniformElevation, given) => Columns::new(given.unwrap_or(PAPER_COLUMNS)),
        (_, given) => {
            let (row, count) = (&rows.of_point, rows.count);
            Columns::of_beams(cloud, &azimuths, row, count, given, PAPER_COLUMNS)
        }
    };
    let pixel = |point: usize| {
        if !cloud.is_return(point) {
            return NOWHERE;
        }
        let row = rows.of_point[point];
        (usize::from(row) * columns.count + columns.of(azimuths[point], row)) as u32
    };
    let pixel_of_point: Vec<u32> = (0..cloud.len()).map(pixel).collect();
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
    for (point, &pixel) in pixel_of_point.iter().enumerate() {
        if pixel == NOWHERE {
            continue;
        }
        let seen = &mut pixels[pixel as usize];
        if *seen == NOWHERE || cloud.squared_range(point) < cloud.squared_range(*seen as usize) {
            *seen = point as u32;
        }
    }
    nearest
}

fn rows(cloud: &PointCloud, azimuths: &[f32], params: &ProjectionParams) -> Rows {
    let found = match params.rows_from {
        RowsFrom::UniformElevation => None,
        RowsFrom::Best => by_ring(cloud)
            .or_else(|| by_scan_order(cloud, azimuths))
            .or_else(|| by_elevations(cloud)),
    };
    found.unwrap_or_else(|| by_uniform_elevation(cloud, params))
}

fn by_ring(cloud: &PointCloud) -> Option<Rows> {
    let ring = cloud.ring.as_ref()?;
    let row_of_ring = beams::row_of_ring(cloud, ring)?;
    Some(Rows {
        projection: Projection::Ring,
        count: row_of_ring.len(),
        of_point: ring
            .iter()
            .map(|&ring| row_of_ring.get(usize::from(ring)).copied().unwrap_or(0))
            .collect(),
    })
}

fn by_scan_order(cloud: &PointCloud, azimuths: &[f32]) -> Option<Rows> {
    let turn = beams::turns(cloud, azimuths)?;
    let row_of_turn = beams::row_of_ring(cloud, &turn)?;
    Some(Rows {
        projection: Projection::ScanOrder,
        count: row_of_turn.len(),
        of_point: turn.iter().map(|&turn| row_of_turn[usize::from(turn)]).collect(),
    })
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
