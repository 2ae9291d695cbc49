//! Where beams point: elevations and turns of those that spin, curves of those that do not.

use std::f64::consts::TAU;

use super::model::{Sensor, TURN_NS};

/// Elevation of a beam in degrees, row 0 being the highest.
pub(super) fn elevation(sensor: Sensor, row: usize) -> f64 {
    let number = row as f64;
    match sensor {
        Sensor::Hdl64e if row < 32 => 2.0 - number / 3.0,
        Sensor::Hdl64e => -8.83 - 0.5 * (number - 32.0),
        Sensor::Vlp16 => 15.0 - 2.0 * number,
        Sensor::Hdl32e => 10.67 - 41.34 * number / 31.0,
        Sensor::Os1_128 => 22.5 - 45.0 * number / 127.0,
        Sensor::Vlp32c => VLP32C[row],
        Sensor::Vls128 => graded(row, 128, 0.11, [15.0, -25.0], 2.0),
        Sensor::Pandar40pDual => PANDAR40P[row],
        Sensor::Helios => graded(row, 32, 1.33, [15.0, -55.0], 0.0),
        Sensor::Os1_64Gradient | Sensor::Os1_64Staggered => {
            graded(row, 64, 0.35, [16.6, -16.6], 0.0)
        }
        Sensor::M1 => 12.4 - 0.2 * number,
        Sensor::Hap | Sensor::Mid360 => 0.0,
    }
}

/// Elevations of a VLP-32C in degrees, after its manual.
const VLP32C: [f64; 32] = [
    15.0, 10.333, 7.0, 4.667, 3.333, 2.333, 1.667, 1.333, 1.0, 0.667, 0.333, 0.0, -0.333, -0.667,
    -1.0, -1.333, -1.667, -2.0, -2.333, -2.667, -3.0, -3.333, -3.667, -4.0, -4.667, -5.333, -6.148,
    -7.254, -8.843, -11.31, -15.639, -25.0,
];

/// Elevations of a Pandar40P in degrees: a third of a degree apart from +2 to -6, a degree and more
/// elsewhere.
const PANDAR40P: [f64; 40] = [
    15.0, 11.0, 8.0, 5.0, 3.0, 2.0, 1.67, 1.33, 1.0, 0.67, 0.33, 0.0, -0.33, -0.67, -1.0, -1.33,
    -1.67, -2.0, -2.33, -2.67, -3.0, -3.33, -3.67, -4.0, -4.33, -4.67, -5.0, -5.33, -5.67, -6.0,
    -7.0, -8.0, -9.0, -10.0, -11.0, -12.0, -13.0, -14.0, -19.0, -25.0,
];

/// Beams that lie `finest` degrees apart at the horizon and ever farther from each other towards
/// the limits: a straight line and a cube in the distance from the beam nearest to the horizon.
/// `level` shifts that one.
fn graded(row: usize, beams: usize, finest: f64, [upper, lower]: [f64; 2], level: f64) -> f64 {
    let last = (beams - 1) as f64;
    let middle = (last * upper / (upper - lower) - level).round();
    let from_middle = middle - row as f64;
    let (limit, reach) = if from_middle > 0.0 { (upper, middle) } else { (-lower, last - middle) };
    let cubed = (limit - finest * reach) / reach.powi(3);
    from_middle.signum() * (finest * from_middle.abs() + cubed * from_middle.abs().powi(3))
}

/// Azimuth in degrees by which a beam is turned against the others that fire with it.
pub(super) fn turn(sensor: Sensor, row: usize) -> f64 {
    match sensor {
        Sensor::Vlp32c => [1.4, -4.2, 1.4, -1.4, 4.2, -1.4][row % 6],
        Sensor::Vls128 => [-6.354, -4.548, -2.732, -0.911, 0.911, 2.732, 4.548, 6.354][row % 8],
        Sensor::Os1_64Staggered => [4.2, 1.4, -1.4, -4.2][row % 4],
        _ => 0.0,
    }
}

/// Columns of one of the five modules of an M1.
const MODULE: usize = 120;
/// How far a line of an M1 bends down at its ends, degrees.
const BEND: f64 = 0.6;

/// The module of an M1 that fires in a column.
pub(super) fn module(column: usize) -> usize {
    column / MODULE
}

/// A shot of an M1: azimuth and elevation, radians.
pub(super) fn raster(row: usize, column: usize) -> [f64; 2] {
    let azimuth = 59.9 - 0.2 * column as f64;
    let elevation = elevation(Sensor::M1, row) - BEND * (azimuth / 60.0).powi(2);
    [azimuth.to_radians(), elevation.to_radians()]
}

/// Line by line, forth and back; the five modules fire at a time.
pub(super) fn raster_order() -> impl Iterator<Item = (usize, usize)> {
    (0..Sensor::M1.beams()).flat_map(|row| {
        (0..MODULE).flat_map(move |step| {
            let step = if row % 2 == 0 { step } else { MODULE - 1 - step };
            (0..5).map(move |module| (row, module * MODULE + step))
        })
    })
}

/// When an M1 fires, nanoseconds after the frame's start.
pub(super) fn raster_time(row: usize, column: usize) -> u64 {
    let step = column % MODULE;
    let step = if row.is_multiple_of(2) { step } else { MODULE - 1 - step };
    TURN_NS * (row * MODULE + step) as u64 / (Sensor::M1.beams() * MODULE) as u64
}

/// A shot of a HAP: a Lissajous curve of two frequencies without a common measure, radians.
pub(super) fn lissajous(shot: usize) -> [f64; 2] {
    let turns = shot as f64 / Sensor::Hap.columns() as f64;
    let azimuth = 60.0 * triangle(turns * 71.0);
    let elevation = 12.5 * triangle(turns * 43.0 * 2_f64.sqrt());
    [azimuth.to_radians(), elevation.to_radians()]
}

/// A shot of a Mid-360: a line nods while it goes round, and each of the four lies a little above
/// the other; radians.
pub(super) fn rosette(line: usize, shot: usize) -> [f64; 2] {
    let turns = shot as f64 / Sensor::Mid360.columns() as f64;
    let azimuth = TAU * (turns * 29.0 * 1.618_033_988_75 + 0.013 * line as f64).fract();
    let nod = triangle(turns * 83.0 + 0.07 * line as f64);
    let elevation = 22.5 + 29.0 * nod + 0.35 * (line as f64 - 1.5);
    [azimuth - TAU / 2.0, elevation.to_radians()]
}

/// A triangle wave between -1 and 1 of period 1.
fn triangle(turns: f64) -> f64 {
    4.0 * (turns.fract() - 0.5).abs() - 1.0
}
