//! The sensors there are.

/// Time of one turn at 10 Hz, in nanoseconds.
pub(crate) const TURN_NS: u64 = 100_000_000;

/// A LiDAR at 10 Hz. The spinning ones turn clockwise seen from above: azimuth starts at the rear
/// (+pi) and decreases with the column. Those of a solid state look ahead.
///
/// Figures are those of the makers' data sheets; where a sheet gives no table of angles, they
/// follow its limits and its finest step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sensor {
    /// Velodyne HDL-64E as KITTI carries it: 64 beams, 2083 columns; returns only, stored ring by
    /// ring from the highest beam (ring 0), and within a ring by increasing azimuth from straight
    /// ahead.
    Hdl64e,
    /// Velodyne VLP-16: 16 beams, 1800 columns; returns only, stored firing by firing with the
    /// lasers in their firing order; ring 0 is the lowest beam.
    Vlp16,
    /// Velodyne HDL-32E: 32 beams from +10.67 to -30.67 degrees, 2170 columns; returns only, stored
    /// firing by firing from the lowest beam, ring 0.
    Hdl32e,
    /// Ouster OS1-128: 128 x 1024, organised, destaggered; row and ring 0 are the highest beam, and
    /// a pixel without a return is the origin.
    #[allow(non_camel_case_types)]
    Os1_128,
    /// Velodyne VLP-32C: 32 uneven beams from +15 to -25 degrees, a third of a degree apart around
    /// the horizon, turned against each other by up to 8.4 degrees of azimuth; returns only, firing
    /// by firing.
    Vlp32c,
    /// Velodyne VLS-128: 128 uneven beams from +15 to -25 degrees, turned against each other by up
    /// to 12.7 degrees; returns only, firing by firing.
    Vls128,
    /// Hesai Pandar40P in dual return: 40 uneven beams from +15 to -25 degrees; returns only,
    /// firing by firing, the farther return of a beam before the nearer one; ring 0 is the highest
    /// beam.
    Pandar40pDual,
    /// RoboSense Helios: 32 uneven beams from +15 to -55 degrees, the channel ascending with the
    /// elevation; returns only, firing by firing.
    Helios,
    /// Ouster OS1-64 with gradient beams (denser around the horizon): 64 x 1024, organised,
    /// destaggered.
    #[allow(non_camel_case_types)]
    Os1_64Gradient,
    /// The same as it measures: a column is a moment, and beams are turned against each other by up
    /// to 8.4 degrees.
    #[allow(non_camel_case_types)]
    Os1_64Staggered,
    /// RoboSense M1, solid state: 120 x 25 degrees in steps of 0.2; five modules side by side scan
    /// a fifth of the width each, line by line, lines being bent. The ring is the module, 1 to 5.
    M1,
    /// A Livox HAP-like solid state: 120 x 25 degrees, 45,000 shots on a curve that never repeats;
    /// no ring.
    Hap,
    /// A Livox Mid-360-like: all round, -7 to +52 degrees, 20,000 shots on curves of four lines
    /// that never repeat; no ring. It rides low, as on a delivery robot.
    Mid360,
}
