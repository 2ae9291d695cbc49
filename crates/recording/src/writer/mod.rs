//! Writing a recording beside its final name, and putting it there when it is whole.

mod ids;
mod options;
mod output;
mod queue;
mod summary;

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::records::{AttachmentHeader, Channel, Header, MessageHeader, Metadata, op};

use self::ids::Ids;
pub use self::options::{WriteOptions, WriteTimes};
use self::output::Output;
use self::queue::{Placement, Queue};
use crate::compression::Compression;
use crate::encode;
use crate::error::Result;
use crate::overview::Overview;
use crate::pack::{OpenChunk, PackedChunk};
use crate::part::{Item, SourceChunk};
use crate::record::{Record, Schema};
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

    /// Writes a record of another recording as it is, ids and times included. Its header, damage
    /// and skipped chunks are left out.
    ///
    /// # Errors
    /// [`Error::ConflictingSchemas`](crate::Error::ConflictingSchemas),
    /// [`Error::ConflictingChannels`](crate::Error::ConflictingChannels),
    /// [`Error::UnknownSchema`](crate::Error::UnknownSchema),
    /// [`Error::UnknownChannel`](crate::Error::UnknownChannel),
    /// [`Error::SchemaIdZero`](crate::Error::SchemaIdZero); [`Error::Io`](crate::Error::Io).
    pub fn copy(&mut self, record: &Record) -> Result<()> {
        match record {
            Record::Header { .. }
            | Record::Skipped { .. }
            | Record::Damaged { .. }
            | Record::Truncated { .. } => Ok(()),
            Record::Schema(schema) => self.copy_schema(schema),
            Record::Channel(channel) => self.copy_channel(channel),
            Record::Message { header, data, .. } => self.write_message(header, data),
            Record::Attachment { header, data } => {
                let record = encode::attachment(header, data);
                let size = data.len() as u64;
                self.push(Placement::Attachment(record, header.clone(), size))
            }
            Record::Metadata(Metadata { name, metadata }) => self.write_metadata(name, metadata),
            Record::Private { opcode, data, in_chunk: true } => {
                self.open.put_record(&encode::plain(*opcode, data));
                Ok(())
            }
            Record::Private { opcode, data, in_chunk: false } => {
                self.push(Placement::Record(encode::plain(*opcode, data)))
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
        self.queue.times.verbatim_bytes += (packed.start.len() + packed.data.len()) as u64;
        self.push(Placement::Verbatim(packed))
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
        let MessageHeader { channel_id, sequence, log_time, .. } = *header;
        if let Some(channel) = self.declared.remove(&channel_id) {
            self.define(&channel)?;
        }
        self.queue.summary.count(channel_id, sequence, 1, (log_time, log_time))?;
        if self.open.len() > CHUNK_SIZE {
            self.close_chunk()?;
        }
        self.open.put_message(header, data);
        Ok(())
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
        self.copy(&Record::Attachment { header, data: data.into() })
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
        let placement = match self.take_offered(&chunk) {
            Some(packed) => Placement::Verbatim(packed),
            None => Placement::Packing(self.queue.workers.run(move || chunk.pack(compression))),
        };
        self.queue.push(placement)
    }

    /// The chunk with these records, if it was offered. Those before it are of no use any more. If
    /// none has them, all but the last are of no use; messages of the last may still come.
    fn take_offered(&mut self, chunk: &OpenChunk) -> Option<PackedChunk> {
        let name = self.compression.name();
        let is_same = |offered: &Arc<SourceChunk>| {
            offered.compression() == name && offered.records() == Some(chunk.records())
        };
        let found = self.offered.iter().position(is_same);
        let used = found.map_or(self.offered.len().saturating_sub(1), |found| found + 1);
        let last = self.offered.drain(..used).next_back();
        found.and(last).map(|chunk| chunk.verbatim())
    }

    /// Closes the current chunk and queues something behind it.
    fn push(&mut self, placement: Placement) -> Result<()> {
        self.close_chunk()?;
        self.queue.push(placement)
    }
}
