//! Scans written to a recording, one after the other.

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::path::Path;

use nalgebra::Isometry3;

use super::scan::Scan;
use crate::datasets::cloud_recording::{CloudRecording, Transform};
use crate::datasets::problems::Problems;
use crate::error::{Error, Result};

/// Start of recordings whose times are relative: 1 January 2000, 00:00 UTC, in nanoseconds since
/// 1970. Not 1970 itself: a stamp of 0 means "the latest" to ROS's transforms.
pub const EPOCH_NS: u64 = 946_684_800_000_000_000;

/// The last nanosecond that a stamp can hold, whose seconds have 31 bits.
const LAST_NS: u64 = i32::MAX as u64 * 1_000_000_000 + 999_999_999;

/// A scan to be written.
pub struct TimedScan<'a> {
    /// Its file, for errors.
    pub path: &'a Path,
    /// When it was taken, nanoseconds since 1970.
    pub stamp_ns: u64,
    /// The sensor in `map`, metres, if known.
    pub pose: Option<Isometry3<f64>>,
    /// The points, or why they could not be read.
    pub scan: Result<Scan>,
}

/// Summary of a recording that was written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct WriteSummary {
    /// Size of the recording in bytes.
    pub bytes: u64,
    /// Clouds.
    pub clouds: u64,
    /// Points in all clouds.
    pub points: u64,
    /// Names and types of the fields; see [`Scan::layout`].
    pub layout: String,
    /// What the files hold and the recording cannot.
    pub left_out: BTreeSet<String>,
}

/// Writes scans as clouds, each with its stamp as log and publish time and after its pose, and
/// finishes the recording. `on_frame` is called after each and may break off. One scan is in memory
/// at a time.
///
/// # Errors
/// [`Error::Folder`] for `source` with every scan that could not be read, is no cloud, or has other
/// fields than the first; then the recording is not written, but the other scans are still looked
/// at. [`Error::Interrupted`]; those of [`CloudRecording`].
pub fn write_scans<'a>(
    mut recording: CloudRecording,
    frame_id: &str,
    [source, output]: [&Path; 2],
    frames: impl Iterator<Item = TimedScan<'a>>,
    mut on_frame: impl FnMut() -> ControlFlow<()>,
) -> Result<WriteSummary> {
    let (mut written, mut problems) = (WriteSummary::default(), Problems::default());
    let mut message = Vec::new();
    for frame in frames {
        match encoded(&frame, frame_id, &mut written, &mut message) {
            Ok(()) if problems.is_empty() => {
                if let Some(pose) = frame.pose {
                    let stamp_ns = frame.stamp_ns;
                    let transform = Transform { stamp_ns, parent: "map", child: frame_id, pose };
                    recording.write_pose(stamp_ns, &transform)?;
                }
                recording.write_cloud(frame.stamp_ns, &message)?;
            }
            Ok(()) => {}
            Err(problem) => problems.add(problem),
        }
        if on_frame().is_break() {
            return Err(Error::Interrupted { path: output.to_owned() });
        }
    }
    problems.into_result(source)?;
    written.bytes = recording.finish()?;
    Ok(written)
}

/// Encodes a scan into `message` and adds it to the summary.
///
/// # Errors
/// What is wrong with the scan.
fn encoded(
    frame: &TimedScan,
    frame_id: &str,
    written: &mut WriteSummary,
    message: &mut Vec<u8>,
) -> std::result::Result<(), String> {
    let scan = frame.scan.as_ref().map_err(ToString::to_string)?;
    let path = frame.path.display();
    if frame.stamp_ns > LAST_NS {
        return Err(format!("{path}: a time after January 2038, which no stamp can say"));
    }
    let cloud = scan.message(frame.stamp_ns, frame_id);
    cloud.and_then(|cloud| cloud.encode(message)).map_err(|error| format!("{path}: {error}"))?;
    let layout = scan.layout();
    match written.layout.as_str() {
        "" => written.layout = layout,
        first if first != layout => {
            return Err(format!("{path}: the fields {layout} where the first scan has {first}"));
        }
        _ => {}
    }
    written.clouds += 1;
    written.points += scan.len() as u64;
    written.left_out.extend(scan.left_out.iter().cloned());
    Ok(())
}
