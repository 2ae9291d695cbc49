//! A file that is written under a temporary name, and gets its own when it is complete.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempPath;

use crate::address::is_remote;
use crate::error::{Error, Result};

/// A file under a temporary name (`.NAME.partial`) in the folder of its final one. It is removed if
/// it never gets its name. A file that an earlier run left under the temporary name is replaced,
/// unless that run still goes on.
pub struct PartialFile {
    partial: TempPath,
    output: PathBuf,
    force: bool,
    listed: Listed,
}

/// The partial files of this process, so that it can be ended without waiting for their writers.
static UNFINISHED: Mutex<Unfinished> =
    Mutex::new(Unfinished { outputs: BTreeMap::new(), is_over: false });

struct Unfinished {
    /// Final paths by the paths of the partial files.
    outputs: BTreeMap<PathBuf, PathBuf>,
    /// Whether no file may get its name any more.
    is_over: bool,
}

fn unfinished() -> MutexGuard<'static, Unfinished> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the partial files of this process, except those of some outputs. No file gets its name
/// after this call. It is for a process that is about to end, as on a signal.
pub fn abandon_partial_files(but: &[PathBuf]) {
    let mut unfinished = unfinished();
    unfinished.is_over = true;
    for (partial, output) in std::mem::take(&mut unfinished.outputs) {
        if !but.contains(&output) {
            // Its writer may be removing it at this moment.
            let _ = std::fs::remove_file(partial);
        }
    }
}

/// A place in the list of partial files.
struct Listed(PathBuf);

impl Listed {
    fn new(partial: &Path, output: &Path) -> Result<Self> {
        let mut unfinished = unfinished();
        if unfinished.is_over {
            return Err(Error::Interrupted { path: output.to_owned() });
        }
        unfinished.outputs.insert(partial.to_owned(), output.to_owned());
        Ok(Listed(partial.to_owned()))
    }
}

impl Drop for Listed {
    fn drop(&mut self) {
        unfinished().outputs.remove(&self.0);
    }
}

impl PartialFile {
    /// The temporary name of the file that will be `output`.
    pub fn name_for(output: &Path) -> PathBuf {
        let mut name = OsString::from(".");
        name.push(output.file_name().unwrap_or_default());
        name.push(".partial");
        output.with_file_name(name)
    }

    /// Creates the file that will be `output`; with `force` it may replace another.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder cannot be written to, if the output exists and may not be
    /// replaced, or if another run is writing it.
    pub fn create(output: &Path, force: bool) -> Result<(File, Self)> {
        if is_remote(output) {
            let problem = "is an address; outputs are files";
            return Err(Error::io(output)(io::Error::new(ErrorKind::InvalidInput, problem)));
        }
        if let Ok(existing) = output.symlink_metadata()
            && !(force && existing.is_file())
        {
            return Err(exists(output));
        }
        let (file, partial) = create_partial(output).map_err(Error::io(output))?;
        let listed = Listed::new(&partial, output)?;
        Ok((file, PartialFile { partial, output: output.to_owned(), force, listed }))
    }

    /// Leaves the file under its temporary name, which is returned.
    pub fn leave(mut self) -> PathBuf {
        self.partial.disable_cleanup(true);
        self.partial.to_path_buf()
    }

    /// Fails if another run is writing the file.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn refuse_busy(path: &Path) -> Result<()> {
        File::open(path).and_then(|file| lock(&file)).map_err(Error::io(path))
    }

    /// Gives the file its name. Close it before.
    ///
    /// # Errors
    /// [`Error::Io`] if that name is taken by now.
    pub fn put(self) -> Result<()> {
        let PartialFile { partial, output, force, listed } = self;
        let unfinished = unfinished();
        let put = match unfinished.is_over {
            true => Err(Error::Interrupted { path: output }),
            false => put(partial, &output, force),
        };
        // Dropping `listed` locks the list once more.
        drop(unfinished);
        drop(listed);
        put
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

/// Removes the file of a run that ended. A run that goes on holds a lock.
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

/// Locks a file for as long as it is open. On file systems without locks, other runs go unnoticed.
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
    partial.persist(output).map_err(|refused| Error::io(output)(refused.error))
}

fn exists(output: &Path) -> Error {
    Error::io(output)(io::Error::new(
        ErrorKind::AlreadyExists,
        "exists already and may not be replaced",
    ))
}

/// Writes a file of any kind, which appears under its name when it is complete.
///
/// # Errors
/// [`Error::Io`], also if the output exists and may not be replaced.
pub fn write_file(output: &Path, bytes: &[u8], force: bool) -> Result<()> {
    let (mut file, partial) = PartialFile::create(output, force)?;
    file.write_all(bytes).and_then(|()| file.flush()).map_err(Error::io(output))?;
    drop(file);
    partial.put()
}
