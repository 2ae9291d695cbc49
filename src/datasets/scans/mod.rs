//! Scans in files of their own: raw floats (`.bin`), PCL's `.pcd`, numpy's `.npy`.
//!
//! All three hold points as a PointCloud2 message does, one behind the other with fields at fixed
//! offsets, or can be brought into that order. So a [`Scan`] is the message's description of the
//! points and their bytes, and reading is mostly the reading of a header. Nothing is converted:
//! types, byte order and padding stay. What a message cannot say is left out and named
//! ([`Scan::left_out`]).
//!
//! The parsers are written here, not taken from crates: `docs/decisions/0005-own-scan-files.md`.

mod bin;
mod columns;
mod folder;
mod lzf;
pub(in crate::datasets) mod npy;
mod pcd;
mod read;
mod scan;
mod write;

pub use columns::Columns;
pub use folder::{
    FolderOptions, LABEL_FIELDS, SOURCE, ScanFolder, StampSource, USUAL_RATE, append_labels,
};
pub use read::ScanFormat;
pub use scan::Scan;
pub use write::{EPOCH_NS, TimedScan, WriteSummary, write_scans};
