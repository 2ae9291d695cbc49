//! Writing a recording beside its final name, and putting it there when it is whole.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use mcap::records::{
    AttachmentHeader, AttachmentIndex, Channel, Header, MessageHeader, Metadata, MetadataIndex, op,
};
use serde::Serialize;

use crate::address::STANDARD_STREAM;
use crate::compression::Compression;
use crate::encode;
use crate::error::{Error, Result};
use crate::overview::Overview;
use crate::pack::{OpenChunk, PackedChunk};
use crate::part::{Item, SourceChunk};
use crate::partial::PartialFile;
use crate::record::{Record, Schema};
use crate::stopwatch::Steps;
use crate::tail::Summary;
use crate::workers::{Ticket, Workers};

/// Uncompressed bytes after which a chunk is closed.
const CHUNK_SIZE: u64 = 4 << 20;

/// How to write a recording.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct WriteOptions {
    /// Profile of the header, such as `ros2`. Default: none.
    pub profile: String,
    /// Library that wrote the input, named in the output's header. Default: none.
    pub recorded_by: String,
    /// Compression of the chunks. Default: Zstandard.
    pub compression: Compression,
    /// Whether a file of the output's name may be replaced. Default: no.
    pub force: bool,
}

/// What writing took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct WriteTimes {
    /// Compressing chunks; bytes before it.
    pub compress: Steps,
    /// Bytes of those chunks behind it.
    pub compressed_bytes: u64,
    /// Chunks of the source that were placed as they are.
    pub verbatim_chunks: u64,
    /// Bytes of those, as they lie in the file.
    pub verbatim_bytes: u64,
    /// Handing bytes to the system, and at the end to the disk.
    pub write: Steps,
    /// Waiting for chunks to be compressed.
    pub wait: Steps,
}

/// A recording being written. Until [`RecordingWriter::finish`] it has a temporary name in the
/// output's folder (`.NAME.partial`), and is removed if it is never finished.
///
/// Records go into chunks as they come; a chunk that is full is compressed by the [`Workers`], and
/// placed in the file when its turn has come. Which records share a chunk depends on their bytes
/// and order alone, so the file does too, however many threads there are.
pub struct RecordingWriter {
    sink: Sink,
    output: PathBuf,
    compression: Compression,
    workers: Workers,
    open: OpenChunk,
    /// What is to follow in the file, in its order.
    queue: VecDeque<Placement>,
    /// Bytes in the file.
    offset: u64,
    /// Checksum of those.
    crc: crc32fast::Hasher,
    summary: Summary,
    schemas: BTreeMap<u16, Schema>,
    channel_ids: BTreeSet<u16>,
    /// Channels that are written before their first message, or at the end.
    declared: BTreeMap<u16, Channel>,
    /// Chunks that others made of the messages that are being written, in their order.
    offered: VecDeque<Arc<SourceChunk>>,
    /// Whether new ids are the highest that are free, else the one behind the highest that is
    /// taken.
    ids_from_the_top: bool,
    times: WriteTimes,
}

/// Where the bytes go.
enum Sink {
    // The name behind the file, so that it is closed before it is removed.
    File(File, PartialFile),
    StandardOutput(io::Stdout),
}

impl Sink {
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self {
            Sink::File(file, _) => file.write_all(bytes),
            Sink::StandardOutput(output) => output.write_all(bytes),
        }
    }

    /// Makes sure that everything is where it belongs.
    fn sync(&mut self) -> io::Result<()> {
        match self {
            Sink::File(file, _) => file.sync_all(),
            Sink::StandardOutput(output) => output.flush(),
        }
    }

    /// Gives a file its name.
    fn close(self) -> Result<()> {
        match self {
            Sink::File(file, partial) => {
                drop(file);
                partial.put()
            }
            Sink::StandardOutput(_) => Ok(()),
        }
    }
}

/// Something with a place in the file.
enum Placement {
    Packing(Ticket<io::Result<PackedChunk>>),
    Verbatim(PackedChunk),
    Record(Vec<u8>),
    Attachment(Vec<u8>, AttachmentHeader, u64),
    Metadata(Vec<u8>, String),
}

impl Placement {
    fn is_ready(&mut self) -> bool {
        match self {
            Placement::Packing(chunk) => chunk.is_ready(),
            _ => true,
        }
    }
}

impl RecordingWriter {
    /// Starts a recording that will be `output`, or goes to standard output as it is made
    /// ([`STANDARD_STREAM`]).
    ///
    /// # Errors
    /// [`Error::Io`] if the folder cannot be written to, or if the output exists and may not be
    /// replaced.
    pub fn create(output: &Path, options: &WriteOptions) -> Result<Self> {
        let sink = match output == STANDARD_STREAM {
            true => Sink::StandardOutput(io::stdout()),
            false => {
                let (file, partial) = PartialFile::create(output, options.force)?;
                Sink::File(file, partial)
            }
        };
        let library = match options.recorded_by.as_str() {
            "" => concat!("divmerge ", env!("CARGO_PKG_VERSION")).to_owned(),
            by => format!("divmerge {} (recorded by {by})", env!("CARGO_PKG_VERSION")),
        };
        let header = Header { profile: options.profile.clone(), library };
        let mut writer = RecordingWriter {
            sink,
            output: output.to_owned(),
            compression: options.compression,
            workers: Workers::none(),
            open: OpenChunk::default(),
            queue: VecDeque::new(),
            offset: 0,
            crc: crc32fast::Hasher::new(),
            summary: Summary::default(),
            schemas: BTreeMap::new(),
            channel_ids: BTreeSet::new(),
            declared: BTreeMap::new(),
            offered: VecDeque::new(),
            ids_from_the_top: false,
            times: WriteTimes::default(),
        };
        writer.place(&[mcap::MAGIC, &encode::record(op::HEADER, &header)])?;
        Ok(writer)
    }

    /// Lets chunks be compressed by these threads. The bytes of the file are the same without.
    pub fn compress_on(&mut self, workers: &Workers) {
        self.workers = workers.clone();
    }

    /// What writing took so far.
    pub fn times(&self) -> WriteTimes {
        self.times
    }

    /// Keeps the ids of a recording that is going to be copied away from what
    /// [`RecordingWriter::add_schema`] and [`RecordingWriter::add_channel`] hand out.
    pub fn reserve(&mut self, overview: &Overview) {
        let schemas = overview.schemas.iter();
        self.schemas.extend(schemas.map(|(&id, schema)| (id, schema.clone())));
        self.channel_ids.extend(overview.channels.keys());
    }

    /// Hands out the highest ids, which the recording to be copied is not likely to have: for one
    /// whose ids are not known beforehand. Should it have one of them after all, that is an error
    /// when its turn comes.
    pub fn reserve_all_but_the_highest(&mut self) {
        self.ids_from_the_top = true;
    }

    /// Writes a record of another recording as it is, ids and times included. Its header, what
    /// tells of damage, and what was passed over are left out.
    ///
    /// # Errors
    /// [`Error::ConflictingSchemas`], [`Error::ConflictingChannels`], [`Error::UnknownSchema`],
    /// [`Error::UnknownChannel`], [`Error::SchemaIdZero`]; [`Error::Io`].
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
                self.queue_behind_chunk(Placement::Attachment(record, header.clone(), size))
            }
            Record::Metadata(Metadata { name, metadata }) => self.write_metadata(name, metadata),
            Record::Private { opcode, data, in_chunk: true } => {
                self.open.put_record(&encode::plain(*opcode, data));
                Ok(())
            }
            Record::Private { opcode, data, in_chunk: false } => {
                self.queue_behind_chunk(Placement::Record(encode::plain(*opcode, data)))
            }
        }
    }

    /// Places a chunk of another recording as it lies there, with indexes of its messages behind
    /// it. What it defines is taken as copied. This closes the current chunk.
    ///
    /// # Errors
    /// As [`RecordingWriter::copy`] for the records in it.
    pub fn copy_chunk(&mut self, chunk: &SourceChunk) -> Result<()> {
        for item in &chunk.items {
            match item {
                Item::Record(Record::Schema(schema)) => self.define_schema(schema).map(drop)?,
                Item::Record(Record::Channel(channel)) => self.define_channel(channel).map(drop)?,
                Item::Message { .. } | Item::Record(_) => {}
            }
        }
        for (channel, count) in chunk.counts() {
            self.require(channel, 0)?;
            self.summary.count(channel, count, chunk.times());
        }
        self.times.verbatim_chunks += 1;
        let packed = chunk.verbatim();
        self.times.verbatim_bytes += (packed.start.len() + packed.data.len()) as u64;
        self.queue_behind_chunk(Placement::Verbatim(packed))
    }

    /// Compresses chunks that are closed from now on like this.
    pub fn set_compression(&mut self, compression: Compression) {
        self.compression = compression;
    }

    /// Adds a schema and returns its id: that of an equal one if there is one, else a new one.
    ///
    /// # Errors
    /// [`Error::TooManySchemas`], [`Error::Io`].
    pub fn add_schema(&mut self, name: &str, encoding: &str, data: &[u8]) -> Result<u16> {
        let id = self.reserve_schema(name, encoding, data)?;
        let schema = self.schemas[&id].clone();
        self.copy_schema(&schema)?;
        Ok(id)
    }

    /// The id that a schema has or will have.
    fn reserve_schema(&mut self, name: &str, encoding: &str, data: &[u8]) -> Result<u16> {
        let equal = |schema: &&Schema| {
            (schema.name.as_str(), schema.encoding.as_str()) == (name, encoding)
                && schema.data == data
        };
        if let Some(schema) = self.schemas.values().find(equal) {
            return Ok(schema.id);
        }
        let last = self.schemas.last_key_value().map(|(&id, _)| id);
        let id =
            self.free_id(last, |id| self.schemas.contains_key(&id)).ok_or(Error::TooManySchemas)?;
        let (name, encoding, data) = (name.to_owned(), encoding.to_owned(), data.to_vec());
        self.schemas.insert(id, Schema { id, name, encoding, data });
        Ok(id)
    }

    /// Adds a channel under a new id, which is returned. `schema_id` is 0 for none, or must have
    /// been returned by [`RecordingWriter::add_schema`].
    ///
    /// # Errors
    /// [`Error::UnknownSchema`], [`Error::TooManyChannels`], [`Error::Io`].
    pub fn add_channel(
        &mut self,
        topic: &str,
        schema_id: u16,
        message_encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<u16> {
        let channel = self.new_channel(topic, schema_id, message_encoding, metadata)?;
        self.copy_channel(&channel)?;
        Ok(channel.id)
    }

    /// Adds a schema (name, encoding and definition) and a channel of it as
    /// [`RecordingWriter::add_channel`] does, but leaves both to be written before the channel's
    /// first message, or by [`RecordingWriter::write_declared`].
    ///
    /// # Errors
    /// [`Error::TooManySchemas`], [`Error::TooManyChannels`].
    pub fn declare_channel(
        &mut self,
        topic: &str,
        (name, encoding, data): (&str, &str, &[u8]),
        message_encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<u16> {
        let schema_id = self.reserve_schema(name, encoding, data)?;
        let channel = self.new_channel(topic, schema_id, message_encoding, metadata)?;
        let id = channel.id;
        self.declare(channel);
        Ok(id)
    }

    /// Leaves a channel of a recording whose ids are kept ([`RecordingWriter::reserve`]) to be
    /// written before its first message, if it has one.
    pub fn declare(&mut self, channel: Channel) {
        self.channel_ids.insert(channel.id);
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

    /// Writes a channel, and its schema before it.
    fn define(&mut self, channel: &Channel) -> Result<()> {
        if let Some(schema) = self.schemas.get(&channel.schema_id).cloned() {
            self.copy_schema(&schema)?;
        }
        self.copy_channel(channel)
    }

    fn new_channel(
        &mut self,
        topic: &str,
        schema_id: u16,
        message_encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<Channel> {
        let id = self
            .free_id(self.channel_ids.last().copied(), |id| self.channel_ids.contains(&id))
            .ok_or(Error::TooManyChannels)?;
        self.channel_ids.insert(id);
        Ok(Channel {
            id,
            schema_id,
            topic: topic.to_owned(),
            message_encoding: message_encoding.to_owned(),
            metadata: metadata.clone(),
        })
    }

    /// Closes the current chunk, so that what follows stands in chunks of its own.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn end_chunk(&mut self) -> Result<()> {
        self.close_chunk()
    }

    /// Offers a chunk that holds the next message that is written: if the chunk that comes to be
    /// has the same records, it is taken as it is instead of being compressed once more.
    pub fn offer(&mut self, chunk: &Arc<SourceChunk>) {
        if !self.offered.back().is_some_and(|last| Arc::ptr_eq(last, chunk)) {
            self.offered.push_back(Arc::clone(chunk));
        }
    }

    /// Writes a message to a channel that was added or copied.
    ///
    /// # Errors
    /// [`Error::UnknownChannel`], [`Error::Io`].
    pub fn write_message(&mut self, header: &MessageHeader, data: &[u8]) -> Result<()> {
        if let Some(channel) = self.declared.remove(&header.channel_id) {
            self.define(&channel)?;
        }
        self.require(header.channel_id, header.sequence)?;
        self.summary.count(header.channel_id, 1, (header.log_time, header.log_time));
        if self.open.len() > CHUNK_SIZE {
            self.close_chunk()?;
        }
        self.open.put_message(header, data);
        Ok(())
    }

    /// Writes a metadata record. This closes the current chunk.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write_metadata(
        &mut self,
        name: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<()> {
        let metadata = Metadata { name: name.to_owned(), metadata: metadata.clone() };
        let record = encode::record(op::METADATA, &metadata);
        self.queue_behind_chunk(Placement::Metadata(record, metadata.name))
    }

    /// Attaches a file, logged and created at a time in nanoseconds since 1970. This closes the
    /// current chunk.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn attach(&mut self, name: &str, media_type: &str, time: u64, data: &[u8]) -> Result<()> {
        let header = AttachmentHeader {
            log_time: time,
            create_time: time,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
        };
        self.copy(&Record::Attachment { header, data: data.into() })
    }

    /// Leaves the half written file under its temporary name, which is returned, without what is
    /// not placed yet.
    pub fn leave(self) -> PathBuf {
        match self.sink {
            Sink::File(_, partial) => partial.leave(),
            Sink::StandardOutput(_) => self.output,
        }
    }

    /// Completes the recording, makes sure that it is on the disk, gives it its name, and returns
    /// its size in bytes.
    ///
    /// # Errors
    /// [`Error::Io`], also if the output exists by now and may not be replaced. The temporary file
    /// is then removed.
    pub fn finish(self) -> Result<u64> {
        self.finish_timed().map(|(size, _)| size)
    }

    /// As [`RecordingWriter::finish`], and says what writing took.
    ///
    /// # Errors
    /// Those of [`RecordingWriter::finish`].
    pub fn finish_timed(mut self) -> Result<(u64, WriteTimes)> {
        self.close_chunk()?;
        self.place_all_but(0)?;
        let crc = std::mem::take(&mut self.crc).finalize();
        let end = std::mem::take(&mut self.summary).close(self.offset, crc);
        self.place(&[&end])?;
        let started = Instant::now();
        self.sink.sync().map_err(Error::io(&self.output))?;
        self.times.write.take_since(started, 0);
        let RecordingWriter { sink, offset, times, .. } = self;
        sink.close()?;
        Ok((offset, times))
    }

    /// The id behind the last, or else the first free one; or the highest free one.
    fn free_id(&self, last: Option<u16>, is_taken: impl Fn(u16) -> bool) -> Option<u16> {
        let is_free = |id: &u16| !is_taken(*id);
        match self.ids_from_the_top {
            true => (1..=u16::MAX).rev().find(is_free),
            false => last.unwrap_or(0).checked_add(1).or_else(|| (1..=u16::MAX).find(is_free)),
        }
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

    /// Notes a schema; whether it is new.
    fn define_schema(&mut self, schema: &Schema) -> Result<bool> {
        if schema.id == 0 {
            return Err(Error::SchemaIdZero);
        }
        match self.summary.schemas.get(&schema.id) {
            Some(known) if known == schema => return Ok(false),
            Some(_) => return Err(Error::ConflictingSchemas { name: schema.name.clone() }),
            None => {}
        }
        self.schemas.entry(schema.id).or_insert_with(|| schema.clone());
        self.summary.schemas.insert(schema.id, schema.clone());
        Ok(true)
    }

    /// Notes a channel; whether it is new.
    fn define_channel(&mut self, channel: &Channel) -> Result<bool> {
        let topic = || channel.topic.clone();
        if channel.schema_id != 0 && !self.summary.schemas.contains_key(&channel.schema_id) {
            return Err(Error::UnknownSchema { topic: topic(), schema: channel.schema_id });
        }
        match self.summary.channels.get(&channel.id) {
            Some(known) if known == channel => return Ok(false),
            Some(_) => return Err(Error::ConflictingChannels { topic: topic() }),
            None => {}
        }
        self.channel_ids.insert(channel.id);
        self.summary.channels.insert(channel.id, channel.clone());
        Ok(true)
    }

    /// Refuses messages of a channel that has not been defined.
    fn require(&self, channel: u16, sequence: u32) -> Result<()> {
        match self.summary.channels.contains_key(&channel) {
            true => Ok(()),
            false => Err(Error::UnknownChannel { sequence, channel }),
        }
    }

    fn close_chunk(&mut self) -> Result<()> {
        if self.open.len() == 0 {
            return Ok(());
        }
        let (chunk, compression) = (std::mem::take(&mut self.open), self.compression);
        match self.take_offered(&chunk) {
            Some(packed) => self.enqueue(Placement::Verbatim(packed)),
            None => {
                let packing = self.workers.run(move || chunk.pack(compression));
                self.enqueue(Placement::Packing(packing))
            }
        }
    }

    /// The chunk with these records, if it was offered. Those before it are of no use any more; nor
    /// are all but the last where there is none, from which messages may still come.
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

    fn queue_behind_chunk(&mut self, placement: Placement) -> Result<()> {
        self.close_chunk()?;
        self.enqueue(placement)
    }

    /// Queues something, and places what is ready. Where more is waiting than keeps the threads
    /// busy, this waits for the front of it.
    fn enqueue(&mut self, placement: Placement) -> Result<()> {
        self.queue.push_back(placement);
        let most = if self.workers.is_parallel() { self.workers.threads() + 2 } else { 0 };
        self.place_all_but(most)
    }

    fn place_all_but(&mut self, most: usize) -> Result<()> {
        while let Some(mut next) = self.queue.pop_front() {
            if self.queue.len() < most && !next.is_ready() {
                self.queue.push_front(next);
                break;
            }
            self.place_next(next)?;
        }
        Ok(())
    }

    fn place_next(&mut self, next: Placement) -> Result<()> {
        let offset = self.offset;
        match next {
            Placement::Packing(chunk) => {
                let started = Instant::now();
                let chunk = chunk.wait().map_err(Error::io(&self.output))?;
                self.times.wait.take_since(started, 0);
                self.times.compress.take(chunk.ms, chunk.uncompressed_size);
                self.times.compressed_bytes += chunk.compressed_size;
                self.place_chunk(&chunk)
            }
            Placement::Verbatim(chunk) => self.place_chunk(&chunk),
            Placement::Record(record) => self.place(&[&record]),
            Placement::Attachment(
                record,
                AttachmentHeader { log_time, create_time, name, media_type },
                data_size,
            ) => {
                let length = record.len() as u64;
                self.summary.attachments.push(AttachmentIndex {
                    offset,
                    length,
                    log_time,
                    create_time,
                    data_size,
                    name,
                    media_type,
                });
                self.place(&[&record])
            }
            Placement::Metadata(record, name) => {
                let length = record.len() as u64;
                self.summary.metadata.push(MetadataIndex { offset, length, name });
                self.place(&[&record])
            }
        }
    }

    fn place_chunk(&mut self, chunk: &PackedChunk) -> Result<()> {
        let (indexes, index) = chunk.index(self.offset);
        self.summary.chunks.push(index);
        self.place(&[&chunk.start, &chunk.data, &indexes])
    }

    fn place(&mut self, parts: &[&[u8]]) -> Result<()> {
        let (started, before) = (Instant::now(), self.offset);
        for part in parts {
            self.sink.write_all(part).map_err(Error::io(&self.output))?;
            self.crc.update(part);
            self.offset += part.len() as u64;
        }
        self.times.write.take_since(started, self.offset - before);
        Ok(())
    }
}

/// Writes a file of any kind in the same way: it appears under its name when it is complete.
///
/// # Errors
/// [`Error::Io`], also if the output exists and may not be replaced.
pub fn write_file(output: &Path, bytes: &[u8], force: bool) -> Result<()> {
    let (mut file, partial) = PartialFile::create(output, force)?;
    file.write_all(bytes).and_then(|()| file.flush()).map_err(Error::io(output))?;
    drop(file);
    partial.put()
}
