//! A recording in a file that is compressed as a whole (`.mcap.zst`, rosbag2's `.mcap.zstd`).

use std::io::{self, BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

use zstd::stream::read::Decoder;

use crate::input::{Fetched, Input};

/// Whether a path names such a file.
pub(crate) fn is_named(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    extension == "zst" || extension == "zstd"
}

/// The bytes of a file, unpacked as they are read. They can be read from front to back alone.
pub(crate) struct ZstdFile(Decoder<'static, BufReader<Box<dyn Input>>>);

impl ZstdFile {
    pub(crate) fn new(file: Box<dyn Input>) -> io::Result<Self> {
        Ok(ZstdFile(Decoder::new(file)?))
    }
}

impl Read for ZstdFile {
    /// A file that is cut off ends there, so that what was recorded before is read.
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        match self.0.read(into) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(0),
            read => read,
        }
    }
}

impl Seek for ZstdFile {
    fn seek(&mut self, _to: SeekFrom) -> io::Result<u64> {
        Err(ErrorKind::NotSeekable.into())
    }
}

impl Input for ZstdFile {
    fn size(&self) -> io::Result<u64> {
        Err(ErrorKind::NotSeekable.into())
    }

    fn is_folder(&self) -> io::Result<bool> {
        self.0.get_ref().get_ref().is_folder()
    }

    fn is_sequential(&self) -> bool {
        true
    }

    fn object_id(&self) -> Option<u64> {
        self.0.get_ref().get_ref().object_id()
    }

    fn fetched(&self) -> Option<Fetched> {
        self.0.get_ref().get_ref().fetched()
    }
}
