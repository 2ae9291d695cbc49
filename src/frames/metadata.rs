//! The metadata records of a recording.

use std::collections::BTreeMap;
use std::path::Path;

use super::selection::Selection;
use super::walk::Walk;
use crate::error::Result;
use divmerge_recording::{Metadata, Overview, Record};

/// The first metadata record with a property, reading no farther than needed.
///
/// # Errors
/// Those of [`RecordingReader`](divmerge_recording::RecordingReader).
pub fn find_metadata(
    recording: &Path,
    has_property: impl Fn(&Metadata) -> bool,
) -> Result<Option<Metadata>> {
    let unread = Overview { path: recording.to_owned(), ..Overview::default() };
    let mut walk = Walk::over_everything(&unread, BTreeMap::new(), &Selection::default())?;
    while let Some(step) = walk.next()? {
        match step.record {
            Record::Metadata(metadata) if has_property(&metadata) => return Ok(Some(metadata)),
            _ => {}
        }
    }
    Ok(None)
}
