//! Files and folders, read with their paths in errors; and files of labels, which several datasets
//! have.

use std::path::Path;

use crate::error::{Error, FrameError, Result};
use divmerge_recording::write_file;

/// Reads `.label` words: the class in the low 16 bits, the instance in the high 16.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::Unreadable`] if its size is not a whole number of
/// words.
pub fn read_labels(path: &Path) -> Result<Vec<u32>> {
    let bytes = read(path)?;
    let (words, rest) = bytes.as_chunks::<4>();
    if !rest.is_empty() {
        return Err(size_problem("labels", path, bytes.len(), 4));
    }
    Ok(words.iter().map(|word| u32::from_le_bytes(*word)).collect())
}

/// Writes `.label` words, class in the low and instance in the high 16 bits. A file that is there
/// is replaced when they are written.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written.
pub fn write_labels(path: &Path, words: &[u32]) -> Result<()> {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    Ok(write_file(path, &bytes, true)?)
}

/// Names of everything in a folder but hidden files, sorted.
///
/// # Errors
/// [`Error::Io`] if it cannot be listed, or a name is not Unicode.
pub fn names(folder: &Path) -> Result<Vec<String>> {
    let at = |source| Error::Io { path: folder.to_owned(), source };
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(at)? {
        let name = entry.map_err(at)?.file_name();
        let name = name.into_string().map_err(|name| {
            at(std::io::Error::other(format!("a name that is not Unicode: {}", name.display())))
        })?;
        names.push(name);
    }
    names.retain(|name| !name.starts_with('.'));
    names.sort();
    Ok(names)
}

/// The last part of a path.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The bytes of a file.
pub(super) fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|source| Error::Io { path: path.into(), source })
}

pub(super) fn size_problem(message: &'static str, path: &Path, bytes: usize, word: usize) -> Error {
    let problem = format!("{bytes} bytes are no multiple of {word}");
    unreadable(path, FrameError::Malformed { message, problem })
}

/// An error about what a file holds.
pub(super) fn unreadable(path: &Path, problem: FrameError) -> Error {
    Error::Unreadable { at: path.display().to_string(), problem }
}
