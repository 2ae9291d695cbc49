//! What a recording is read from.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::ops::Range;

use serde::Serialize;

/// A file, a stream, or a remote object. A read fills its buffer unless the bytes end.
pub(crate) trait Input: Read + Seek + Send {
    /// Bytes of the input; an error for a stream.
    fn size(&self) -> io::Result<u64>;

    /// Whether it is a folder.
    fn is_folder(&self) -> io::Result<bool> {
        Ok(false)
    }

    /// Whether its bytes come from front to back alone, and their number is not known.
    fn is_sequential(&self) -> bool {
        false
    }

    /// Tells which stretches will be read, in order, so that a remote object is fetched in pieces
    /// of fitting sizes. Anything else can be read, too.
    fn expect(&mut self, _stretches: Vec<Range<u64>>) {}

    /// Tells that everything from here to the end will be read more than once, so that it is kept
    /// of a remote object.
    fn keep_end(&mut self, _from: u64) -> io::Result<()> {
        Ok(())
    }

    /// A number for one state of a remote object, unique in this process.
    fn object_id(&self) -> Option<u64> {
        None
    }

    /// What was fetched over the network.
    fn fetched(&self) -> Option<Fetched> {
        None
    }
}

/// What was fetched of an object over the network since this process first opened it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Fetched {
    /// Requests for it, repeated ones included.
    pub requests: u64,
    /// Bytes of it that were received and used.
    pub bytes: u64,
}

impl Input for File {
    fn size(&self) -> io::Result<u64> {
        Ok(self.metadata()?.len())
    }

    fn is_folder(&self) -> io::Result<bool> {
        Ok(self.metadata()?.is_dir())
    }
}

/// Standard input.
pub(crate) struct Stream(pub(crate) io::Stdin);

impl Input for Stream {
    fn is_sequential(&self) -> bool {
        true
    }

    fn size(&self) -> io::Result<u64> {
        Err(ErrorKind::NotSeekable.into())
    }
}

impl Read for Stream {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.0.read(into)
    }
}

impl Seek for Stream {
    fn seek(&mut self, _to: SeekFrom) -> io::Result<u64> {
        Err(ErrorKind::NotSeekable.into())
    }
}
