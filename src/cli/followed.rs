//! Objects of a drive followed while nothing is written, with a bar that shows how far.

use std::ops::Range;
use std::path::Path;

use crate::Result;
use crate::annotate::{AnnotateConfig, FollowProgress, FollowedDrive, TrackOptions, follow_drive};

use crate::cli::progress::frame_bar;

/// Follows the objects of some frames of a topic; by default of all frames of the first topic.
pub fn followed_drive(
    input: &Path,
    (topic, frames): (Option<&str>, Option<Range<u64>>),
    (method, options): (&AnnotateConfig, &TrackOptions),
) -> Result<FollowedDrive> {
    let bar = frame_bar("following", 0);
    let frames = frames.unwrap_or(0..u64::MAX);
    let drive = follow_drive(input, (topic, frames), (method, options), &mut |progress| {
        let FollowProgress { clouds, of } = progress;
        bar.set_length(of);
        bar.set_position(clouds);
        Ok(())
    });
    bar.finish_and_clear();
    drive
}
