//! Recordings in the MCAP format, read record by record and written again as the same recording.
//!
//! [`Overview`] says what is in a file, [`RecordingReader`] gives every record with its place and
//! checks every checksum on the way, [`RecordingWriter`] takes the records as they come and others
//! besides, and puts the file under its name only when it is whole. No memory grows with the length
//! of the recording beyond the index that the format itself asks for.

pub mod address;
mod chunk;
mod compression;
mod encode;
mod error;
mod fetched;
mod fields;
mod file_kind;
mod filter;
mod index;
mod input;
mod inspect;
mod names;
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
mod source;
pub mod stopwatch;
mod summary;
pub mod workers;
mod writer;

#[cfg(test)]
mod tests;

pub use mcap::records::{AttachmentHeader, Channel, MessageHeader, Metadata};

pub use address::{STANDARD_STREAM, is_remote, is_stream};
pub use compression::Compression;
pub use error::{Error, Result};
pub use fetched::Fetched;
pub use filter::{MessageRange, ReadFilter, is_past};
pub use index::{ChunkPlace, window_around};
pub use names::checksum;
pub use overview::Overview;
pub use part::{Item, Part, SharedBytes, SourceChunk};
pub use partial::{PartialFile, abandon_partial_files, write_file};
pub use reader::{ReadTimes, RecordingReader};
pub use record::{Position, Record, Schema};
pub use writer::{RecordingWriter, WriteOptions, WriteTimes};
