//! The bytes of a recording from front to back, and the small pieces that records are made of.

use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use sha2::{Digest, Sha256};

use super::input::{Fetched, Input};
use super::overview::Overview;
use crate::error::{Error, Result};
use crate::io::address::is_remote;

/// Bytes of a record's opcode and length.
pub(super) const HEAD_LEN: usize = 1 + 8;

/// The most that one record, or the records of one chunk, may hold. A length is believed up to here.
pub(super) const MAX_RECORD: u64 = 2 << 30;

/// Bytes read at a time.
const PIECE: usize = 1 << 20;

/// The name that stands for the standard streams: input to be read from, output to be written to.
pub const STANDARD_STREAM: &str = "-";

/// Whether a name stands for a stream, which is read once from front to back: the standard one, a pipe, a device.
pub fn is_stream(path: &Path) -> bool {
    let is_other = |metadata: std::fs::Metadata| !metadata.is_file() && !metadata.is_dir();
    path == STANDARD_STREAM || !is_remote(path) && path.metadata().is_ok_and(is_other)
}

/// The bytes of a file or a stream in order, hashed as they go by unless some are passed over.
pub(super) struct Source {
    pub(super) path: PathBuf,
    /// Bytes of the file; of a stream those are not known.
    pub(super) size: Option<u64>,
    pub(super) offset: u64,
    /// Whether the file ends as a recording does; of a stream that is not known either, and not taken for granted.
    pub(super) is_complete: bool,
    file: io::BufReader<Counted>,
    hasher: Option<Sha256>,
}

/// Where bytes come from, and how many were read.
struct Counted {
    from: Input,
    bytes: u64,
}

impl Read for Counted {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.from.read(into)?;
        self.bytes += read as u64;
        Ok(read)
    }
}

impl Seek for Counted {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.from.seek(to)
    }
}

impl Source {
    /// Opens a recording and reads the magic that it starts with.
    pub(super) fn open(path: &Path, hash: bool) -> Result<Self> {
        let at = |source| Error::Io { path: path.to_owned(), source };
        let mut from = Input::open(path)?;
        let (size, is_complete) = match is_stream(path) {
            true => (None, false),
            false => {
                if from.is_folder().map_err(at)? {
                    return Err(a_folder(path));
                }
                let size = from.size().map_err(at)?;
                let is_complete = ends_with_magic(&mut from, size).map_err(at)?;
                from.seek(SeekFrom::Start(0)).map_err(at)?;
                (Some(size), is_complete)
            }
        };
        let mut source = Source {
            path: path.to_owned(),
            size,
            offset: 0,
            is_complete,
            file: io::BufReader::with_capacity(64 << 10, Counted { from, bytes: 0 }),
            hasher: hash.then(Sha256::new),
        };
        source.expect_magic()?;
        Ok(source)
    }

    /// Bytes that are still to be read, as far as is known.
    pub(super) fn remaining(&self) -> u64 {
        self.size.map_or(u64::MAX, |size| size.saturating_sub(self.offset))
    }

    /// Appends the next `length` bytes, of a file as many as remain at most, and returns their number: of a stream that
    /// ends before, fewer. No more memory is taken than bytes come.
    pub(super) fn read(&mut self, length: u64, into: &mut Vec<u8>) -> Result<u64> {
        let start = into.len();
        let read = (&mut self.file).take(length).read_to_end(into);
        let read = read.map_err(|error| self.io_error(error))? as u64;
        if read < length && self.size.is_some() {
            return Err(self.io_error(io::Error::new(
                ErrorKind::UnexpectedEof,
                "the file became shorter while it was read",
            )));
        }
        if let Some(hasher) = &mut self.hasher {
            hasher.update(&into[start..]);
        }
        self.offset += read;
        Ok(read)
    }

    /// Goes on at a later place; there is no hash of the file then.
    pub(super) fn pass_to(&mut self, offset: u64) -> Result<()> {
        let sought = self.file.seek(SeekFrom::Start(offset));
        self.offset = sought.map_err(|error| self.io_error(error))?;
        self.hasher = None;
        Ok(())
    }

    /// Says which stretches of the file will be read, in order ([`Input::expect`]).
    pub(super) fn expect(&mut self, stretches: Vec<Range<u64>>) {
        self.file.get_mut().from.expect(stretches);
    }

    /// What was fetched of it over the network ([`Input::fetched`]).
    pub(super) fn fetched(&self) -> Option<Fetched> {
        self.file.get_ref().from.fetched()
    }

    /// What is known of it ([`Input::known_overview`]).
    pub(super) fn known_overview(&self) -> Option<Arc<OnceLock<Overview>>> {
        self.file.get_ref().from.known_overview()
    }

    /// Bytes that were read of the file.
    pub(super) fn bytes_read(&self) -> u64 {
        self.file.get_ref().bytes
    }

    /// Reads what is left and returns the SHA-256 of the file in lowercase hexadecimal; of one that is not hashed,
    /// nothing.
    pub(super) fn finish(&mut self) -> Result<Option<String>> {
        if self.hasher.is_none() {
            return Ok(None);
        }
        let mut piece = Vec::new();
        while self.read(self.remaining().min(PIECE as u64), &mut piece)? > 0 {
            piece.clear();
        }
        let digest = self.hasher.take().map(Sha256::finalize);
        Ok(digest.map(|digest| digest.iter().map(|byte| format!("{byte:02x}")).collect()))
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
        self.read(self.remaining().min(mcap::MAGIC.len() as u64), &mut start)?;
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

fn ends_with_magic(file: &mut Input, size: u64) -> io::Result<bool> {
    let length = mcap::MAGIC.len() as u64;
    if size < 2 * length {
        return Ok(false);
    }
    let mut end = [0; 8];
    file.seek(SeekFrom::Start(size - length))?;
    file.read_exact(&mut end)?;
    Ok(end == mcap::MAGIC)
}

fn a_folder(path: &Path) -> Error {
    let problem = match path.join("metadata.yaml").exists() {
        true => {
            "is the folder of a rosbag2 recording; `annotate` takes it as it is, other commands want an .mcap file in it"
        }
        false => "is a folder, not an MCAP recording",
    };
    Error::Recording { path: path.to_owned(), offset: 0, problem: problem.to_owned() }
}

/// What a file that starts with `start` is instead.
fn not_a_recording(start: &[u8]) -> String {
    const PACKETS: &str = "a capture of network packets; play it through the sensor's ROS 2 driver (or \
                           its maker's tools) and record the clouds: `ros2 bag record -s mcap -a`";
    const KINDS: [(&[u8], &str); 12] = [
        (b"#ROSBAG", "a ROS 1 bag; convert it to MCAP first (`mcap convert IN.bag OUT.mcap`)"),
        (
            b"SQLite format 3",
            "a rosbag2 database (.db3); convert it to MCAP first (`mcap convert IN.db3 OUT.mcap`, or `ros2 \
             bag convert`)",
        ),
        (b"\xd4\xc3\xb2\xa1", PACKETS),
        (b"\xa1\xb2\xc3\xd4", PACKETS),
        (b"\x4d\x3c\xb2\xa1", PACKETS),
        (b"\x0a\x0d\x0d\x0a", PACKETS),
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
