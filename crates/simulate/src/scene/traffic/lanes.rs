//! Where the lanes are.

/// Middles of the lanes of the first avenue, metres: right, left, and the two that come towards.
pub(super) const RIGHT: f64 = -7.0;
pub(super) const LEFT: f64 = -3.4;
pub(super) const TOWARDS: [f64; 2] = [3.4, 7.0];

/// Middles of the lanes of the other avenue.
pub(super) const OTHER_RIGHT: f64 = -41.4;
pub(super) const OTHER_TOWARDS: f64 = -37.8;
