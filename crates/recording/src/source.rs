//! The bytes of a recording from front to back.

use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::address::is_stream;
use crate::damage::Damage;
use crate::error::{Error, Result};
use crate::file_kind::{START_LEN, not_a_recording};
use crate::input::{Fetched, Input};
use crate::open::open;

/// Bytes read at a time.
const PIECE: usize = 1 << 20;

/// The bytes of a file or a stream in order, hashed as they go by unless some are skipped.
pub(crate) struct Source {
    pub(crate) path: PathBuf,
    /// Bytes of the file; `None` for a stream.
    pub(crate) size: Option<u64>,
    /// Bytes of the file up to the zeros that it ends with; `None` for a stream.
    end: Option<u64>,
    pub(crate) offset: u64,
    /// Whether the file ends with the magic that closes a recording, and perhaps zeros behind it;
    /// `false` for a stream.
    pub(crate) is_complete: bool,
    file: io::BufReader<Counted>,
    hasher: Option<Sha256>,
}

/// Where bytes come from, and how many were read.
struct Counted {
    from: Box<dyn Input>,
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
    pub(crate) fn open(path: &Path, hash: bool) -> Result<Self> {
        let at = |source| Error::Io { path: path.to_owned(), source };
        let mut from = open(path)?;
        let (size, end, is_complete) = match is_stream(path) || from.is_sequential() {
            true => (None, None, false),
            false => {
                if from.is_folder().map_err(at)? {
                    return Err(a_folder(path));
                }
                let size = from.size().map_err(at)?;
                let end = end_before_zeros(&mut *from, size).map_err(at)?;
                let is_complete = ends_with_magic(&mut *from, end).map_err(at)?;
                from.seek(SeekFrom::Start(0)).map_err(at)?;
                (Some(size), Some(end), is_complete)
            }
        };
        let mut source = Source {
            path: path.to_owned(),
            size,
            end,
            offset: 0,
            is_complete,
            file: io::BufReader::with_capacity(64 << 10, Counted { from, bytes: 0 }),
            hasher: hash.then(Sha256::new),
        };
        source.expect_magic()?;
        Ok(source)
    }

    /// Bytes that are still to be read before the zeros that a file ends with, as far as is known.
    pub(crate) fn remaining(&self) -> u64 {
        self.end.map_or(u64::MAX, |end| end.saturating_sub(self.offset))
    }

    /// Zeros that the file ends with. Those are left by a machine that stopped while it wrote: the
    /// file has the length that it was to get, and not its bytes.
    pub(crate) fn zeros(&self) -> u64 {
        self.size.zip(self.end).map_or(0, |(size, end)| size - end)
    }

    /// Appends the next `length` bytes and returns their number, which is smaller only if a stream
    /// ends before. No file must be asked for more than remain. Memory grows with the bytes that
    /// come.
    pub(crate) fn read(&mut self, length: u64, into: &mut Vec<u8>) -> Result<u64> {
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

    /// Goes on at a later place; the file has no hash then.
    pub(crate) fn skip_to(&mut self, offset: u64) -> Result<()> {
        let sought = self.file.seek(SeekFrom::Start(offset));
        self.offset = sought.map_err(|error| self.io_error(error))?;
        self.hasher = None;
        Ok(())
    }

    /// Says which stretches of the file will be read, in order ([`Input::expect`]).
    pub(crate) fn expect(&mut self, stretches: Vec<Range<u64>>) {
        self.file.get_mut().from.expect(stretches);
    }

    /// What was fetched of it over the network ([`Input::fetched`]).
    pub(crate) fn fetched(&self) -> Option<Fetched> {
        self.file.get_ref().from.fetched()
    }

    /// A number for this state of a remote object ([`Input::object_id`]).
    pub(crate) fn object_id(&self) -> Option<u64> {
        self.file.get_ref().from.object_id()
    }

    /// Bytes that were read of the file.
    pub(crate) fn bytes_read(&self) -> u64 {
        self.file.get_ref().bytes
    }

    /// Reads the rest and returns the SHA-256 of the file in lowercase hexadecimal; `None` if it is
    /// not hashed.
    pub(crate) fn finish(&mut self) -> Result<Option<String>> {
        if self.hasher.is_none() {
            return Ok(None);
        }
        let mut piece = Vec::new();
        self.end = self.size;
        while self.read(self.remaining().min(PIECE as u64), &mut piece)? > 0 {
            piece.clear();
        }
        let digest = self.hasher.take().map(Sha256::finalize);
        Ok(digest.map(|digest| digest.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// An error about what is at `offset`.
    pub(crate) fn damage(&self, offset: u64, damage: Damage) -> Error {
        Error::Damaged { path: self.path.clone(), offset, damage }
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
        if start.is_empty() && self.zeros() > 0 {
            let kind = format!("the file holds nothing but {} zero bytes", self.zeros());
            return Err(self.damage(0, Damage::NotARecording { kind }));
        }
        // Only to tell kinds of file apart, so not hashed.
        let mut more = [0; START_LEN - mcap::MAGIC.len()];
        let length = self.file.read(&mut more).unwrap_or(0);
        start.extend_from_slice(&more[..length]);
        Err(self.damage(0, Damage::NotARecording { kind: not_a_recording(&start) }))
    }
}

/// Where the zeros begin that a file ends with; its size if it ends with none.
fn end_before_zeros(file: &mut dyn Input, size: u64) -> io::Result<u64> {
    let (mut end, mut length) = (size, mcap::MAGIC.len() as u64);
    let mut piece = Vec::new();
    while end > 0 {
        let start = end.saturating_sub(length);
        file.seek(SeekFrom::Start(start))?;
        piece.resize((end - start) as usize, 0);
        file.read_exact(&mut piece)?;
        if let Some(last) = piece.iter().rposition(|&byte| byte != 0) {
            return Ok(start + last as u64 + 1);
        }
        (end, length) = (start, PIECE as u64);
    }
    Ok(0)
}

fn ends_with_magic(file: &mut dyn Input, size: u64) -> io::Result<bool> {
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
    let kind = match path.join("metadata.yaml").exists() {
        true => {
            "is the folder of a rosbag2 recording; `annotate` and `info` take it as it is, other \
             commands want an .mcap file in it"
        }
        false => "is a folder, not an MCAP recording",
    };
    let damage = Damage::NotARecording { kind: kind.to_owned() };
    Error::Damaged { path: path.to_owned(), offset: 0, damage }
}
