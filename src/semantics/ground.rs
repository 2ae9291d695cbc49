//! Ground removal on the range image after Bogoslavskyi and Stachniss (2016): per column, from the
//! bottom up, the slope between successive returns; ground spreads from the lowest returns to
//! neighbours of similar slope. No sensor height is asked for.

use crate::cloud::PointCloud;
use crate::range_image::RangeImage;

/// Parameters of the ground removal.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct GroundParams {
    /// Steepest slope at which a column's lowest return can be ground, radians. Default 45 degrees
    /// (the paper's).
    pub start_slope: f64,
    /// Largest difference of slope between neighbouring ground pixels, radians. Default 5 degrees (the
    /// paper's).
    pub slope_change: f64,
}

impl Default for GroundParams {
    fn default() -> Self {
        GroundParams { start_slope: 45_f64.to_radians(), slope_change: 5_f64.to_radians() }
    }
}

/// N: whether each point is ground.
pub fn ground(cloud: &PointCloud, image: &RangeImage, params: &GroundParams) -> Vec<bool> {
    let (rows, columns) = (image.rows(), image.columns());
    let pixel = |up: usize, column: usize| {
        let row = if image.top_row_first { rows - 1 - up } else { up };
        row * columns + column
    };
    let mut slope = vec![f64::NAN; rows * columns];
    let mut is_ground = vec![false; rows * columns];
    let mut stack = Vec::new();
    for column in 0..columns {
        let mut below: Option<(usize, [f32; 3])> = None;
        let mut lowest = true;
        for up in 0..rows {
            let at = pixel(up, column);
            let Some(point) = image.point_at(at) else {
                continue;
            };
            let here = cloud.position(point);
            if let Some((under, before)) = below {
                let run = (f64::from(here[0]).hypot(f64::from(here[1]))
                    - f64::from(before[0]).hypot(f64::from(before[1])))
                .abs();
                let rise = (f64::from(here[2]) - f64::from(before[2])).abs();
                slope[at] = rise.atan2(run);
                if lowest {
                    slope[under] = slope[at];
                    if slope[at] < params.start_slope {
                        is_ground[under] = true;
                        stack.push(under);
                    }
                    lowest = false;
                }
            }
            below = Some((at, here));
        }
    }
    while let Some(at) = stack.pop() {
        let (row, column) = (at / columns, at % columns);
        let mut visit = |next: usize| {
            if !is_ground[next] && (slope[next] - slope[at]).abs() < params.slope_change {
                is_ground[next] = true;
                stack.push(next);
            }
        };
        visit(row * columns + (column + 1) % columns);
        visit(row * columns + (column + columns - 1) % columns);
        if row > 0 {
            visit(at - columns);
        }
        if row + 1 < rows {
            visit(at + columns);
        }
    }
    (0..cloud.len())
        .map(|point| image.pixel_of(point).is_some_and(|pixel| is_ground[pixel]))
        .collect()
}
