//! SemanticKITTI: its scans, labels and whole sequences.

mod checks;
pub mod drive_files;
mod files;
pub mod label_pairs;
pub mod sequence;

pub use crate::datasets::files::{read_labels, write_labels};
pub use files::{LabelledScan, label_files, labelled_scans, read_scan, read_scan_with_remission};
