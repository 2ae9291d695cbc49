//! What can go wrong with a recording.

use std::io;
use std::path::{Path, PathBuf};

use crate::damage::Damage;

/// An error of a recording, with the file that it is about.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file is damaged, or is not a recording.
    #[error("{}: {damage} (byte {offset})", path.display())]
    Damaged {
        /// The recording.
        path: PathBuf,
        /// Byte offset of the damage in the file.
        offset: u64,
        /// What is wrong.
        damage: Damage,
    },

    /// The operating system or the object store failed.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file that was being read or written.
        path: PathBuf,
        /// The system's own error.
        source: io::Error,
    },

    /// Standard output takes nothing more: its reader has gone, or its disk is full.
    #[error("writing to standard output: {source}")]
    StandardOutput {
        /// The system's own error.
        source: io::Error,
    },

    /// The recording is at an address, and this build reads files only (feature `remote`).
    #[error(
        "{}: this divmerge was built without object stores. Install it with `cargo install \
         --path . --features remote`, or download the recording",
        path.display()
    )]
    NoRemote {
        /// The address.
        path: PathBuf,
    },

    /// The output was abandoned by [`abandon_partial_files`](crate::abandon_partial_files).
    #[error("interrupted; nothing was written to {}", path.display())]
    Interrupted {
        /// The output that was not written.
        path: PathBuf,
    },

    /// Schema ids are 1 to 65535; this one is 0.
    #[error("writing MCAP: Schema has an ID of 0")]
    SchemaIdZero,

    /// A schema was written before with the same id and another content.
    #[error("writing MCAP: Schema `{name}` has multiple records that don't match.")]
    ConflictingSchemas {
        /// Name of the second schema.
        name: String,
    },

    /// A channel was written before with the same id and another content.
    #[error("writing MCAP: Channel `{topic}` has multiple records that don't match.")]
    ConflictingChannels {
        /// Topic of the second channel.
        topic: String,
    },

    /// The schema of a channel was not written before it.
    #[error("writing MCAP: Channel `{topic}` referenced unknown schema {schema}")]
    UnknownSchema {
        /// Topic of the channel.
        topic: String,
        /// Id of the schema.
        schema: u16,
    },

    /// The channel of a message was not written before it.
    #[error("writing MCAP: Message {sequence} referenced unknown channel {channel}")]
    UnknownChannel {
        /// Sequence number of the message.
        sequence: u32,
        /// Id of the channel.
        channel: u16,
    },

    /// The pieces of an attachment did not come one behind the other.
    #[error(
        "writing MCAP: attachment `{name}` has {size} bytes, and behind the first {written} comes \
         something else"
    )]
    AttachmentPieces {
        /// Name of the attachment.
        name: String,
        /// Its bytes that were written.
        written: u64,
        /// All its bytes.
        size: u64,
    },

    /// All schema ids are taken.
    #[error("writing MCAP: cannot write more than 65535 schemas to one MCAP")]
    TooManySchemas,

    /// All channel ids are taken.
    #[error("writing MCAP: cannot write more than 65536 channels to one MCAP")]
    TooManyChannels,
}

impl Error {
    /// Turns an error of the system into one that names the file.
    pub(crate) fn io(path: &Path) -> impl Fn(io::Error) -> Error {
        move |source| Error::Io { path: path.to_owned(), source }
    }
}

/// Result of the functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;
