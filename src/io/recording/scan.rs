//! The bytes of a recording from front to back, and the small pieces that records are made of.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::error::{Error, Result};

/// Bytes of a record's opcode and length.
pub(super) const HEAD_LEN: usize = 1 + 8;

/// The most that one record, or the records of one chunk, may hold. A length is believed up to here.
pub(super) const MAX_RECORD: u64 = 2 << 30;

/// Bytes read at a time.
const PIECE: usize = 1 << 20;

/// The bytes of a file in order, hashed as they go by.
pub(super) struct Source {
    pub(super) path: PathBuf,
    pub(super) size: u64,
    pub(super) offset: u64,
    /// Whether the file ends as a recording does.
    pub(super) is_complete: bool,
    file: io::BufReader<File>,
    hasher: Option<Sha256>,
}

impl Source {
    /// Opens a recording and reads the magic that it starts with.
    pub(super) fn open(path: &Path, hash: bool) -> Result<Self> {
        let at = |source| Error::Io { path: path.to_owned(), source };
        // Asked before opening, which waits for ever at a pipe that nobody writes to.
        let kind = std::fs::metadata(path).map_err(at)?;
        if !kind.is_file() {
            return Err(not_a_file(path, kind.is_dir()));
        }
        let mut file = File::open(path).map_err(at)?;
        let metadata = file.metadata().map_err(at)?;
        let is_complete = ends_with_magic(&mut file, metadata.len()).map_err(at)?;
        file.seek(SeekFrom::Start(0)).map_err(at)?;
        let mut source = Source {
            path: path.to_owned(),
            size: metadata.len(),
            offset: 0,
            is_complete,
            file: io::BufReader::with_capacity(64 << 10, file),
            hasher: hash.then(Sha256::new),
        };
        source.expect_magic()?;
        Ok(source)
    }

    /// Bytes that are still to be read.
    pub(super) fn remaining(&self) -> u64 {
        self.size - self.offset
    }

    /// Appends the next `length` bytes, of which there must be as many.
    pub(super) fn read(&mut self, length: u64, into: &mut Vec<u8>) -> Result<()> {
        debug_assert!(length <= self.remaining());
        let start = into.len();
        let read = (&mut self.file).take(length).read_to_end(into);
        let read = read.map_err(|error| self.io_error(error))? as u64;
        if read < length {
            return Err(self.io_error(io::Error::new(
                ErrorKind::UnexpectedEof,
                "the file became shorter while it was read",
            )));
        }
        if let Some(hasher) = &mut self.hasher {
            hasher.update(&into[start..]);
        }
        self.offset += length;
        Ok(())
    }

    /// Reads what is left and returns the SHA-256 of the file in lowercase hexadecimal.
    pub(super) fn finish(mut self) -> Result<String> {
        let mut piece = Vec::new();
        while self.remaining() > 0 {
            piece.clear();
            self.read(self.remaining().min(PIECE as u64), &mut piece)?;
        }
        let digest = self.hasher.unwrap_or_default().finalize();
        Ok(digest.iter().map(|byte| format!("{byte:02x}")).collect())
    }

    /// An error about what is at `offset`.
    pub(super) fn damage(&self, offset: u64, problem: impl Into<String>) -> Error {
        Error::Recording { path: self.path.clone(), offset, problem: problem.into() }
    }

    fn io_error(&self, source: io::Error) -> Error {
        Error::Io { path: self.path.clone(), source }
    }

    fn expect_magic(&mut self) -> Result<()> {
        let mut start = Vec::new();
        self.read(self.size.min(mcap::MAGIC.len() as u64), &mut start)?;
        if start == mcap::MAGIC {
            return Ok(());
        }
        // Only to tell kinds of file apart, so not hashed.
        let mut more = [0; 8];
        let length = self.file.read(&mut more).unwrap_or(0);
        start.extend_from_slice(&more[..length]);
        Err(self.damage(0, not_a_recording(&start)))
    }
}

/// The fields of a record that is taken apart here: little endian, strings behind their length.
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (bytes, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*bytes)
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.take().map(u8::from_le_bytes)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    pub(super) fn bytes(&mut self, length: u64) -> Option<&'a [u8]> {
        let (bytes, rest) = self.0.split_at_checked(usize::try_from(length).ok()?)?;
        self.0 = rest;
        Some(bytes)
    }

    pub(super) fn str(&mut self) -> Option<&'a str> {
        let length = self.u32()?;
        std::str::from_utf8(self.bytes(length.into())?).ok()
    }
}

/// The head of a record.
pub(super) fn head(opcode: u8, length: u64) -> [u8; HEAD_LEN] {
    let mut head = [opcode; HEAD_LEN];
    head[1..].copy_from_slice(&length.to_le_bytes());
    head
}

fn ends_with_magic(file: &mut File, size: u64) -> io::Result<bool> {
    let length = mcap::MAGIC.len() as u64;
    if size < 2 * length {
        return Ok(false);
    }
    let mut end = [0; 8];
    file.seek(SeekFrom::Start(size - length))?;
    file.read_exact(&mut end)?;
    Ok(end == mcap::MAGIC)
}

fn not_a_file(path: &Path, is_folder: bool) -> Error {
    let problem = match (is_folder, path.join("metadata.yaml").exists()) {
        (true, true) => "is the folder of a rosbag2 recording; name the .mcap file in it",
        (true, false) => "is a folder, not an MCAP recording",
        (false, _) => "is not a regular file; a recording must be one",
    };
    Error::Recording { path: path.to_owned(), offset: 0, problem: problem.to_owned() }
}

/// What a file that starts with `start` is instead.
fn not_a_recording(start: &[u8]) -> String {
    const KINDS: [(&[u8], &str); 8] = [
        (b"#ROSBAG", "a ROS 1 bag; convert it to MCAP first (`mcap convert`)"),
        (
            b"SQLite format 3",
            "a rosbag2 database (.db3); convert it to MCAP first (`ros2 bag convert`)",
        ),
        (b"\x1f\x8b", "compressed with gzip; decompress it first"),
        (b"\x28\xb5\x2f\xfd", "compressed with zstd; decompress it first"),
        (b"\x04\x22\x4d\x18", "compressed with lz4; decompress it first"),
        (b"BZh", "compressed with bzip2; decompress it first"),
        (b"\xfd7zXZ", "compressed with xz; decompress it first"),
        (b"PK\x03\x04", "a zip archive; unpack it first"),
    ];
    if start.is_empty() {
        return "the file is empty".to_owned();
    }
    if mcap::MAGIC.starts_with(start) {
        return "the file is cut off within the eight bytes that an MCAP starts with".to_owned();
    }
    if start.starts_with(&mcap::MAGIC[..5]) {
        return format!(
            "an MCAP of version {:?}; only version '0' can be read",
            char::from(start[5])
        );
    }
    match KINDS.iter().find(|(magic, _)| start.starts_with(magic)) {
        Some((_, kind)) => format!("not an MCAP but {kind}"),
        None => {
            let bytes: Vec<String> = start.iter().take(8).map(|b| format!("{b:02x}")).collect();
            format!("not an MCAP: it starts with {}", bytes.join(" "))
        }
    }
}
