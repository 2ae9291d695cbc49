//! MCAP recordings, read with every byte checked and written again as they are.
//!
//! [`Overview`] says what is in a recording. [`RecordingReader`] gives its records in the order of
//! the file, each with its place, and checks every checksum on the way. [`RecordingWriter`] copies
//! records, adds others, and gives the file its name when it is complete.
//!
//! ```
//! use std::collections::BTreeMap;
//!
//! use divmerge_recording::{
//!     MessageHeader, Overview, Record, RecordingReader, RecordingWriter, WriteOptions,
//! };
//!
//! # let folder = tempfile::tempdir()?;
//! # let [input, output] = ["in.mcap", "out.mcap"].map(|name| folder.path().join(name));
//! // A recording of one message.
//! let mut writer = RecordingWriter::create(&input, &WriteOptions::default())?;
//! let schema = writer.add_schema("std_msgs/msg/String", "ros2msg", b"string data")?;
//! let channel_id = writer.add_channel("/chatter", schema, "cdr", &BTreeMap::new())?;
//! let header = MessageHeader { channel_id, sequence: 0, log_time: 5, publish_time: 5 };
//! writer.write_message(&header, b"\0\x01\0\0\x03\0\0\0hi\0")?;
//! writer.finish()?;
//!
//! // A copy of it with one topic more.
//! let overview = Overview::read(&input)?;
//! let mut writer = RecordingWriter::create(&output, &WriteOptions::default())?;
//! writer.reserve(&overview);
//! let lengths = writer.add_channel("/lengths", 0, "json", &BTreeMap::new())?;
//! let mut reader = RecordingReader::open(&input)?;
//! while let Some(record) = reader.next_record()? {
//!     writer.copy(&record)?;
//!     if let Record::Message { header, data, .. } = record {
//!         let header = MessageHeader { channel_id: lengths, ..header };
//!         writer.write_message(&header, data.len().to_string().as_bytes())?;
//!     }
//! }
//! writer.finish()?;
//! assert_eq!(Overview::read(&output)?.message_count, 2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Damage
//!
//! Damage of a message ends reading with [`Error::Damaged`], which names the byte and what is wrong
//! there. What costs no message comes as a record: [`Record::Damaged`], such as a summary with a
//! wrong checksum, and [`Record::Truncated`] behind the last whole message of a file that is cut
//! off.
//!
//! # Chunks as they lie
//!
//! [`RecordingReader::next_part`] gives whole chunks, and [`RecordingWriter::copy_chunk`] places
//! them without compressing them again. With a [`ReadFilter`], chunks without a wanted message are
//! skipped, and others may stay unopened.
//!
//! # Threads and memory
//!
//! [`workers::Workers`] unpack and compress chunks; the bytes are the same on any number of
//! threads. A length is not believed before the bytes have been seen, and nothing grows with the
//! length of the recording but the index that the format itself keeps.
//!
//! # Addresses
//!
//! With the feature `remote`, paths can be addresses in object stores and on web servers
//! ([`address`]), which are read by range.
//!
//! # Compressed files
//!
//! A file whose name ends in `.zst` or `.zstd` is unpacked as it is read, from front to back.
//! Messages that are compressed each by itself, as rosbag2 writes them with `compression_mode:
//! message`, are given unpacked on request ([`RecordingReader::unpack_messages`]).
//!
//! # Types of the format
//!
//! [`Channel`], [`MessageHeader`], [`Metadata`] and [`AttachmentHeader`] are those of the `mcap`
//! crate, re-exported on purpose. No other type of a dependency is in the public face.

pub mod address;
mod chunk;
mod chunk_check;
mod compression;
mod damage;
mod encode;
mod error;
mod fields;
mod file_id;
mod file_kind;
mod filter;
mod index;
mod input;
mod inspect;
mod names;
mod open;
mod overview;
mod pack;
mod parse;
mod part;
mod partial;
mod plan;
mod reader;
mod record;
#[cfg(feature = "remote")]
mod remote;
mod shared_bytes;
mod source;
pub mod stopwatch;
mod summary;
mod unpacked;
pub mod workers;
mod writer;
mod zstd_file;

#[cfg(test)]
mod tests;

pub use mcap::records::{AttachmentHeader, Channel, MessageHeader, Metadata};

pub use address::{STANDARD_STREAM, is_remote, is_stream};
pub use compression::Compression;
pub use damage::Damage;
pub use error::{Error, Result};
pub use file_id::{is_at, is_same_file};
pub use filter::{MessageRange, ReadFilter, is_past};
pub use index::{ChunkPlace, window_around};
pub use input::Fetched;
pub use names::checksum;
pub use overview::Overview;
pub use part::{Item, Part, SourceChunk};
pub use partial::{
    PartialFile, abandon_partial_files, check_folder, check_output, create_hidden, lock_left,
    open_left, write_file,
};
pub use reader::{ReadTimes, RecordingReader};
pub use record::{Position, Record, Schema};
pub use shared_bytes::SharedBytes;
pub use unpacked::limit_unpacked;
pub use writer::{RecordingWriter, WriteOptions, WriteTimes};
