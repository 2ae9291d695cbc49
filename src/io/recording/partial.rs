//! A file being written beside its final name, and put there when it is whole.

use std::ffi::OsString;
use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use tempfile::TempPath;

use crate::error::{Error, Result};

/// A file under a temporary name in the folder of its final one (`.NAME.partial`); it is removed if it is never put
/// there. What an earlier run left under that name is replaced, unless that run still goes on.
pub struct PartialFile {
    partial: TempPath,
    output: PathBuf,
    force: bool,
}

impl PartialFile {
    /// The temporary name of the file that will be `output`.
    pub fn name_for(output: &Path) -> PathBuf {
        let mut name = OsString::from(".");
        name.push(output.file_name().unwrap_or_default());
        name.push(".partial");
        output.with_file_name(name)
    }

    /// Makes a file that will be `output`; with `force` it may replace one.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder cannot be written to, if the output exists and may not be replaced, or if it is being
    /// written by somebody else.
    pub fn create(output: &Path, force: bool) -> Result<(File, Self)> {
        if let Ok(existing) = output.symlink_metadata()
            && !(force && existing.is_file())
        {
            return Err(exists(output));
        }
        let (file, partial) = create_partial(output).map_err(at(output))?;
        Ok((file, PartialFile { partial, output: output.to_owned(), force }))
    }

    /// Leaves the file under its temporary name, which is returned.
    pub fn leave(mut self) -> PathBuf {
        self.partial.disable_cleanup(true);
        self.partial.to_path_buf()
    }

    /// Refuses a file that somebody is writing.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn refuse_busy(path: &Path) -> Result<()> {
        File::open(path).and_then(|file| lock(&file)).map_err(at(path))
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
    if output.file_name().is_none() {
        return Err(io::Error::new(ErrorKind::InvalidInput, "not the name of a file"));
    }
    let path = PartialFile::name_for(output);
    remove_stale(&path)?;
    let file = File::create_new(&path)?;
    lock(&file)?;
    Ok((file, TempPath::try_from_path(path)?))
}

/// Removes what a run left behind that was ended. One that goes on holds a lock.
fn remove_stale(path: &Path) -> io::Result<()> {
    match File::open(path) {
        Ok(file) => {
            lock(&file)?;
            std::fs::remove_file(path)
        }
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error),
    }
}

/// Locks a file for as long as it is open. Some file systems have no locks; then nothing is known of other runs.
fn lock(file: &File) -> io::Result<()> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            Err(io::Error::new(ErrorKind::ResourceBusy, "is being written by another run"))
        }
        _ => Ok(()),
    }
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
