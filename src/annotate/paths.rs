//! The paths of an input and an output.

use std::path::Path;

use crate::error::{Conflict, Error, Result};
use divmerge_recording::{STANDARD_STREAM, is_same_file};

/// Refuses an output that is the input.
///
/// # Errors
/// [`Error::Conflict`] if both are the same file.
pub(crate) fn refuse_same_file(input: &Path, output: &Path) -> Result<()> {
    if output == STANDARD_STREAM {
        return Ok(());
    }
    match is_same_file(input, output) {
        true => Err(Error::Conflict { path: input.to_owned(), problem: Conflict::SameFile }),
        false => Ok(()),
    }
}
