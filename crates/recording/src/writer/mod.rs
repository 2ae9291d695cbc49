//! Writing a recording beside its final name, and putting it there when it is whole.

mod attachment;
mod copy;
mod ids;
mod options;
mod output;
mod queue;
mod summary;

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::records::{AttachmentHeader, Channel, Header, MessageHeader, Metadata, op};

use self::attachment::Attachment;
use self::ids::Ids;
pub use self::options::{WriteOptions, WriteTimes};
use self::output::Output;
use self::queue::{Placement, Queue};
use crate::compression::Compression;
use crate::encode;
use crate::error::Result;
use crate::overview::Overview;
use crate::pack::{LARGE_MESSAGE, OpenChunk, PackedChunk};
use crate::part::SourceChunk;
use crate::record::Schema;
use crate::shared_bytes::SharedBytes;
use crate::workers::Workers;

/// Uncompressed bytes after which a chunk is closed.
const CHUNK_SIZE: u64 = 4 << 20;

/// A recording being written. Until [`RecordingWriter::finish`] it has a temporary name in the
/// folder of the output (`.NAME.partial`), and is removed if it is never finished.
///
/// Records go into chunks as they come. A chunk that is full is compressed by the [`Workers`], and
/// placed in the file when its turn has come. Which records share a chunk depends on their bytes
/// and order alone, so the file is the same on any number of threads.
pub struct RecordingWriter {
    queue: Queue,
    compression: Compression,
    open: OpenChunk,
    ids: Ids,
    /// Channels that are written before their first message, or at the end.
    declared: BTreeMap<u16, Channel>,
    /// Chunks of other recordings with the messages that are being written, in their order.
    offered: VecDeque<Arc<SourceChunk>>,
    /// The attachment of which more pieces are to come.
    attachment: Option<Attachment>,
}

impl RecordingWriter {
    /// Starts a recording that will be `output`, or goes to standard output as it is made
    /// ([`STANDARD_STREAM`](crate::STANDARD_STREAM)).
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io) if the folder cannot be written to, or if the output exists
    /// and may not be replaced.
    pub fn create(output: &Path, options: &WriteOptions) -> Result<Self> {
        let mut queue = Queue::new(Output::create(output, options.force)?);
        let header = Header { profile: options.profile.clone(), library: options.library() };
        queue.write(&[mcap::MAGIC, &encode::record(op::HEADER, &header)])?;
        Ok(RecordingWriter {
            queue,
            compression: options.compression,
            open: OpenChunk::default(),
            ids: Ids::default(),
            declared: BTreeMap::new(),
            offered: VecDeque::new(),
            attachment: None,
        })
    }

    /// Lets chunks be compressed by these threads. The bytes of the file are the same without.
    pub fn compress_on(&mut self, workers: &Workers) {
        self.queue.workers = workers.clone();
    }

    /// What writing took so far.
    pub fn times(&self) -> WriteTimes {
        self.queue.times
    }

    /// Keeps the ids of a recording that is going to be copied away from what
    /// [`RecordingWriter::add_schema`] and [`RecordingWriter::add_channel`] give out.
    pub fn reserve(&mut self, overview: &Overview) {
        self.ids.reserve(overview);
    }

    /// Gives out the highest ids first, for a copy of a recording whose ids are not known yet. It
    /// is not likely to have them. If it does, copying its definition of one is an error.
    pub fn reserve_all_but_the_highest(&mut self) {
        self.ids.start_at_the_top();
    }

    /// Compresses chunks that are closed from now on like this.
    pub fn set_compression(&mut self, compression: Compression) {
        self.compression = compression;
    }

    /// Adds a schema and returns its id: that of an equal one if there is one, else a new one.
    ///
    /// # Errors
    /// [`Error::TooManySchemas`](crate::Error::TooManySchemas), [`Error::Io`](crate::Error::Io).
    pub fn add_schema(&mut self, name: &str, encoding: &str, data: &[u8]) -> Result<u16> {
        let id = self.ids.schema(name, encoding, data)?;
        self.copy_schema(&self.ids.schemas[&id].clone())?;
        Ok(id)
    }

    /// Adds a channel under a new id, which is returned. `schema_id` is 0 for none, or must have
    /// been returned by [`RecordingWriter::add_schema`].
    ///
    /// # Errors
    /// [`Error::UnknownSchema`](crate::Error::UnknownSchema),
    /// [`Error::TooManyChannels`](crate::Error::TooManyChannels), [`Error::Io`](crate::Error::Io).
    pub fn add_channel(
        &mut self,
        topic: &str,
        schema_id: u16,
        message_encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<u16> {
        let channel = self.ids.channel(topic, schema_id, message_encoding, metadata)?;
        self.copy_channel(&channel)?;
        Ok(channel.id)
    }

    /// Adds a schema (name, encoding and definition) and a channel of it as
    /// [`RecordingWriter::add_channel`] does, but leaves both to be written before the channel's
    /// first message, or by [`RecordingWriter::write_declared`].
    ///
    /// # Errors
    /// [`Error::TooManySchemas`](crate::Error::TooManySchemas),
    /// [`Error::TooManyChannels`](crate::Error::TooManyChannels).
    pub fn declare_channel(
        &mut self,
        topic: &str,
        (name, encoding, data): (&str, &str, &[u8]),
        message_encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<u16> {
        let schema_id = self.ids.schema(name, encoding, data)?;
        let channel = self.ids.channel(topic, schema_id, message_encoding, metadata)?;
        let id = channel.id;
        self.declared.insert(id, channel);
        Ok(id)
    }

    /// Leaves a channel of a recording whose ids are kept ([`RecordingWriter::reserve`]) to be
    /// written before its first message, if it has one.
    pub fn declare(&mut self, channel: Channel) {
        self.ids.take_channel(channel.id);
        self.declared.insert(channel.id, channel);
    }

    /// Writes the channels that were declared and have no message yet.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::copy`].
    pub fn write_declared(&mut self) -> Result<()> {
        for channel in std::mem::take(&mut self.declared).into_values() {
            self.define(&channel)?;
        }
        Ok(())
    }

    /// Closes the current chunk, so that what follows stands in chunks of its own.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    pub fn end_chunk(&mut self) -> Result<()> {
        self.close_chunk()
    }

    /// Offers a chunk that holds the next message that is written. If the chunk that is closed has
    /// the same records, the offered one is placed instead of compressing them once more.
    pub fn offer(&mut self, chunk: &Arc<SourceChunk>) {
        if !self.offered.back().is_some_and(|last| Arc::ptr_eq(last, chunk)) {
            self.offered.push_back(Arc::clone(chunk));
        }
    }

    /// Writes a message to a channel that was added or copied.
    ///
    /// # Errors
    /// [`Error::UnknownChannel`](crate::Error::UnknownChannel), [`Error::Io`](crate::Error::Io).
    pub fn write_message(&mut self, header: &MessageHeader, data: &[u8]) -> Result<()> {
        if data.len() > LARGE_MESSAGE {
            return self.write_large(header, data.to_vec().into());
        }
        self.count_message(header)?;
        if self.open.len() > CHUNK_SIZE {
            self.close_chunk()?;
        }
        self.open.put_message(header, data);
        Ok(())
    }

    /// As [`RecordingWriter::write_message`], without copying a message of more than 32 MiB in
    /// memory. Such a message gets a chunk of its own, which is compressed only if that makes it
    /// eight times smaller.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::write_message`].
    pub fn write_shared(&mut self, header: &MessageHeader, data: SharedBytes) -> Result<()> {
        match data.len() > LARGE_MESSAGE {
            true => self.write_large(header, data),
            false => self.write_message(header, &data),
        }
    }

    fn write_large(&mut self, header: &MessageHeader, data: SharedBytes) -> Result<()> {
        self.close_chunk()?;
        self.count_message(header)?;
        self.open.put_large_message(header, data);
        self.close_chunk()
    }

    /// Counts a message, and writes its channel if that was only declared.
    fn count_message(&mut self, header: &MessageHeader) -> Result<()> {
        let MessageHeader { channel_id, sequence, log_time, .. } = *header;
        if let Some(channel) = self.declared.remove(&channel_id) {
            self.define(&channel)?;
        }
        self.queue.summary.count(channel_id, sequence, 1, (log_time, log_time))
    }

    /// Writes a metadata record. This closes the current chunk.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    pub fn write_metadata(
        &mut self,
        name: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<()> {
        let metadata = Metadata { name: name.to_owned(), metadata: metadata.clone() };
        let record = encode::record(op::METADATA, &metadata);
        self.push(Placement::Metadata(record, metadata.name))
    }

    /// Attaches a file, logged and created at a time in nanoseconds since 1970. This closes the
    /// current chunk.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    pub fn attach(&mut self, name: &str, media_type: &str, time: u64, data: &[u8]) -> Result<()> {
        let header = AttachmentHeader {
            log_time: time,
            create_time: time,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
        };
        self.write_attachment(&header, data.len() as u64, 0, data)
    }

    /// Leaves the half-written file under its temporary name, which is returned. Chunks that are
    /// not placed yet are lost.
    pub fn leave(self) -> PathBuf {
        self.queue.leave()
    }

    /// Completes the recording, makes sure that it is on the disk, gives it its name, and returns
    /// its size in bytes.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io), also if the output exists by now and may not be replaced.
    /// The temporary file is then removed.
    pub fn finish(self) -> Result<u64> {
        self.finish_timed().map(|(size, _)| size)
    }

    /// As [`RecordingWriter::finish`], and says what writing took.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::finish`].
    pub fn finish_timed(mut self) -> Result<(u64, WriteTimes)> {
        self.close_chunk()?;
        self.require_no_attachment()?;
        self.queue.finish()
    }

    /// Writes a channel, and its schema before it.
    fn define(&mut self, channel: &Channel) -> Result<()> {
        if let Some(schema) = self.ids.schemas.get(&channel.schema_id).cloned() {
            self.copy_schema(&schema)?;
        }
        self.copy_channel(channel)
    }

    fn copy_schema(&mut self, schema: &Schema) -> Result<()> {
        if self.define_schema(schema)? {
            self.open.put_record(&encode::schema(schema));
        }
        Ok(())
    }

    fn copy_channel(&mut self, channel: &Channel) -> Result<()> {
        if self.define_channel(channel)? {
            self.open.put_record(&encode::record(op::CHANNEL, channel));
        }
        Ok(())
    }

    /// Notes a schema that is in the file; whether it is new.
    fn define_schema(&mut self, schema: &Schema) -> Result<bool> {
        let is_new = self.queue.summary.define_schema(schema)?;
        self.ids.take_schema(schema);
        Ok(is_new)
    }

    /// Notes a channel that is in the file; whether it is new.
    fn define_channel(&mut self, channel: &Channel) -> Result<bool> {
        let is_new = self.queue.summary.define_channel(channel)?;
        self.ids.take_channel(channel.id);
        Ok(is_new)
    }

    fn close_chunk(&mut self) -> Result<()> {
        if self.open.len() == 0 {
            return Ok(());
        }
        let (chunk, compression) = (std::mem::take(&mut self.open), self.compression);
        self.require_no_attachment()?;
        if let Some(packed) = self.take_offered(&chunk) {
            return self.queue.push(Placement::Verbatim(packed));
        }
        let is_large = chunk.records().is_none();
        let packing = Placement::Packing(self.queue.workers.run(move || chunk.pack(compression)));
        match is_large {
            true => self.queue.push_large(packing),
            false => self.queue.push(packing),
        }
    }

    /// The chunk with these records, if it was offered. Those before it are of no use any more. If
    /// none has them, all but the last are of no use; messages of the last may still come.
    fn take_offered(&mut self, chunk: &OpenChunk) -> Option<PackedChunk> {
        let name = self.compression.name();
        let is_same = |offered: &Arc<SourceChunk>| {
            offered.compression() == name
                && chunk.records().is_some_and(|records| offered.records() == Some(records))
        };
        let found = self.offered.iter().position(is_same);
        let used = found.map_or(self.offered.len().saturating_sub(1), |found| found + 1);
        let last = self.offered.drain(..used).next_back();
        found.and(last).map(|chunk| chunk.verbatim())
    }

    /// Closes the current chunk and queues something behind it.
    fn push(&mut self, placement: Placement) -> Result<()> {
        self.close_chunk()?;
        self.require_no_attachment()?;
        self.queue.push(placement)
    }

    fn require_no_attachment(&self) -> Result<()> {
        self.attachment.as_ref().map_or(Ok(()), |attachment| Err(attachment.incomplete()))
    }
}
