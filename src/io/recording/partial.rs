//! A file being written beside its final name, and put there when it is whole.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use tempfile::TempPath;

use crate::error::{Error, Result};

/// A file under a temporary name in the folder of its final one (`.NAME.XXXXXX.partial`); it is removed
/// if it is never put there.
pub struct PartialFile {
    partial: TempPath,
    output: PathBuf,
    force: bool,
}

impl PartialFile {
    /// Makes a file that will be `output`; with `force` it may replace one.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder cannot be written to, or if the output exists and may not be
    /// replaced.
    pub fn create(output: &Path, force: bool) -> Result<(File, Self)> {
        if let Ok(existing) = output.symlink_metadata()
            && !(force && existing.is_file())
        {
            return Err(exists(output));
        }
        let (file, partial) = create_partial(output).map_err(at(output))?;
        Ok((file, PartialFile { partial, output: output.to_owned(), force }))
    }

    /// Gives the file its name. It should be closed by then.
    ///
    /// # Errors
    /// [`Error::Io`] if that name is taken by now.
    pub fn put(self) -> Result<()> {
        put(self.partial, &self.output, self.force)
    }
}

fn create_partial(output: &Path) -> io::Result<(File, TempPath)> {
    let name = output
        .file_name()
        .ok_or_else(|| io::Error::new(ErrorKind::InvalidInput, "not the name of a file"))?;
    let folder = match output.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let mut prefix = OsString::from(".");
    prefix.push(name);
    prefix.push(".");
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".partial");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As for any new file: everything that the process's umask leaves.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    Ok(builder.tempfile_in(folder)?.into_parts())
}

/// Gives the file its name.
fn put(partial: TempPath, output: &Path, force: bool) -> Result<()> {
    let partial = match force {
        true => partial,
        false => match partial.persist_noclobber(output) {
            Ok(()) => return Ok(()),
            Err(_) if output.symlink_metadata().is_ok() => return Err(exists(output)),
            // Some file systems cannot rename without replacing; nothing is there to be replaced.
            Err(refused) => refused.path,
        },
    };
    partial.persist(output).map_err(|refused| at(output)(refused.error))
}

fn exists(output: &Path) -> Error {
    at(output)(io::Error::new(ErrorKind::AlreadyExists, "exists already and may not be replaced"))
}

/// What the system refused, and where.
pub fn at(path: &Path) -> impl Fn(io::Error) -> Error {
    move |source| Error::Io { path: path.to_owned(), source }
}
