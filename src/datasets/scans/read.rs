//! The formats of scan files, and the parser of each.

use std::path::Path;

use super::columns::{Columns, NAMED};
use super::scan::Scan;
use super::{bin, npy, pcd};
use crate::datasets::files::{read, unreadable};
use crate::error::{FrameError, Result, frame};

/// Format of a scan's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ScanFormat {
    /// Little-endian float32 columns and nothing else, as in KITTI and nuScenes.
    Bin,
    /// Point Cloud Library's format: ASCII, binary or compressed.
    Pcd,
    /// A numpy array: N x C, H x W x C, or N or H x W of a structured type.
    Npy,
}

impl ScanFormat {
    /// The format by a file's ending, in upper or lower case.
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "bin" => Some(ScanFormat::Bin),
            "pcd" => Some(ScanFormat::Pcd),
            "npy" => Some(ScanFormat::Npy),
            _ => None,
        }
    }

    /// Its ending, with the dot.
    pub fn ending(self) -> &'static str {
        match self {
            ScanFormat::Bin => ".bin",
            ScanFormat::Pcd => ".pcd",
            ScanFormat::Npy => ".npy",
        }
    }

    fn message(self) -> &'static str {
        match self {
            ScanFormat::Bin => "scan",
            ScanFormat::Pcd => "PCD file",
            ScanFormat::Npy => "numpy file",
        }
    }
}

impl Scan {
    /// Reads a file. `columns` names the columns where the file does not; without it they are x, y,
    /// z, intensity and, in a wider array, `column_5` and on.
    ///
    /// # Errors
    /// [`Error::Io`](crate::error::Error::Io);
    /// [`Error::Unreadable`](crate::error::Error::Unreadable) with what is wrong.
    pub fn read(path: &Path, format: ScanFormat, columns: Option<&Columns>) -> Result<Self> {
        Scan::parse(read(path)?, format, columns).map_err(|problem| unreadable(path, problem))
    }

    /// The points in the bytes of a file; see [`Scan::read`].
    ///
    /// # Errors
    /// [`FrameError::Malformed`] with what is wrong.
    pub fn parse(
        bytes: Vec<u8>,
        format: ScanFormat,
        columns: Option<&Columns>,
    ) -> frame::Result<Self> {
        let scan = match format {
            ScanFormat::Bin => bin::parse(bytes, columns),
            ScanFormat::Pcd if columns.is_some() => Err(NAMED.into()),
            ScanFormat::Pcd => pcd::parse(&bytes),
            ScanFormat::Npy => npy::parse(bytes, columns),
        };
        scan.and_then(Scan::checked)
            .map_err(|problem| FrameError::Malformed { message: format.message(), problem })
    }
}
