//! An attachment, read piece by piece.

use std::borrow::Cow;

use crc32fast::Hasher;
use mcap::records::{AttachmentHeader, op};

use super::ahead::Piece;
use crate::damage::Damage;
use crate::fields::{Fields, HEAD_LEN};
use crate::names::record_name;
use crate::record::Record;

/// Bytes of the checksum behind the attached file.
const CRC_LEN: usize = 4;

const UNREADABLE: Damage = Damage::Unreadable { record: record_name(op::ATTACHMENT) };

/// An attachment of which some has been read.
pub(super) struct Attachment {
    header: AttachmentHeader,
    /// Bytes of the attached file.
    size: u64,
    /// Those of them that have been read.
    read: u64,
    /// Checksum of what has been read.
    crc: Hasher,
    /// What is there of the checksum in the file.
    stored: Vec<u8>,
}

impl Attachment {
    /// Takes a piece of a record, all of them in their order. Behind the last the checksum is
    /// checked.
    ///
    /// # Errors
    /// [`Damage::Unreadable`], also if the names do not fit into the first piece; a wrong checksum.
    pub(super) fn take(open: &mut Option<Self>, piece: &Piece) -> Result<Record<'static>, Damage> {
        let (mut attachment, bytes) = match open.take() {
            Some(attachment) => (attachment, &*piece.bytes),
            None => Attachment::begin(&piece.bytes[HEAD_LEN..]).ok_or(UNREADABLE)?,
        };
        let record = attachment.take_data(bytes);
        if piece.is_last {
            attachment.check()?;
        } else {
            *open = Some(attachment);
        }
        Ok(record)
    }

    /// The attachment whose record has this content, and the content behind its header.
    fn begin(body: &[u8]) -> Option<(Self, &[u8])> {
        let mut fields = Fields(body);
        let header = AttachmentHeader {
            log_time: fields.u64()?,
            create_time: fields.u64()?,
            name: fields.str()?.to_owned(),
            media_type: fields.str()?.to_owned(),
        };
        let size = fields.u64()?;
        let mut crc = Hasher::new();
        crc.update(&body[..body.len() - fields.0.len()]);
        Some((Attachment { header, size, read: 0, crc, stored: Vec::new() }, fields.0))
    }

    fn take_data(&mut self, bytes: &[u8]) -> Record<'static> {
        let left = usize::try_from(self.size - self.read).unwrap_or(usize::MAX);
        let (data, behind) = bytes.split_at(bytes.len().min(left));
        let start = self.read;
        self.crc.update(data);
        self.read += data.len() as u64;
        let wanted = CRC_LEN - self.stored.len();
        self.stored.extend_from_slice(&behind[..behind.len().min(wanted)]);
        let (header, size, data) = (self.header.clone(), self.size, Cow::Owned(data.to_vec()));
        Record::Attachment { header, size, start, data }
    }

    fn check(&self) -> Result<(), Damage> {
        let stored = Fields(&self.stored).u32().ok_or(UNREADABLE)?;
        let name = format!("attachment `{}`:", self.header.name);
        Damage::check(&name, stored, self.crc.clone().finalize())
    }
}
