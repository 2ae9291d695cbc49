//! Label files of the truth with those of predictions.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::files::{entries, label_files};
use crate::datasets::files::file_name;
use crate::error::{Error, Result};

/// A label file of the truth and one of a prediction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LabelPair {
    /// Name of the sequence.
    pub sequence: String,
    /// The truth.
    pub truth: PathBuf,
    /// The prediction, of as many points.
    pub prediction: PathBuf,
    /// The scan, if it is needed.
    pub scan: Option<PathBuf>,
}

/// The label files of the truth in `root` with the predictions in `predictions`, and what does not
/// fit: missing or superfluous files and wrong sizes. `sequences` chooses some, none means all;
/// `with_scans` asks for `velodyne/NNNNNN.bin` beside the truth.
///
/// # Errors
/// [`Error::Io`] if a folder or file cannot be read.
pub fn label_pairs(
    [root, predictions]: [&Path; 2],
    sequences: &[String],
    with_scans: bool,
) -> Result<(Vec<LabelPair>, Vec<String>)> {
    let truth = by_scan(root, "labels", sequences)?;
    let mut found = by_scan(predictions, "predictions", sequences)?;
    if found.is_empty() {
        found = by_scan(predictions, "labels", sequences)?;
    }
    let mut problems = Vec::new();
    if truth.is_empty() {
        problems.push(format!("no sequences/NN/labels/*.label under {}", root.display()));
    }
    for sequence in sequences {
        if !truth.keys().any(|(name, _)| name == sequence) {
            problems.push(format!("no truth for sequence {sequence}"));
        }
    }
    for (scan, path) in &found {
        if !truth.contains_key(scan) {
            problems.push(format!("{}: no truth", path.display()));
        }
    }
    let mut pairs = Vec::with_capacity(truth.len());
    for ((sequence, name), truth) in truth {
        let Some(prediction) = found.remove(&(sequence.clone(), name)) else {
            problems.push(format!("{}: no prediction", truth.display()));
            continue;
        };
        let (expected, size) = (bytes(&truth)?, bytes(&prediction)?);
        if expected % 4 != 0 {
            problems.push(format!("{}: {expected} bytes are not a multiple of 4", truth.display()));
        }
        if expected != size {
            let path = prediction.display();
            problems.push(format!("{path}: {size} bytes where the truth has {expected}"));
        }
        let scan = with_scans.then(|| scan_of(&truth));
        problems.extend(scan.as_deref().and_then(|scan| scan_problem(scan, expected / 4)));
        pairs.push(LabelPair { sequence, truth, prediction, scan });
    }
    Ok((pairs, problems))
}

/// `velodyne/NNNNNN.bin` beside `labels/NNNNNN.label`.
fn scan_of(truth: &Path) -> PathBuf {
    let folder = truth.parent().and_then(Path::parent).unwrap_or(Path::new(""));
    let name = truth.with_extension("bin");
    folder.join("velodyne").join(name.file_name().unwrap_or_default())
}

fn scan_problem(scan: &Path, points: u64) -> Option<String> {
    match std::fs::metadata(scan) {
        Err(error) => Some(format!("{}: {error}", scan.display())),
        Ok(file) if file.len() != points * 16 => Some(format!(
            "{}: {} bytes where {points} points have {}",
            scan.display(),
            file.len(),
            points * 16
        )),
        Ok(_) => None,
    }
}

fn bytes(path: &Path) -> Result<u64> {
    let file = std::fs::metadata(path);
    Ok(file.map_err(|source| Error::Io { path: path.into(), source })?.len())
}

/// The label file of a cloud in a folder: `NNNNNN.label`.
pub fn label_file(folder: &Path, number: u64) -> PathBuf {
    folder.join(format!("{number:06}.label"))
}

/// The label files in a folder that belong to none of `clouds` clouds.
///
/// # Errors
/// [`Error::Io`] if the folder cannot be listed.
pub fn stray_label_files(folder: &Path, clouds: u64) -> Result<Vec<PathBuf>> {
    let files = entries(folder)?.into_iter();
    let labels = files.filter(|path| path.extension().is_some_and(|ending| ending == "label"));
    let is_of_a_cloud = |path: &PathBuf| {
        let number = path.file_stem().and_then(|stem| stem.to_str()?.parse().ok());
        number.is_some_and(|number| number < clouds && label_file(folder, number) == *path)
    };
    Ok(labels.filter(|path| !is_of_a_cloud(path)).collect())
}

/// Label files by sequence and file name.
fn by_scan(
    root: &Path,
    kind: &str,
    sequences: &[String],
) -> Result<BTreeMap<(String, String), PathBuf>> {
    let files = label_files(root, kind)?.into_iter();
    let chosen = files.filter(|(name, _)| sequences.is_empty() || sequences.contains(name));
    Ok(chosen.map(|(sequence, path)| ((sequence, file_name(&path)), path)).collect())
}
