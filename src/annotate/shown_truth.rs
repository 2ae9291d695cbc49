//! What is true of a cloud that is shown.

use crate::error::{Error, FrameError, Result};
use crate::frames::{EncodedCloud, Truth, TruthSource};
use crate::messages::clouds::CloudMessage;

/// The truth of a cloud, if it is wanted. `wanted` is where it is, and whether somebody said so:
/// else a cloud without it has none.
///
/// # Errors
/// Those of [`TruthSource::of`].
pub(super) fn shown_truth(
    wanted: Option<(&TruthSource, bool)>,
    encoded: &EncodedCloud,
    wire: &CloudMessage,
) -> Result<Option<Truth>> {
    let Some((source, is_said)) = wanted else { return Ok(None) };
    match source.of(encoded, wire) {
        Ok(truth) => Ok(Some(truth)),
        Err(Error::Frame(FrameError::MissingField { .. })) if !is_said => Ok(None),
        // It is wrong in all clouds.
        Err(Error::Frame(problem @ FrameError::MissingField { .. })) => {
            Err(Error::Unreadable { at: encoded.describe(), problem })
        }
        Err(error) => Err(error),
    }
}
