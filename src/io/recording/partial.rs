//! A file being written beside its final name, and put there when it is whole.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempPath;

use crate::error::{Error, Result};

/// A file under a temporary name in the folder of its final one (`.NAME.XXXXXX.partial`); it is removed
/// if it is never put there.
pub struct PartialFile {
    partial: TempPath,
    output: PathBuf,
    force: bool,
    listed: Listed,
}

/// The partial files of this process, for who must end it without waiting for those who write them.
static UNFINISHED: Mutex<Unfinished> =
    Mutex::new(Unfinished { outputs: BTreeMap::new(), is_over: false });

struct Unfinished {
    /// By the path of the partial file what it should become.
    outputs: BTreeMap<PathBuf, PathBuf>,
    /// Whether no file may come to its place any more.
    is_over: bool,
}

fn unfinished() -> MutexGuard<'static, Unfinished> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes every partial file of this process, and returns the outputs that they should have become. None can come
/// to its place afterwards, so this is for a process that is about to end, as on a signal.
pub fn abandon_partial_files() -> Vec<PathBuf> {
    let mut unfinished = unfinished();
    unfinished.is_over = true;
    let outputs = std::mem::take(&mut unfinished.outputs);
    for partial in outputs.keys() {
        // Whoever writes it may be removing it at this moment.
        let _ = std::fs::remove_file(partial);
    }
    outputs.into_values().collect()
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
        let listed = Listed::new(&partial, output)?;
        Ok((file, PartialFile { partial, output: output.to_owned(), force, listed }))
    }

    /// Gives the file its name. It should be closed by then.
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
        // The list must be open for the file to leave it.
        drop(unfinished);
        drop(listed);
        put
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
