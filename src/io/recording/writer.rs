//! Writing a recording beside its final name, and putting it there when it is whole.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use mcap::records::{AttachmentHeader, Channel, MessageHeader, Metadata};
use mcap::write::{NoSeek, PrivateRecordOptions};

use super::overview::Overview;
use super::partial::{PartialFile, at};
use super::record::{Record, Schema};
use crate::error::{Error, Result};

/// Uncompressed bytes after which a chunk is closed.
const CHUNK_SIZE: u64 = 4 << 20;

/// Compression of the output's chunks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Compression {
    /// None.
    None,
    /// LZ4 at its fastest level.
    Lz4,
    /// Zstandard at level 1.
    #[default]
    Zstd,
}

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

/// A recording being written. Until [`RecordingWriter::finish`] it has a temporary name in the
/// output's folder (`.NAME.XXXXXX.partial`), and is removed if it is never finished.
pub struct RecordingWriter {
    writer: mcap::Writer<NoSeek<BufWriter<File>>>,
    // Behind the writer, so that the file is closed before it is removed.
    partial: PartialFile,
    output: PathBuf,
    schemas: BTreeMap<u16, Schema>,
    channel_ids: BTreeSet<u16>,
}

impl RecordingWriter {
    /// Starts a recording that will be `output`.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder cannot be written to, or if the output exists and may not be
    /// replaced.
    pub fn create(output: &Path, options: &WriteOptions) -> Result<Self> {
        let (file, partial) = PartialFile::create(output, options.force)?;
        let library = match options.recorded_by.as_str() {
            "" => concat!("divmerge ", env!("CARGO_PKG_VERSION")).to_owned(),
            by => format!("divmerge {} (recorded by {by})", env!("CARGO_PKG_VERSION")),
        };
        let writer = mcap_options(options.compression)
            .profile(&options.profile)
            .library(library)
            .create(NoSeek::new(BufWriter::with_capacity(1 << 20, file)))
            .map_err(|error| write_error(output, error))?;
        Ok(RecordingWriter {
            writer,
            partial,
            output: output.to_owned(),
            schemas: BTreeMap::new(),
            channel_ids: BTreeSet::new(),
        })
    }

    /// Keeps the ids of a recording that is going to be copied away from what
    /// [`RecordingWriter::add_schema`] and [`RecordingWriter::add_channel`] hand out.
    pub fn reserve(&mut self, overview: &Overview) {
        let schemas = overview.schemas.iter();
        self.schemas.extend(schemas.map(|(&id, schema)| (id, schema.clone())));
        self.channel_ids.extend(overview.channels.keys());
    }

    /// Writes a record of another recording as it is, ids and times included. Its header, damage and
    /// truncation are left out.
    ///
    /// # Errors
    /// [`Error::Write`] for a record that contradicts one before it, [`Error::Io`].
    pub fn copy(&mut self, record: &Record) -> Result<()> {
        let written = match record {
            Record::Header { .. } | Record::Damaged { .. } | Record::Truncated { .. } => Ok(()),
            Record::Schema(schema) => return self.copy_schema(schema),
            Record::Channel(channel) => return self.copy_channel(channel),
            Record::Message { header, data, .. } => {
                self.writer.write_to_known_channel(header, data)
            }
            Record::Attachment { header, data } => self.writer.attach(&mcap::Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name.clone(),
                media_type: header.media_type.clone(),
                data: data.as_ref().into(),
            }),
            Record::Metadata(metadata) => self.writer.write_metadata(metadata),
            Record::Private { opcode, data, in_chunk } => {
                let options = in_chunk.then_some(PrivateRecordOptions::IncludeInChunks);
                self.writer.write_private_record(*opcode, data, options.into_iter().collect())
            }
        };
        written.map_err(|error| write_error(&self.output, error))
    }

    /// Adds a schema and returns its id: that of an equal one if there is one, else a new one.
    ///
    /// # Errors
    /// [`Error::Write`] if all 65535 ids are taken, [`Error::Io`].
    pub fn add_schema(&mut self, name: &str, encoding: &str, data: &[u8]) -> Result<u16> {
        let equal = |schema: &&Schema| {
            (schema.name.as_str(), schema.encoding.as_str()) == (name, encoding)
                && schema.data == data
        };
        let id = match self.schemas.values().find(equal) {
            Some(schema) => schema.id,
            None => free_id(self.schemas.last_key_value().map(|(&id, _)| id), |id| {
                self.schemas.contains_key(&id)
            })
            .ok_or(mcap::McapError::TooManySchemas)?,
        };
        self.copy_schema(&Schema {
            id,
            name: name.to_owned(),
            encoding: encoding.to_owned(),
            data: data.to_vec(),
        })?;
        Ok(id)
    }

    /// Adds a channel under a new id, which is returned. `schema_id` is 0 for none, or must have
    /// been returned by [`RecordingWriter::add_schema`].
    ///
    /// # Errors
    /// [`Error::Write`] if there is no such schema or all ids are taken, [`Error::Io`].
    pub fn add_channel(
        &mut self,
        topic: &str,
        schema_id: u16,
        message_encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<u16> {
        let id = free_id(self.channel_ids.last().copied(), |id| self.channel_ids.contains(&id))
            .ok_or(mcap::McapError::TooManyChannels)?;
        self.copy_channel(&Channel {
            id,
            schema_id,
            topic: topic.to_owned(),
            message_encoding: message_encoding.to_owned(),
            metadata: metadata.clone(),
        })?;
        Ok(id)
    }

    /// Writes a message to a channel that was added or copied.
    ///
    /// # Errors
    /// [`Error::Write`] for an unknown channel, [`Error::Io`].
    pub fn write_message(&mut self, header: &MessageHeader, data: &[u8]) -> Result<()> {
        self.writer
            .write_to_known_channel(header, data)
            .map_err(|error| write_error(&self.output, error))
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
        self.writer.write_metadata(&metadata).map_err(|error| write_error(&self.output, error))
    }

    /// Attaches a file, logged and created at a time in nanoseconds since 1970. This closes the current chunk.
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

    /// Completes the recording, makes sure that it is on the disk, gives it its name, and returns
    /// its size in bytes.
    ///
    /// # Errors
    /// [`Error::Io`], also if the output exists by now and may not be replaced. The temporary file
    /// is then removed.
    pub fn finish(mut self) -> Result<u64> {
        let output = self.output;
        self.writer.finish().map_err(|error| write_error(&output, error))?;
        let mut buffer = self.writer.into_inner().into_inner();
        buffer.flush().map_err(at(&output))?;
        let file = buffer.get_ref();
        file.sync_all().map_err(at(&output))?;
        let size = file.metadata().map_err(at(&output))?.len();
        self.partial.put()?;
        Ok(size)
    }

    fn copy_schema(&mut self, schema: &Schema) -> Result<()> {
        self.writer
            .add_schema_with_id(schema.id, &schema.name, &schema.encoding, &schema.data)
            .map_err(|error| write_error(&self.output, error))?;
        self.schemas.entry(schema.id).or_insert_with(|| schema.clone());
        Ok(())
    }

    fn copy_channel(&mut self, channel: &Channel) -> Result<()> {
        self.writer
            .add_channel_with_id(
                channel.id,
                channel.schema_id,
                &channel.topic,
                &channel.message_encoding,
                &channel.metadata,
            )
            .map_err(|error| write_error(&self.output, error))?;
        self.channel_ids.insert(channel.id);
        Ok(())
    }
}

fn mcap_options(compression: Compression) -> mcap::WriteOptions {
    let (compression, level) = match compression {
        Compression::None => (None, 0),
        Compression::Lz4 => (Some(mcap::Compression::Lz4), 0),
        Compression::Zstd => (Some(mcap::Compression::Zstd), 1),
    };
    mcap::WriteOptions::new()
        .compression(compression)
        .compression_level(level)
        // Threads inside zstd gained nothing when measured, and their number must not show in the
        // bytes.
        .compression_threads(0)
        .chunk_size(Some(CHUNK_SIZE))
        .disable_seeking(true)
        .calculate_chunk_crcs(true)
}

/// The id after the last, or else the first free one.
fn free_id(last: Option<u16>, is_taken: impl Fn(u16) -> bool) -> Option<u16> {
    last.unwrap_or(0).checked_add(1).or_else(|| (1..=u16::MAX).find(|&id| !is_taken(id)))
}

/// Writes a file of any kind in the same way: it appears under its name when it is complete.
///
/// # Errors
/// [`Error::Io`], also if the output exists and may not be replaced.
pub fn write_file(output: &Path, bytes: &[u8], force: bool) -> Result<()> {
    let (mut file, partial) = PartialFile::create(output, force)?;
    file.write_all(bytes).and_then(|()| file.flush()).map_err(at(output))?;
    drop(file);
    partial.put()
}

fn write_error(output: &Path, error: mcap::McapError) -> Error {
    match error {
        mcap::McapError::Io(source) => at(output)(source),
        error => Error::Write(error),
    }
}
