//! Where the bytes of a recording go.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::address::STANDARD_STREAM;
use crate::error::{Error, Result};
use crate::partial::PartialFile;

/// The file or stream that is written.
pub(super) struct Output {
    sink: Sink,
    path: PathBuf,
    /// Bytes written so far.
    pub(super) offset: u64,
    /// Checksum of those.
    crc: crc32fast::Hasher,
}

enum Sink {
    // The name behind the file, so that it is closed before it is removed.
    File(File, PartialFile),
    StandardOutput(io::Stdout),
}

impl Output {
    /// Creates the file under a temporary name, or takes standard output ([`STANDARD_STREAM`]).
    pub(super) fn create(path: &Path, force: bool) -> Result<Self> {
        let sink = match path == STANDARD_STREAM {
            true => Sink::StandardOutput(io::stdout()),
            false => {
                let (file, partial) = PartialFile::create(path, force)?;
                Sink::File(file, partial)
            }
        };
        Ok(Output { sink, path: path.to_owned(), offset: 0, crc: crc32fast::Hasher::new() })
    }

    /// An error of the system about this output.
    pub(super) fn error(&self, source: io::Error) -> Error {
        match self.sink {
            Sink::File(..) => Error::Io { path: self.path.clone(), source },
            Sink::StandardOutput(_) => Error::StandardOutput { source },
        }
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<()> {
        let written = match &mut self.sink {
            Sink::File(file, _) => file.write_all(bytes),
            Sink::StandardOutput(output) => output.write_all(bytes),
        };
        written.map_err(|source| self.error(source))?;
        self.crc.update(bytes);
        self.offset += bytes.len() as u64;
        Ok(())
    }

    /// Checksum of the bytes written so far.
    pub(super) fn checksum(&self) -> u32 {
        self.crc.clone().finalize()
    }

    /// Makes sure that everything is on the disk.
    pub(super) fn sync(&mut self) -> Result<()> {
        let synced = match &mut self.sink {
            Sink::File(file, _) => file.sync_all(),
            Sink::StandardOutput(output) => output.flush(),
        };
        synced.map_err(|source| self.error(source))
    }

    /// Gives a file its name.
    pub(super) fn close(self) -> Result<()> {
        match self.sink {
            Sink::File(file, partial) => {
                drop(file);
                partial.put()
            }
            Sink::StandardOutput(_) => Ok(()),
        }
    }

    /// Leaves a file under its temporary name, which is returned.
    pub(super) fn leave(self) -> PathBuf {
        match self.sink {
            Sink::File(_, partial) => partial.leave(),
            Sink::StandardOutput(_) => self.path,
        }
    }
}
