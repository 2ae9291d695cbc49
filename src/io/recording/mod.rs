//! A recording: an MCAP file, read record by record and written again as the same recording.
//!
//! [`Overview`] says what is in a file, [`RecordingReader`] gives every record with its place and
//! checks every checksum on the way, [`RecordingWriter`] takes the records as they come and others
//! besides, and puts the file under its name only when it is whole. No memory grows with the length
//! of the recording beyond the index that the format itself asks for.

mod chunk;
mod encode;
mod index;
mod input;
mod overview;
mod pack;
mod parse;
mod part;
pub(crate) mod partial;
mod reader;
mod record;
#[cfg(feature = "remote")]
mod remote;
mod scan;
mod summary;
mod wanted;
mod words;
mod writer;

#[cfg(test)]
mod tests;

pub use index::ChunkPlace;
pub use input::Fetched;
pub use mcap::records::{AttachmentHeader, Channel, MessageHeader, Metadata};
pub use overview::Overview;
pub use part::{Item, Part, SharedBytes, SourceChunk};
pub use partial::{PartialFile, abandon_partial_files};
pub use reader::{ReadTimes, RecordingReader};
pub use record::{Position, Record, Schema};
pub use scan::{STANDARD_STREAM, is_stream};
pub use wanted::{FrameRange, Wanted};
pub(crate) use wanted::{is_behind, window_around};
pub use words::checksum;
pub use writer::{Compression, RecordingWriter, WriteOptions, WriteTimes, write_file};
