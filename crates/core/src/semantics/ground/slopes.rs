//! The slope of each return of a column against the ground below it.

use super::climb::{Limits, climb};
use super::params::GroundParams;
use super::plane::Plane;
use super::profile::Profile;

/// H x W, as the profile: rise over run of each return; infinite where it cannot be ground, NaN
/// without a return. A column starts on the plane, not at its first return, which may be an
/// object's.
pub(super) fn column_slopes(profile: &Profile, plane: &Plane, params: &GroundParams) -> Vec<f32> {
    let limits = Limits::new(params);
    let mut slopes = vec![f32::NAN; profile.returns.len()];
    let columns = profile.returns.chunks_exact(profile.rows);
    for (column, slopes) in columns.zip(slopes.chunks_exact_mut(profile.rows)) {
        if let Some(first) = column.iter().find(|seen| seen.exists()) {
            let start = plane.below(first.position());
            climb(column, start, &limits, slopes);
        }
    }
    slopes
}
