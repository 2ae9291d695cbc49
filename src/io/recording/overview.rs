//! What is in a recording, from its index where there is a good one.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mcap::records::{self, Channel};

use super::index::visit_summary;
use super::reader::RecordingReader;
use super::record::{Record, Schema};
use super::scan::is_stream;
use super::writer::Compression;
use crate::error::{Error, Result};
use crate::workers::Workers;

/// Problems that are kept; a file can have any number.
const MAX_PROBLEMS: usize = 16;

/// What is in a recording.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Overview {
    /// The file.
    pub path: PathBuf,
    /// Its bytes.
    pub file_size: u64,
    /// Convention that the recording follows, such as `ros2`; may be empty.
    pub profile: String,
    /// What wrote the recording.
    pub library: String,
    /// Whether the file ends with the magic that closes a recording.
    pub is_complete: bool,
    /// Whether all this comes from the file's own index, without reading the messages.
    pub from_summary: bool,
    /// Schemas by id.
    pub schemas: BTreeMap<u16, Schema>,
    /// Channels by id, also those without messages.
    pub channels: BTreeMap<u16, Channel>,
    /// Messages by channel; channels without messages may be absent.
    pub message_counts: BTreeMap<u16, u64>,
    /// All messages.
    pub message_count: u64,
    /// Earliest log time in nanoseconds, if there are messages.
    pub start_ns: Option<u64>,
    /// Latest log time in nanoseconds, if there are messages.
    pub end_ns: Option<u64>,
    /// Chunks.
    pub chunk_count: u64,
    /// Chunks by compression, the empty name for none. An index without chunks tells of none.
    pub compression: BTreeMap<String, u64>,
    /// Attachments.
    pub attachment_count: u64,
    /// Metadata records.
    pub metadata_count: u64,
    /// What was found wrong that costs no message, and where the file is cut off, in words. Only if
    /// the file had to be read through.
    pub problems: Vec<String>,
}

impl Overview {
    /// Looks at the index at the end of the file, or reads through the file where there is none or
    /// it cannot be trusted: checksum, counts of schemas, channels and messages must all agree.
    ///
    /// # Errors
    /// [`crate::Error::Io`]; [`crate::Error::Recording`] if the file is no MCAP, or had to be read
    /// through and is damaged. A file that is cut off is no error.
    pub fn read(path: &Path) -> Result<Self> {
        if is_stream(path) {
            let problem = "is no file but a stream, which is gone once it is read; `annotate` alone \
                           reads from one";
            let (path, problem) = (path.to_owned(), problem.to_owned());
            return Err(Error::Recording { path, offset: 0, problem });
        }
        let mut reader = RecordingReader::open_unhashed(path, &Workers::none())?;
        let known = reader.known_overview();
        if let Some(overview) = known.as_ref().and_then(|known| known.get()) {
            return Ok(overview.clone());
        }
        let mut overview = Overview::empty(path, &reader);
        overview.take_first(&mut reader)?;
        match overview.indexed() {
            Some(indexed) => Ok(indexed),
            None => {
                let overview = overview.read_through(reader)?;
                Ok(match known {
                    Some(known) => known.get_or_init(|| overview).clone(),
                    None => overview,
                })
            }
        }
    }

    /// What is known of a stream before its records: the header alone.
    ///
    /// # Errors
    /// Those of [`RecordingReader::next_record`].
    pub fn of_stream(reader: &mut RecordingReader, path: &Path) -> Result<Self> {
        let mut overview = Overview::empty(path, reader);
        overview.take_first(reader)?;
        Ok(overview)
    }

    /// The compression of most chunks; nothing if there is none, or none of it can be written here.
    pub fn usual_compression(&self) -> Option<Compression> {
        let most = self.compression.iter().max_by_key(|(_, count)| **count);
        most.and_then(|(name, _)| Compression::of_name(name))
    }

    /// Name of a message's definition by channel, if the channel has one.
    pub fn schema_of(&self, channel_id: u16) -> Option<&Schema> {
        self.schemas.get(&self.channels.get(&channel_id)?.schema_id)
    }

    /// Channels of a topic; more than one is allowed.
    pub fn channels_of(&self, topic: &str) -> impl Iterator<Item = &Channel> {
        self.channels.values().filter(move |channel| channel.topic == topic)
    }

    fn empty(path: &Path, reader: &RecordingReader) -> Self {
        Overview {
            path: path.to_owned(),
            file_size: reader.file_size(),
            is_complete: reader.is_complete(),
            ..Overview::default()
        }
    }

    fn take_first(&mut self, reader: &mut RecordingReader) -> Result<()> {
        if let Some(record) = reader.next_record()? {
            self.take(record);
        }
        Ok(())
    }

    fn read_through(mut self, mut reader: RecordingReader) -> Result<Self> {
        while let Some(record) = reader.next_record()? {
            self.take(record);
        }
        let counts = reader.counts();
        self.message_count = counts.messages;
        self.chunk_count = counts.chunks;
        self.attachment_count = counts.attachments;
        self.metadata_count = counts.metadata;
        self.compression = reader.compression;
        Ok(self)
    }

    fn take(&mut self, record: Record) {
        match record {
            Record::Header { profile, library } => {
                (self.profile, self.library) = (profile, library);
            }
            Record::Schema(schema) => {
                self.schemas.insert(schema.id, schema);
            }
            Record::Channel(channel) => {
                self.channels.insert(channel.id, channel);
            }
            Record::Message { header, .. } => {
                *self.message_counts.entry(header.channel_id).or_default() += 1;
                let time = header.log_time;
                self.start_ns = Some(self.start_ns.map_or(time, |start| start.min(time)));
                self.end_ns = Some(self.end_ns.map_or(time, |end| end.max(time)));
            }
            Record::Damaged { offset, problem } | Record::Truncated { offset, problem } => {
                if self.problems.len() < MAX_PROBLEMS {
                    self.problems.push(format!("{problem} (byte {offset})"));
                }
            }
            Record::Attachment { .. }
            | Record::Metadata(_)
            | Record::Private { .. }
            | Record::Passed { .. } => {}
        }
    }

    /// The same overview filled from the index, or `None` if that cannot be trusted.
    fn indexed(&self) -> Option<Self> {
        let mut indexed = self.clone();
        let mut statistics = None;
        visit_summary(&self.path, self.file_size, |record| match record {
            records::Record::Schema { header, data } => {
                let schema = Schema {
                    id: header.id,
                    name: header.name,
                    encoding: header.encoding,
                    data: data.into_owned(),
                };
                indexed.schemas.insert(schema.id, schema);
            }
            records::Record::Channel(channel) => {
                indexed.channels.insert(channel.id, channel);
            }
            records::Record::ChunkIndex(chunk) => {
                *indexed.compression.entry(chunk.compression).or_default() += 1;
            }
            records::Record::Statistics(found) => statistics = Some(found),
            _ => {}
        })?;
        indexed.with_statistics(statistics?)
    }

    /// Takes the counts over if they agree with what the index lists.
    fn with_statistics(mut self, statistics: records::Statistics) -> Option<Self> {
        let mut counts = statistics.channel_message_counts.values();
        let counted = counts.try_fold(0_u64, |sum, &count| sum.checked_add(count))?;
        let agrees = usize::from(statistics.schema_count) == self.schemas.len()
            && statistics.channel_count as usize == self.channels.len()
            && statistics.message_count == counted
            && self.has_schema_of_every_channel()
            && (statistics.channel_message_counts.keys()).all(|id| self.channels.contains_key(id));
        if !agrees {
            return None;
        }
        if counted > 0 {
            self.start_ns = Some(statistics.message_start_time);
            self.end_ns = Some(statistics.message_end_time);
        }
        self.message_count = counted;
        self.message_counts = statistics.channel_message_counts;
        self.chunk_count = statistics.chunk_count.into();
        self.attachment_count = statistics.attachment_count.into();
        self.metadata_count = statistics.metadata_count.into();
        self.from_summary = true;
        Some(self)
    }

    fn has_schema_of_every_channel(&self) -> bool {
        self.channels
            .values()
            .all(|channel| channel.schema_id == 0 || self.schemas.contains_key(&channel.schema_id))
    }
}
