//! SemanticKITTI's `.bin` scans, and where they and their labels are in its folders.

use std::path::{Path, PathBuf};

use crate::datasets::files::{file_name, read, size_problem};
use crate::error::{Error, Result};
use divmerge_core::cloud::PointCloud;

/// Reads a `.bin` scan: float32 x, y, z (metres, sensor frame) and intensity per point, little
/// endian.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::Unreadable`] if its size is not a whole number of
/// points.
pub fn read_scan(path: &Path) -> Result<PointCloud> {
    let cloud = read_scan_with_remission(path)?;
    Ok(cloud.with(|columns| columns.remission = None)?)
}

/// The same with the intensity as remission.
///
/// # Errors
/// Those of [`read_scan`].
pub fn read_scan_with_remission(path: &Path) -> Result<PointCloud> {
    let bytes = read(path)?;
    let (points, rest) = bytes.as_chunks::<16>();
    if !rest.is_empty() {
        return Err(size_problem("scan", path, bytes.len(), 16));
    }
    let column = |offset: usize| {
        let floats = points.iter().map(|point| point[offset..].first_chunk());
        floats.map(|bytes| bytes.map_or(f32::NAN, |b| f32::from_le_bytes(*b))).collect()
    };
    let cloud = PointCloud::new(column(0), column(4), column(8))?;
    Ok(cloud.with(|columns| columns.remission = Some(column(12)))?)
}

/// A scan and its label file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LabelledScan {
    /// Name of the sequence, such as `04`.
    pub sequence: String,
    /// The `.bin` file.
    pub scan: PathBuf,
    /// The `.label` file of the same name.
    pub labels: PathBuf,
}

/// The scans of all labelled sequences below a folder that holds `sequences`, in order.
///
/// # Errors
/// [`Error::Io`] if a folder cannot be listed.
pub fn labelled_scans(root: &Path) -> Result<Vec<LabelledScan>> {
    let mut scans = Vec::new();
    for sequence in entries(&root.join("sequences"))? {
        let (labels, name) = (sequence.join("labels"), file_name(&sequence));
        if !labels.is_dir() {
            continue;
        }
        for scan in entries(&sequence.join("velodyne"))? {
            let labels = labels.join(file_name(&scan.with_extension("label")));
            scans.push(LabelledScan { sequence: name.clone(), scan, labels });
        }
    }
    Ok(scans)
}

/// The `.label` files of a folder that holds `sequences`, in order, each with the name of its
/// sequence: those under `kind`, which is `labels` or `predictions`, of every sequence that has
/// such a folder.
///
/// # Errors
/// [`Error::Io`] if a folder cannot be listed.
pub fn label_files(root: &Path, kind: &str) -> Result<Vec<(String, PathBuf)>> {
    let mut files = Vec::new();
    for sequence in entries(&root.join("sequences"))? {
        let folder = sequence.join(kind);
        if folder.is_dir() {
            let labels = entries(&folder)?.into_iter();
            let labels = labels.filter(|path| path.extension().is_some_and(|e| e == "label"));
            files.extend(labels.map(|path| (file_name(&sequence), path)));
        }
    }
    Ok(files)
}

/// The paths in a folder, sorted.
pub(super) fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let at = |source| Error::Io { path: folder.into(), source };
    let list = std::fs::read_dir(folder).map_err(at)?;
    let mut paths =
        list.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>().map_err(at)?;
    paths.sort();
    Ok(paths)
}
