//! Checks of a sequence's folder: scans without a gap, a label for each point, known classes.

use std::collections::BTreeMap;
use std::path::Path;

use crate::datasets::files::names;
use crate::datasets::problems::Problems;
use crate::error::{Error, Result};
use divmerge_core::cloud::taxonomy::Taxonomy;

/// Bytes of a point: float32 x, y, z and intensity.
const POINT_BYTES: u64 = 16;

/// Sizes in bytes of the scans by stem; they are numbered from 0.
pub(super) fn scan_sizes(folder: &Path, problems: &mut Problems) -> Result<BTreeMap<String, u64>> {
    let mut sizes = BTreeMap::new();
    for name in names(folder)? {
        let stem = name.strip_suffix(".bin").filter(|stem| is_number(stem));
        let Some(stem) = stem else {
            problems.add(format!("velodyne/{name} is no scan (000000.bin and on)"));
            continue;
        };
        let bytes = size(&folder.join(&name))?;
        if bytes == 0 || bytes % POINT_BYTES != 0 {
            problems.add(format!("velodyne/{name}: {bytes} bytes are no points of {POINT_BYTES}"));
        }
        sizes.insert(stem.to_owned(), bytes);
    }
    if sizes.is_empty() {
        problems.add("no scan in velodyne");
    }
    let mut number = 0;
    for stem in sizes.keys() {
        // Stems of six digits sort by value; any other is told as missing.
        let found = stem.parse::<u64>().unwrap_or(u64::MAX);
        if found != number {
            let to = found.saturating_sub(1).max(number);
            problems.add(format!("velodyne/{} is missing", missing(number, to)));
        }
        number = found.saturating_add(1);
    }
    Ok(sizes)
}

fn is_number(stem: &str) -> bool {
    stem.len() == 6 && stem.bytes().all(|byte| byte.is_ascii_digit())
}

fn missing(first: u64, last: u64) -> String {
    match first == last {
        true => format!("{first:06}.bin"),
        false => format!("{first:06}.bin to {last:06}.bin"),
    }
}

fn size(path: &Path) -> Result<u64> {
    let file = std::fs::metadata(path).map_err(|source| Error::Io { path: path.into(), source })?;
    Ok(file.len())
}

/// Checks that a folder holds a file for each scan with a word of four bytes for each point.
pub(super) fn check_labels(
    folder: &Path,
    scans: &BTreeMap<String, u64>,
    problems: &mut Problems,
) -> Result<()> {
    let what = folder.display();
    if !folder.is_dir() {
        problems.add(format!("no folder {what}"));
        return Ok(());
    }
    let mut without: BTreeMap<&str, u64> =
        scans.iter().map(|(stem, &s)| (stem.as_str(), s)).collect();
    for name in names(folder)? {
        let Some(bytes) = name.strip_suffix(".label").and_then(|stem| without.remove(stem)) else {
            problems.add(format!("{what}/{name} belongs to no scan"));
            continue;
        };
        let (expected, found) = (bytes / 4, size(&folder.join(&name))?);
        if found != expected {
            problems.add(format!(
                "{what}/{name}: {found} bytes where the scan's {} points need {expected}",
                bytes / POINT_BYTES
            ));
        }
    }
    without.keys().for_each(|stem| problems.add(format!("{what}/{stem}.label is missing")));
    Ok(())
}

/// Whether a taxonomy has a raw id, for every possible id.
pub(super) fn known(taxonomy: &Taxonomy) -> Vec<bool> {
    let mut is_known = vec![false; 1 << 16];
    taxonomy.known_ids().for_each(|(id, _)| is_known[usize::from(id)] = true);
    is_known
}

/// Checks that the taxonomy has the class of every word of a label file.
pub(super) fn check_classes(
    words: &[u32],
    is_known: &[bool],
    taxonomy: &str,
    path: &Path,
) -> Result<()> {
    let classes = || words.iter().map(|&word| word as u16);
    let Some(unknown) = classes().find(|&id| !is_known[usize::from(id)]) else {
        return Ok(());
    };
    Err(Error::unknown_class(path.display().to_string(), unknown, classes(), taxonomy))
}
