//! The sensors: where their beams point, when they fire, how their drivers store a sweep.

mod beams;
mod model;

use std::f64::consts::{PI, TAU};
use std::fmt;
use std::str::FromStr;

pub use model::Sensor;
pub(super) use model::TURN_NS;

/// Time between two lasers of one VLP-16 firing, in nanoseconds.
const VLP16_LASER_NS: u64 = 2_304;

/// Time between two lasers of one HDL-32E firing, in nanoseconds.
const HDL32E_LASER_NS: u64 = 1_152;

impl Sensor {
    /// The four that tables of methods are about.
    pub const USUAL: [Sensor; 4] = [Sensor::Hdl64e, Sensor::Vlp16, Sensor::Hdl32e, Sensor::Os1_128];

    /// All of them.
    pub const ALL: [Sensor; 13] = [
        Sensor::Vlp16,
        Sensor::Hdl32e,
        Sensor::Vlp32c,
        Sensor::Hdl64e,
        Sensor::Vls128,
        Sensor::Pandar40pDual,
        Sensor::Helios,
        Sensor::Os1_128,
        Sensor::Os1_64Gradient,
        Sensor::Os1_64Staggered,
        Sensor::M1,
        Sensor::Hap,
        Sensor::Mid360,
    ];

    /// Number of beams; of a solid state the lines of its raster, or shots at a time.
    pub fn beams(self) -> usize {
        match self {
            Sensor::Hdl64e | Sensor::Os1_64Gradient | Sensor::Os1_64Staggered => 64,
            Sensor::Vlp16 => 16,
            Sensor::Hdl32e | Sensor::Vlp32c | Sensor::Helios => 32,
            Sensor::Os1_128 | Sensor::Vls128 => 128,
            Sensor::Pandar40pDual => 40,
            Sensor::M1 => 125,
            Sensor::Hap => 1,
            Sensor::Mid360 => 4,
        }
    }

    /// Number of firings in a turn, or in a frame.
    pub fn columns(self) -> usize {
        match self {
            Sensor::Hdl64e => 2083,
            Sensor::Vlp16
            | Sensor::Vlp32c
            | Sensor::Vls128
            | Sensor::Pandar40pDual
            | Sensor::Helios => 1800,
            Sensor::Hdl32e => 2170,
            Sensor::Os1_128 | Sensor::Os1_64Gradient | Sensor::Os1_64Staggered => 1024,
            Sensor::M1 => 600,
            Sensor::Hap => 45_000,
            Sensor::Mid360 => 5_000,
        }
    }

    /// Whether rows and columns are those of the message, with the origin for no return.
    pub fn is_organised(self) -> bool {
        matches!(self, Sensor::Os1_128 | Sensor::Os1_64Gradient | Sensor::Os1_64Staggered)
    }

    /// Whether a beam that meets an edge gives two returns.
    pub fn is_dual(self) -> bool {
        self == Sensor::Pandar40pDual
    }

    /// Whether the sensor looks all round.
    pub fn closes(self) -> bool {
        !matches!(self, Sensor::M1 | Sensor::Hap)
    }

    /// Elevation of beam `row` in radians, row 0 being the highest; of a raster that straight
    /// ahead.
    pub fn elevation(self, row: usize) -> f64 {
        beams::elevation(self, row).to_radians()
    }

    /// Azimuth of the middle of `column` in radians, counter-clockwise from x. No column of the
    /// HDL-64E, which has an odd number of them, points straight ahead, where its storage begins
    /// and ends.
    pub fn azimuth(self, column: usize) -> f64 {
        let firing = column as f64 + if self == Sensor::Hdl64e { 0.0 } else { 0.5 };
        PI - TAU * firing / self.columns() as f64
    }

    /// Azimuth and elevation of a shot in radians, as they would be without noise.
    pub fn direction(self, row: usize, column: usize) -> [f64; 2] {
        match self {
            Sensor::M1 => beams::raster(row, column),
            Sensor::Hap => beams::lissajous(column),
            Sensor::Mid360 => beams::rosette(row, column),
            _ => {
                let azimuth = self.azimuth(column) + beams::turn(self, row).to_radians();
                let turned = match azimuth {
                    above if above > PI => above - TAU,
                    below if below < -PI => below + TAU,
                    within => within,
                };
                [turned, self.elevation(row)]
            }
        }
    }

    /// Height above the ground in metres.
    pub fn height(self) -> f64 {
        match self {
            Sensor::Hdl64e => 1.73,
            Sensor::Mid360 => 0.6,
            _ => 1.80,
        }
    }

    /// The farthest return in metres.
    pub fn max_range(self) -> f64 {
        match self {
            Sensor::Vlp16 | Sensor::Hdl32e => 100.0,
            Sensor::Mid360 => 70.0,
            _ => 120.0,
        }
    }

    /// Step that ranges are rounded to, in metres.
    pub fn range_step(self) -> f64 {
        match self {
            Sensor::Os1_128 | Sensor::Os1_64Gradient | Sensor::Os1_64Staggered => 0.001,
            _ => 0.002,
        }
    }

    /// Standard deviation of the range noise in metres.
    pub(super) fn range_noise(self) -> f64 {
        match self {
            Sensor::Hdl64e => 0.017,
            Sensor::Hdl32e | Sensor::M1 | Sensor::Hap | Sensor::Mid360 => 0.02,
            _ => 0.015,
        }
    }

    /// Standard deviation of the azimuth of one firing in radians.
    pub(super) fn azimuth_noise(self) -> f64 {
        match self {
            Sensor::Hdl64e => 3e-4,
            Sensor::Os1_128 | Sensor::Os1_64Gradient | Sensor::Os1_64Staggered => 1e-4,
            _ => 2e-4,
        }
    }

    /// Range in metres at which a white, perpendicular surface still comes back in 63 of 100
    /// firings.
    pub(super) fn reach(self) -> f64 {
        match self {
            Sensor::Hdl64e | Sensor::Vls128 => 240.0,
            Sensor::Vlp16 | Sensor::Hdl32e | Sensor::Vlp32c => 200.0,
            Sensor::Mid360 => 100.0,
            _ => 220.0,
        }
    }

    /// Whether the driver gives a beam number.
    pub fn has_ring(self) -> bool {
        !matches!(self, Sensor::Hap | Sensor::Mid360)
    }

    /// Beam number as the driver gives it for a shot, row 0 being the highest.
    pub fn ring(self, row: usize, column: usize) -> u16 {
        match self {
            Sensor::Vlp16 | Sensor::Hdl32e | Sensor::Vlp32c | Sensor::Vls128 | Sensor::Helios => {
                (self.beams() - 1 - row) as u16
            }
            Sensor::M1 => beams::module(column) as u16 + 1,
            _ => row as u16,
        }
    }

    /// Time of a firing after the stamp, in nanoseconds.
    pub fn time_offset_ns(self, row: usize, column: usize) -> u32 {
        let firing = TURN_NS * column as u64 / self.columns() as u64;
        let laser = match self {
            Sensor::Vlp16 => VLP16_LASER_NS * vlp16_laser(row) as u64,
            Sensor::Hdl32e => HDL32E_LASER_NS * (self.beams() - 1 - row) as u64,
            Sensor::M1 => return beams::raster_time(row, column) as u32,
            _ => 0,
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
            Sensor::M1 => Box::new(beams::raster_order()),
            _ if self.is_organised() => Box::new(
                (0..rows).flat_map(move |row| (0..columns).map(move |column| (row, column))),
            ),
            _ => Box::new(
                (0..columns).flat_map(move |column| (0..rows).rev().map(move |row| (row, column))),
            ),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Sensor::Hdl64e => "hdl-64e",
            Sensor::Vlp16 => "vlp-16",
            Sensor::Hdl32e => "hdl-32e",
            Sensor::Os1_128 => "os1-128",
            Sensor::Vlp32c => "vlp-32c",
            Sensor::Vls128 => "vls-128",
            Sensor::Pandar40pDual => "pandar-40p-dual",
            Sensor::Helios => "helios",
            Sensor::Os1_64Gradient => "os1-64-gradient",
            Sensor::Os1_64Staggered => "os1-64-staggered",
            Sensor::M1 => "m1",
            Sensor::Hap => "hap",
            Sensor::Mid360 => "mid-360",
        }
    }

    /// The names, as in `vlp-16, hdl-32e or m1`.
    pub fn names() -> String {
        let (last, first) = Self::ALL.split_last().expect("there are some");
        let first: Vec<&str> = first.iter().map(|sensor| sensor.name()).collect();
        format!("{} or {}", first.join(", "), last.name())
    }
}

/// Row, from the highest, of a VLP-16's laser: even lasers climb from -15 degrees, odd ones from
/// +1.
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
        found.ok_or_else(|| format!("`{name}` is no sensor: {}", Self::names()))
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
            (Sensor::Vlp32c, 15.0, -25.0),
            (Sensor::Vls128, 15.0, -25.0),
            (Sensor::Pandar40pDual, 15.0, -25.0),
            (Sensor::Helios, 15.0, -55.0),
            (Sensor::Os1_64Staggered, 16.6, -16.6),
            (Sensor::M1, 12.4, -12.4),
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
