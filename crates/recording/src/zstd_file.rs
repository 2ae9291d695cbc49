//! A recording in a file that is compressed as a whole (`.mcap.zst`, rosbag2's `.mcap.zstd`).

use std::io::{self, BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

use zstd::stream::read::Decoder;

use crate::damage::Damage;
use crate::input::{Fetched, Input};
use crate::unpacked::UnpackedBytes;

/// Whether a path names such a file.
pub(crate) fn is_named(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    extension == "zst" || extension == "zstd"
}

/// The bytes of a file, unpacked as they are read. They can be read from front to back alone.
pub(crate) struct ZstdFile {
    decoder: Decoder<'static, BufReader<Box<dyn Input>>>,
    unpacked: UnpackedBytes,
}

impl ZstdFile {
    pub(crate) fn new(file: Box<dyn Input>) -> io::Result<Self> {
        let unpacked = UnpackedBytes::of_file(file.size().unwrap_or(0));
        Ok(ZstdFile { decoder: Decoder::new(file)?, unpacked })
    }
}

impl Read for ZstdFile {
    /// A file that is cut off ends there, so that what was recorded before is read.
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = match self.decoder.read(into) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => 0,
            read => read?,
        };
        match self.unpacked.take(read as u64) {
            true => Ok(read),
            false => {
                let damage = Damage::UnpacksToTooMuch { most: self.unpacked.most };
                Err(io::Error::new(ErrorKind::InvalidData, damage))
            }
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
        self.decoder.get_ref().get_ref().is_folder()
    }

    fn is_sequential(&self) -> bool {
        true
    }

    fn object_id(&self) -> Option<u64> {
        self.decoder.get_ref().get_ref().object_id()
    }

    fn fetched(&self) -> Option<Fetched> {
        self.decoder.get_ref().get_ref().fetched()
    }
}
