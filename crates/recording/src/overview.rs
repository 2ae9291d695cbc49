//! What is in a recording.

use std::collections::BTreeMap;
use std::path::PathBuf;

use mcap::records::Channel;

use crate::compression::Compression;
use crate::record::Schema;

/// What is in a recording.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Overview {
    /// The file.
    pub path: PathBuf,
    /// Its bytes; of a compressed file those of the recording in it.
    pub file_size: u64,
    /// Convention that the recording follows, such as `ros2`; may be empty.
    pub profile: String,
    /// What wrote the recording.
    pub library: String,
    /// Whether all that was recorded is there: the file is not cut off, and no second recording
    /// follows the first, which alone is read.
    pub is_complete: bool,
    /// Whether all this comes from the summary of the file, without reading its messages.
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
    /// Chunks by compression, the empty name for none; empty if the summary lists no chunks.
    pub compression: BTreeMap<String, u64>,
    /// Attachments.
    pub attachment_count: u64,
    /// Metadata records.
    pub metadata_count: u64,
    /// Damage that costs no message, and where the file is cut off, in words. Filled only if the
    /// file had to be read through.
    pub problems: Vec<String>,
}

impl Overview {
    /// The compression of most chunks; `None` without chunks, or if it cannot be written here.
    pub fn usual_compression(&self) -> Option<Compression> {
        let most = self.compression.iter().max_by_key(|(_, count)| **count);
        most.and_then(|(name, _)| Compression::of_name(name))
    }

    /// The schema of a channel, if it has one.
    pub fn schema_of(&self, channel_id: u16) -> Option<&Schema> {
        self.schemas.get(&self.channels.get(&channel_id)?.schema_id)
    }

    /// Channels of a topic; more than one is allowed.
    pub fn channels_of(&self, topic: &str) -> impl Iterator<Item = &Channel> {
        self.channels.values().filter(move |channel| channel.topic == topic)
    }
}
