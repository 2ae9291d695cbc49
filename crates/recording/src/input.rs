//! Where the bytes of a recording come from: a file, a stream, or an object in a store.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

use crate::address::{STANDARD_STREAM, is_remote, open_part};
use crate::error::{Error, Result};
use crate::fetched::Fetched;
#[cfg(feature = "remote")]
use crate::remote::RemoteFile;

/// The bytes of an input. A read fills its buffer unless the bytes end.
pub(crate) enum Input {
    File(File),
    Stdin(io::Stdin),
    #[cfg(feature = "remote")]
    Remote(RemoteFile),
}

impl Input {
    /// Opens a file, a stream, or the object at an address.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::NoRemote`] if addresses cannot be read here.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        if is_remote(path) {
            return open_remote(path);
        }
        match path == STANDARD_STREAM {
            true => Ok(Input::Stdin(io::stdin())),
            false => File::open(path).map(Input::File).map_err(|source| at(path, source)),
        }
    }

    /// Bytes of the input; an error for a stream.
    pub(crate) fn size(&self) -> io::Result<u64> {
        match self {
            Input::File(file) => Ok(file.metadata()?.len()),
            Input::Stdin(_) => Err(ErrorKind::NotSeekable.into()),
            #[cfg(feature = "remote")]
            Input::Remote(file) => Ok(file.size()),
        }
    }

    /// Whether it is a folder.
    pub(crate) fn is_folder(&self) -> io::Result<bool> {
        match self {
            Input::File(file) => Ok(file.metadata()?.is_dir()),
            _ => Ok(false),
        }
    }

    /// Tells which stretches will be read, in order, so that a remote object is fetched in pieces
    /// of fitting sizes.
    pub(crate) fn expect(&mut self, stretches: Vec<Range<u64>>) {
        match self {
            #[cfg(feature = "remote")]
            Input::Remote(file) => file.expect(stretches),
            _ => drop(stretches),
        }
    }

    /// Tells that everything from here to the end will be read more than once, so that it is kept
    /// of a remote object.
    pub(crate) fn keep_end(&mut self, from: u64) -> io::Result<()> {
        match self {
            #[cfg(feature = "remote")]
            Input::Remote(file) => file.keep_end(from),
            _ => {
                let _ = from;
                Ok(())
            }
        }
    }

    /// A number for one state of a remote object, unique in this process.
    pub(crate) fn object_id(&self) -> Option<u64> {
        match self {
            #[cfg(feature = "remote")]
            Input::Remote(file) => Some(file.object_id()),
            _ => None,
        }
    }

    /// What was fetched over the network.
    pub(crate) fn fetched(&self) -> Option<Fetched> {
        match self {
            #[cfg(feature = "remote")]
            Input::Remote(file) => Some(file.fetched()),
            _ => None,
        }
    }
}

impl Read for Input {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        match self {
            Input::File(file) => file.read(into),
            Input::Stdin(input) => input.read(into),
            #[cfg(feature = "remote")]
            Input::Remote(file) => file.read(into),
        }
    }
}

impl Seek for Input {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            Input::File(file) => file.seek(to),
            Input::Stdin(_) => Err(ErrorKind::NotSeekable.into()),
            #[cfg(feature = "remote")]
            Input::Remote(file) => file.seek(to),
        }
    }
}

#[cfg(feature = "remote")]
fn open_remote(address: &Path) -> Result<Input> {
    let opened = RemoteFile::open(address);
    opened.map(Input::Remote).map_err(|source| at(address, source))
}

#[cfg(not(feature = "remote"))]
fn open_remote(address: &Path) -> Result<Input> {
    let shown = open_part(&address.to_string_lossy());
    Err(Error::NoRemote { path: shown.into() })
}

/// Names the input, without the secrets of its address.
fn at(path: &Path, source: io::Error) -> Error {
    let path = match is_remote(path) {
        true => open_part(&path.to_string_lossy()).into(),
        false => path.to_owned(),
    };
    Error::Io { path, source }
}
