//! The spinning sensors: where their beams point, when they fire, how their drivers store a sweep.

use std::f64::consts::{PI, TAU};
use std::fmt;
use std::str::FromStr;

/// Time of one turn at 10 Hz, in nanoseconds.
pub(super) const TURN_NS: u64 = 100_000_000;

/// Time between two lasers of one VLP-16 firing, in nanoseconds.
const VLP16_LASER_NS: u64 = 2_304;

/// Time between two lasers of one HDL-32E firing, in nanoseconds.
const HDL32E_LASER_NS: u64 = 1_152;

/// A spinning multi-beam LiDAR at 10 Hz, turning clockwise seen from above: azimuth starts at the rear
/// (+pi) and decreases with the column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sensor {
    /// Velodyne HDL-64E as KITTI carries it: 64 beams, 2083 columns; returns only, stored ring by ring
    /// from the highest beam (ring 0), and within a ring by increasing azimuth from straight ahead.
    Hdl64e,
    /// Velodyne VLP-16: 16 beams, 1800 columns; returns only, stored firing by firing with the lasers
    /// in their firing order; ring 0 is the lowest beam.
    Vlp16,
    /// Velodyne HDL-32E: 32 beams from +10.67 to -30.67 degrees, 2170 columns; returns only, stored firing
    /// by firing from the lowest beam, ring 0.
    Hdl32e,
    /// Ouster OS1-128: 128 x 1024, organised, destaggered; row and ring 0 are the highest beam, and a
    /// pixel without a return is the origin.
    #[allow(non_camel_case_types)]
    Os1_128,
}

impl Sensor {
    /// All of them.
    pub const ALL: [Sensor; 4] = [Sensor::Hdl64e, Sensor::Vlp16, Sensor::Hdl32e, Sensor::Os1_128];

    /// Number of beams.
    pub fn beams(self) -> usize {
        match self {
            Sensor::Hdl64e => 64,
            Sensor::Vlp16 => 16,
            Sensor::Hdl32e => 32,
            Sensor::Os1_128 => 128,
        }
    }

    /// Number of firings in a turn.
    pub fn columns(self) -> usize {
        match self {
            Sensor::Hdl64e => 2083,
            Sensor::Vlp16 => 1800,
            Sensor::Hdl32e => 2170,
            Sensor::Os1_128 => 1024,
        }
    }

    /// Elevation of beam `row` in radians, row 0 being the highest.
    pub fn elevation(self, row: usize) -> f64 {
        let row = row as f64;
        let degrees = match self {
            Sensor::Hdl64e if row < 32.0 => 2.0 - row / 3.0,
            Sensor::Hdl64e => -8.83 - 0.5 * (row - 32.0),
            Sensor::Vlp16 => 15.0 - 2.0 * row,
            Sensor::Hdl32e => 10.67 - 41.34 * row / 31.0,
            Sensor::Os1_128 => 22.5 - 45.0 * row / 127.0,
        };
        degrees.to_radians()
    }

    /// Azimuth of the middle of `column` in radians, counter-clockwise from x. No column of the HDL-64E,
    /// which has an odd number of them, points straight ahead, where its storage begins and ends.
    pub fn azimuth(self, column: usize) -> f64 {
        let firing = column as f64 + if self == Sensor::Hdl64e { 0.0 } else { 0.5 };
        PI - TAU * firing / self.columns() as f64
    }

    /// Height above the ground in metres.
    pub fn height(self) -> f64 {
        match self {
            Sensor::Hdl64e => 1.73,
            Sensor::Vlp16 | Sensor::Hdl32e | Sensor::Os1_128 => 1.80,
        }
    }

    /// The farthest return in metres.
    pub fn max_range(self) -> f64 {
        match self {
            Sensor::Hdl64e | Sensor::Os1_128 => 120.0,
            Sensor::Vlp16 | Sensor::Hdl32e => 100.0,
        }
    }

    /// Step that ranges are rounded to, in metres.
    pub fn range_step(self) -> f64 {
        match self {
            Sensor::Hdl64e | Sensor::Vlp16 | Sensor::Hdl32e => 0.002,
            Sensor::Os1_128 => 0.001,
        }
    }

    /// Standard deviation of the range noise in metres.
    pub(super) fn range_noise(self) -> f64 {
        match self {
            Sensor::Hdl64e => 0.017,
            Sensor::Vlp16 | Sensor::Os1_128 => 0.015,
            Sensor::Hdl32e => 0.02,
        }
    }

    /// Standard deviation of the azimuth of one firing in radians.
    pub(super) fn azimuth_noise(self) -> f64 {
        match self {
            Sensor::Hdl64e => 3e-4,
            Sensor::Vlp16 | Sensor::Hdl32e => 2e-4,
            Sensor::Os1_128 => 1e-4,
        }
    }

    /// Range in metres at which a white, perpendicular surface still comes back in 63 of 100 firings.
    pub(super) fn reach(self) -> f64 {
        match self {
            Sensor::Hdl64e => 240.0,
            Sensor::Vlp16 | Sensor::Hdl32e => 200.0,
            Sensor::Os1_128 => 220.0,
        }
    }

    /// Beam number as the driver gives it for `row`, row 0 being the highest.
    pub fn ring(self, row: usize) -> u16 {
        match self {
            Sensor::Hdl64e | Sensor::Os1_128 => row as u16,
            Sensor::Vlp16 | Sensor::Hdl32e => (self.beams() - 1 - row) as u16,
        }
    }

    /// Time of a firing after the stamp, in nanoseconds.
    pub fn time_offset_ns(self, row: usize, column: usize) -> u32 {
        let firing = TURN_NS * column as u64 / self.columns() as u64;
        let laser = match self {
            Sensor::Vlp16 => VLP16_LASER_NS * vlp16_laser(row) as u64,
            Sensor::Hdl32e => HDL32E_LASER_NS * (self.beams() - 1 - row) as u64,
            Sensor::Hdl64e | Sensor::Os1_128 => 0,
        };
        (firing + laser) as u32
    }

    /// Every (row, column) in the order of storage.
    pub(super) fn storage_order(self) -> Box<dyn Iterator<Item = (usize, usize)>> {
        let (rows, columns) = (self.beams(), self.columns());
        match self {
            Sensor::Hdl64e => Box::new((0..rows).flat_map(move |row| {
                let ahead = columns.div_ceil(2);
                let columns = (0..ahead).rev().chain((ahead..columns).rev());
                columns.map(move |column| (row, column))
            })),
            Sensor::Vlp16 => Box::new(
                (0..columns)
                    .flat_map(move |column| (0..rows).map(move |laser| (vlp16_row(laser), column))),
            ),
            Sensor::Hdl32e => Box::new(
                (0..columns).flat_map(move |column| (0..rows).rev().map(move |row| (row, column))),
            ),
            Sensor::Os1_128 => Box::new(
                (0..rows).flat_map(move |row| (0..columns).map(move |column| (row, column))),
            ),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Sensor::Hdl64e => "hdl-64e",
            Sensor::Vlp16 => "vlp-16",
            Sensor::Hdl32e => "hdl-32e",
            Sensor::Os1_128 => "os1-128",
        }
    }
}

/// Row, from the highest, of a VLP-16's laser: even lasers climb from -15 degrees, odd ones from +1.
fn vlp16_row(laser: usize) -> usize {
    15 - (laser / 2 + 8 * (laser % 2))
}

/// The inverse of [`vlp16_row`].
fn vlp16_laser(row: usize) -> usize {
    let ring = 15 - row;
    2 * (ring % 8) + ring / 8
}

impl fmt::Display for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Sensor {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|sensor| sensor.name() == name);
        found.ok_or_else(|| format!("`{name}` is no sensor: hdl-64e, vlp-16, hdl-32e or os1-128"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for sensor in Sensor::ALL {
            assert_eq!(sensor.to_string().parse(), Ok(sensor));
        }
        assert!("hdl64".parse::<Sensor>().is_err());
    }

    #[test]
    fn elevations_descend_between_the_data_sheets_limits() {
        for (sensor, first, last) in [
            (Sensor::Hdl64e, 2.0, -24.33),
            (Sensor::Vlp16, 15.0, -15.0),
            (Sensor::Hdl32e, 10.67, -30.67),
            (Sensor::Os1_128, 22.5, -22.5),
        ] {
            let degrees: Vec<f64> =
                (0..sensor.beams()).map(|row| sensor.elevation(row).to_degrees()).collect();
            assert!((degrees[0] - first).abs() < 1e-9);
            assert!((degrees[sensor.beams() - 1] - last).abs() < 1e-9);
            assert!(degrees.windows(2).all(|pair| pair[0] > pair[1]));
        }
    }

    #[test]
    fn vlp16_fires_its_lasers_interleaved() {
        let degrees: Vec<f64> =
            (0..4).map(|laser| Sensor::Vlp16.elevation(vlp16_row(laser)).to_degrees()).collect();
        for (found, expected) in degrees.iter().zip([-15.0, 1.0, -13.0, 3.0]) {
            assert!((found - expected).abs() < 1e-9);
        }
        assert!((0..16).all(|laser| vlp16_laser(vlp16_row(laser)) == laser));
    }

    #[test]
    fn storage_holds_every_pixel_once() {
        for sensor in Sensor::ALL {
            let mut order: Vec<_> = sensor.storage_order().collect();
            order.sort_unstable();
            order.dedup();
            assert_eq!(order.len(), sensor.beams() * sensor.columns());
        }
    }
}
