//! A file that is written under a temporary name, and gets its own when it is complete.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{File, Metadata, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempPath;

use crate::address::is_remote;
use crate::error::{Error, Result};
use crate::file_id::is_at;

/// The longest name of a file on nearly all file systems, bytes.
const LONGEST_NAME: usize = 255;

/// What the longest hidden companion of an output adds to its name: `.NAME.partial.old`.
const COMPANION: usize = ".".len() + ".partial.old".len();

/// How often a file under the temporary name is looked at again because another run exchanged it.
const ATTEMPTS: usize = 100;

/// A file under a temporary name (`.NAME.partial`) in the folder of its final one. It is removed if
/// it never gets its name. A file that an earlier run left under the temporary name is replaced,
/// unless that run still goes on. Anything else under it, such as a link or a FIFO, is an error:
/// nothing is written through a link.
///
/// The file is locked until it has its name or is removed, so that of several runs with one output
/// only one writes it.
pub struct PartialFile {
    // Before the lock, so that it is removed while it is locked.
    partial: TempPath,
    lock: File,
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

    /// Creates the file that will be `output`; with `force` it may replace another, whose
    /// permissions it gets.
    ///
    /// # Errors
    /// Those of [`check_output`]; [`Error::Io`] if the folder is missing or cannot be written to,
    /// if the temporary name is taken by something that no run left, or if another run is writing
    /// the output.
    pub fn create(output: &Path, force: bool) -> Result<(File, Self)> {
        check_output(output, force)?;
        check_folder(output)?;
        let (file, partial) = create_partial(output)?;
        // Another run may have completed it since.
        let replaced = check_output(output, force)?;
        let at_output = Error::io(output);
        if let Some(replaced) = replaced {
            file.set_permissions(replaced.permissions()).map_err(&at_output)?;
        }
        let lock = file.try_clone().map_err(&at_output)?;
        let listed = Listed::new(&partial, output)?;
        Ok((file, PartialFile { partial, lock, output: output.to_owned(), force, listed }))
    }

    /// Leaves the file under its temporary name, which is returned.
    pub fn leave(mut self) -> PathBuf {
        self.partial.disable_cleanup(true);
        self.partial.to_path_buf()
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// [`Error::Io`] if that name is taken by now, or the temporary one is no longer this file's.
    pub fn put(self) -> Result<()> {
        let PartialFile { partial, lock, output, force, listed } = self;
        let unfinished = unfinished();
        let put = match unfinished.is_over {
            true => Err(Error::Interrupted { path: output }),
            false => put(partial, &lock, &output, force),
        };
        // Dropping `listed` locks the list once more.
        drop(unfinished);
        drop(listed);
        put
    }
}

/// Checks whether an output can have that name: it must name a file, leave room for the names of
/// its hidden companions, and not be taken; with `force`, a file that is there may be replaced and
/// is returned.
///
/// # Errors
/// [`Error::Io`] that says what to do.
pub fn check_output(output: &Path, force: bool) -> Result<Option<Metadata>> {
    let refuse = |kind, problem: String| Err(Error::io(output)(io::Error::new(kind, problem)));
    if is_remote(output) {
        let problem = "cannot write to an address; name a file";
        return refuse(ErrorKind::InvalidInput, problem.to_owned());
    }
    let Some(name) = output.file_name() else {
        return refuse(ErrorKind::InvalidInput, "not the name of a file".to_owned());
    };
    let (length, longest) = (name.as_encoded_bytes().len(), LONGEST_NAME - COMPANION);
    if length > longest {
        let problem = format!(
            "the name has {length} bytes; use at most {longest}, so that the hidden files beside \
             it can have longer ones"
        );
        return refuse(ErrorKind::InvalidFilename, problem);
    }
    match output.symlink_metadata() {
        Ok(existing) if existing.is_file() && force => Ok(Some(existing)),
        Ok(existing) if force => {
            let problem = format!("is {}, which is not replaced", kind_of(&existing));
            refuse(ErrorKind::AlreadyExists, problem)
        }
        Ok(_) => Err(exists(output)),
        Err(_) => Ok(None),
    }
}

/// Checks that the folder of an output exists.
///
/// # Errors
/// [`Error::Io`] that names the folder.
pub fn check_folder(output: &Path) -> Result<()> {
    let folder = output.parent().filter(|folder| *folder != "");
    match folder {
        Some(folder) if !folder.is_dir() => {
            let problem = format!("there is no folder {}; make it first", folder.display());
            Err(Error::io(output)(io::Error::new(ErrorKind::NotFound, problem)))
        }
        _ => Ok(()),
    }
}

/// Opens a file that an earlier run may have left under a hidden name, to read it. Links are not
/// followed, and a FIFO is not waited for. `None` if there is none.
///
/// # Errors
/// [`Error::Io`] if it cannot be opened, or is not a file that a run leaves.
pub fn open_left(path: &Path) -> Result<Option<File>> {
    let planted = |metadata: &Metadata| {
        let problem = format!(
            "is {}, not a file that an earlier run left; remove it, or write to another folder",
            kind_of(metadata)
        );
        Err(Error::io(path)(io::Error::new(ErrorKind::AlreadyExists, problem)))
    };
    match path.symlink_metadata() {
        Ok(metadata) if !metadata.is_file() => return planted(&metadata),
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            return Ok(None);
        }
        _ => {}
    }
    let mut options = OpenOptions::new();
    options.read(true);
    // It may have been exchanged since.
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(
        &mut options,
        libc::O_NOFOLLOW | libc::O_NONBLOCK,
    );
    match options.open(path).and_then(|file| Ok((file.metadata()?, file))) {
        Ok((metadata, _)) if !metadata.is_file() => planted(&metadata),
        Ok((_, file)) => Ok(Some(file)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(Error::io(path)(error)),
    }
}

/// Opens a file that an earlier run may have left, as [`open_left`], and locks it, so that it can
/// be moved or removed.
///
/// # Errors
/// Those of [`open_left`]; [`Error::Io`] if another run is writing it.
pub fn lock_left(path: &Path) -> Result<Option<File>> {
    for _ in 0..ATTEMPTS {
        let Some(file) = open_left(path)? else { return Ok(None) };
        lock(&file).map_err(Error::io(path))?;
        // The run that held the lock may have renamed the file, and another begun since.
        if is_at(&file, path) {
            return Ok(Some(file));
        }
    }
    Err(Error::io(path)(busy()))
}

/// Creates a hidden file beside an output. A file that an earlier run left there is removed.
///
/// # Errors
/// Those of [`lock_left`]; [`Error::Io`].
pub fn create_hidden(path: &Path) -> Result<File> {
    if let Some(left) = lock_left(path)? {
        std::fs::remove_file(path).map_err(Error::io(path))?;
        drop(left);
    }
    File::create_new(path).map_err(Error::io(path))
}

fn create_partial(output: &Path) -> Result<(File, TempPath)> {
    let path = PartialFile::name_for(output);
    for _ in 0..ATTEMPTS {
        let file = match create_hidden(&path) {
            Ok(file) => file,
            // Another run was faster; what it does is seen the next time.
            Err(Error::Io { source, .. })
                if source.get_ref().is_none() && source.kind() == ErrorKind::AlreadyExists =>
            {
                continue;
            }
            Err(error) => return Err(error),
        };
        lock(&file).map_err(Error::io(&path))?;
        // Until it was locked, another run could take it for one that was left.
        if is_at(&file, &path) {
            return Ok((file, TempPath::try_from_path(&path).map_err(Error::io(&path))?));
        }
    }
    Err(Error::io(&path)(busy()))
}

/// Locks a file for as long as it is open. On file systems without locks, other runs go unnoticed.
fn lock(file: &File) -> io::Result<()> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(busy()),
        _ => Ok(()),
    }
}

fn busy() -> io::Error {
    io::Error::new(ErrorKind::ResourceBusy, "is being written by another run")
}

/// What is in the place of a file.
fn kind_of(metadata: &Metadata) -> &'static str {
    match metadata.file_type() {
        kind if kind.is_symlink() => "a link",
        kind if kind.is_dir() => "a folder",
        kind if kind.is_file() => "a file",
        _ => "a pipe or device",
    }
}

/// Gives the file its name.
fn put(partial: TempPath, lock: &File, output: &Path, force: bool) -> Result<()> {
    // Only where a file system has no locks, or someone moved files by hand.
    if !is_at(lock, &partial) {
        let _ = partial.keep();
        let problem =
            "the file being written was replaced by another one; nothing was put in place";
        return Err(Error::io(output)(io::Error::other(problem)));
    }
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
