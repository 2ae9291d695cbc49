//! Opening what a path names.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use crate::address::{STANDARD_STREAM, is_remote, open_part};
use crate::error::{Error, Result};
use crate::input::{Input, Stream};
#[cfg(feature = "remote")]
use crate::remote::RemoteFile;
use crate::zstd_file::{self, ZstdFile};

/// Opens a file, a stream, or the object at an address. One that is named as compressed with zstd
/// is unpacked as it is read.
///
/// # Errors
/// [`Error::Io`]; [`Error::NoRemote`] if addresses cannot be read here.
pub(crate) fn open(path: &Path) -> Result<Box<dyn Input>> {
    let input = open_as_it_is(path)?;
    match zstd_file::is_named(path) && !input.is_folder().map_err(Error::io(path))? {
        true => Ok(Box::new(ZstdFile::new(input).map_err(Error::io(path))?)),
        false => Ok(input),
    }
}

fn open_as_it_is(path: &Path) -> Result<Box<dyn Input>> {
    if is_remote(path) {
        return open_remote(path);
    }
    if path == STANDARD_STREAM {
        return Ok(Box::new(Stream(io::stdin())));
    }
    Ok(Box::new(File::open(path).map_err(Error::io(path))?))
}

#[cfg(feature = "remote")]
fn open_remote(address: &Path) -> Result<Box<dyn Input>> {
    let opened = RemoteFile::open(address);
    Ok(Box::new(opened.map_err(Error::io(&without_secrets(address)))?))
}

#[cfg(not(feature = "remote"))]
fn open_remote(address: &Path) -> Result<Box<dyn Input>> {
    Err(Error::NoRemote { path: without_secrets(address) })
}

fn without_secrets(address: &Path) -> PathBuf {
    open_part(&address.to_string_lossy()).into()
}
