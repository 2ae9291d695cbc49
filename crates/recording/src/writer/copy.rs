//! Copying what another recording holds.

use mcap::records::{AttachmentHeader, Metadata};

use super::RecordingWriter;
use super::attachment::Attachment;
use super::queue::Placement;
use crate::encode;
use crate::error::{Error, Result};
use crate::part::{Item, SourceChunk};
use crate::record::Record;

impl RecordingWriter {
    /// Writes a record of another recording as it is, ids and times included. Its header, damage
    /// and skipped chunks are left out.
    ///
    /// # Errors
    /// [`Error::ConflictingSchemas`](crate::Error::ConflictingSchemas),
    /// [`Error::ConflictingChannels`](crate::Error::ConflictingChannels),
    /// [`Error::UnknownSchema`](crate::Error::UnknownSchema),
    /// [`Error::UnknownChannel`](crate::Error::UnknownChannel),
    /// [`Error::SchemaIdZero`](crate::Error::SchemaIdZero),
    /// [`Error::AttachmentPieces`](crate::Error::AttachmentPieces);
    /// [`Error::Io`](crate::Error::Io).
    pub fn copy(&mut self, record: &Record) -> Result<()> {
        match record {
            Record::Header { .. }
            | Record::Skipped { .. }
            | Record::Damaged { .. }
            | Record::Truncated { .. } => Ok(()),
            Record::Schema(schema) => self.copy_schema(schema),
            Record::Channel(channel) => self.copy_channel(channel),
            Record::Message { header, data, .. } => self.write_message(header, data),
            Record::Attachment { header, size, start, data } => {
                self.write_attachment(header, *size, *start, data)
            }
            Record::Metadata(Metadata { name, metadata }) => self.write_metadata(name, metadata),
            Record::Private { opcode, data, in_chunk: true } => {
                self.open.put_record(&encode::plain(*opcode, data));
                Ok(())
            }
            Record::Private { opcode, data, in_chunk: false } => {
                self.push(Placement::Bytes(encode::plain(*opcode, data)))
            }
        }
    }

    /// Places a chunk of another recording as it lies there, with indexes of its messages behind
    /// it. The definitions in it count as copied. This closes the current chunk.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::copy`] for the records in it.
    pub fn copy_chunk(&mut self, chunk: &SourceChunk) -> Result<()> {
        for item in &chunk.items {
            match item {
                Item::Record(Record::Schema(schema)) => self.define_schema(schema).map(drop)?,
                Item::Record(Record::Channel(channel)) => self.define_channel(channel).map(drop)?,
                Item::Message { .. } | Item::Record(_) => {}
            }
        }
        for (channel, count) in chunk.counts() {
            self.queue.summary.count(channel, 0, count, chunk.times())?;
        }
        let packed = chunk.verbatim();
        self.queue.times.verbatim_chunks += 1;
        self.queue.times.verbatim_bytes += packed.len();
        self.push(Placement::Verbatim(packed))
    }

    /// Writes a piece of an attached file of this size.
    pub(super) fn write_attachment(
        &mut self,
        header: &AttachmentHeader,
        size: u64,
        start: u64,
        data: &[u8],
    ) -> Result<()> {
        if start == 0 {
            let (attachment, begins) = Attachment::begin(header, size);
            self.push(begins)?;
            self.attachment = Some(attachment);
        }
        let Some(attachment) = &mut self.attachment else {
            let (name, written) = (header.name.clone(), 0);
            return Err(Error::AttachmentPieces { name, written, size });
        };
        let (bytes, is_last) = attachment.take(start, data)?;
        if is_last {
            self.attachment = None;
        }
        self.queue.push(Placement::Bytes(bytes))
    }
}
