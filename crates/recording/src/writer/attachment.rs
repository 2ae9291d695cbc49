//! An attachment, written piece by piece.

use crc32fast::Hasher;
use mcap::records::{AttachmentHeader, op};

use super::queue::Placement;
use crate::encode;
use crate::error::{Error, Result};
use crate::fields::head;

/// An attachment of which some has been written.
pub(super) struct Attachment {
    name: String,
    /// Bytes of the attached file.
    size: u64,
    /// Those of them that have been written.
    written: u64,
    crc: Hasher,
}

impl Attachment {
    /// An attachment of which nothing has been written, and what its record begins with.
    pub(super) fn begin(header: &AttachmentHeader, size: u64) -> (Self, Placement) {
        let content = [encode::bytes(header).as_slice(), &size.to_le_bytes()].concat();
        let mut crc = Hasher::new();
        crc.update(&content);
        let length = content.len() as u64 + size + size_of::<u32>() as u64;
        let start = [&head(op::ATTACHMENT, length), content.as_slice()].concat();
        let attachment = Attachment { name: header.name.clone(), size, written: 0, crc };
        (attachment, Placement::Attachment(start, header.clone(), size))
    }

    /// Takes the next piece, which begins at a byte of the attached file. Returns what is to be
    /// written, and whether that is the last.
    ///
    /// # Errors
    /// [`Error::AttachmentPieces`] if another piece should come.
    pub(super) fn take(&mut self, start: u64, data: &[u8]) -> Result<(Vec<u8>, bool)> {
        let end = start + data.len() as u64;
        if start != self.written || end > self.size {
            return Err(self.incomplete());
        }
        self.written = end;
        self.crc.update(data);
        let is_last = end == self.size;
        let crc = self.crc.clone().finalize().to_le_bytes();
        Ok(([data, if is_last { &crc } else { &[] }].concat(), is_last))
    }

    /// The error that something else comes before the rest.
    pub(super) fn incomplete(&self) -> Error {
        let Attachment { name, size, written, .. } = self;
        Error::AttachmentPieces { name: name.clone(), written: *written, size: *size }
    }
}
