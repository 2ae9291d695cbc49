//! The records of a recording.

use std::borrow::Cow;
use std::collections::BTreeMap;

use mcap::records::{AttachmentHeader, Channel, MessageHeader, Metadata, SchemaHeader};

use crate::damage::Damage;

/// A message definition.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Schema {
    /// Id in the recording, never 0.
    pub id: u16,
    /// Name, such as `sensor_msgs/msg/PointCloud2`.
    pub name: String,
    /// Language of the definition, such as `ros2msg`.
    pub encoding: String,
    /// The definition.
    pub data: Vec<u8>,
}

impl Schema {
    pub(crate) fn new(header: SchemaHeader, data: &[u8]) -> Self {
        let SchemaHeader { id, name, encoding } = header;
        Schema { id, name, encoding, data: data.to_vec() }
    }
}

/// Where a message lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Position {
    /// Byte offset in the file of the chunk, or of the message's own record outside chunks.
    pub chunk_offset: u64,
    /// Messages before it in the chunk.
    pub index_in_chunk: u32,
}

/// One record, in the order of the file.
///
/// Indexes, statistics and offsets are checked but not given; a writer makes its own. Repeated
/// schemas and channels are given once.
#[derive(Debug, Clone, PartialEq)]
pub enum Record<'a> {
    /// The first record.
    Header {
        /// Convention that the recording follows, such as `ros2`; may be empty.
        profile: String,
        /// What wrote the recording.
        library: String,
    },
    /// A schema not seen before.
    Schema(Schema),
    /// A channel not seen before.
    Channel(Channel),
    /// A message.
    Message {
        /// Channel, sequence, log and publish time.
        header: MessageHeader,
        /// The message itself.
        data: Cow<'a, [u8]>,
        /// Where it lies.
        position: Position,
    },
    /// An attached file, or a piece of it: a larger file than 1 MiB comes in several pieces, one
    /// behind the other with no other record between them. The checksum has been checked with the
    /// last of them.
    Attachment {
        /// Name, media type and times.
        header: AttachmentHeader,
        /// Bytes of the file.
        size: u64,
        /// Bytes of the file before this piece.
        start: u64,
        /// The piece.
        data: Cow<'a, [u8]>,
    },
    /// A named table of strings.
    Metadata(Metadata),
    /// A record with an opcode of 0x80 or more, which the format leaves to applications.
    Private {
        /// The opcode.
        opcode: u8,
        /// The content.
        data: Cow<'a, [u8]>,
        /// Whether it lies inside a chunk.
        in_chunk: bool,
    },
    /// Chunks in which nothing passes the [`ReadFilter`](crate::ReadFilter) were skipped, unread.
    Skipped {
        /// Messages in them by numbered channel.
        counts: BTreeMap<u16, u64>,
    },
    /// Damage that costs no message: of the summary, or a record that this version of the format
    /// does not know. A writer leaves it out.
    Damaged {
        /// Byte offset in the file.
        offset: u64,
        /// What is wrong.
        damage: Damage,
    },
    /// The file is cut off here, behind its last whole message, or a second recording begins here.
    /// No record follows.
    Truncated {
        /// Byte offset in the file of what is cut or left out.
        offset: u64,
        /// What is missing.
        damage: Damage,
    },
}

impl Record<'_> {
    /// The same record with its bytes copied, to keep or to send to another thread.
    pub fn into_owned(self) -> Record<'static> {
        match self {
            Record::Header { profile, library } => Record::Header { profile, library },
            Record::Schema(schema) => Record::Schema(schema),
            Record::Channel(channel) => Record::Channel(channel),
            Record::Message { header, data, position } => {
                Record::Message { header, data: Cow::Owned(data.into_owned()), position }
            }
            Record::Attachment { header, size, start, data } => {
                let data = Cow::Owned(data.into_owned());
                Record::Attachment { header, size, start, data }
            }
            Record::Metadata(metadata) => Record::Metadata(metadata),
            Record::Private { opcode, data, in_chunk } => {
                Record::Private { opcode, data: Cow::Owned(data.into_owned()), in_chunk }
            }
            Record::Skipped { counts } => Record::Skipped { counts },
            Record::Damaged { offset, damage } => Record::Damaged { offset, damage },
            Record::Truncated { offset, damage } => Record::Truncated { offset, damage },
        }
    }
}
