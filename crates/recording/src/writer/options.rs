//! How to write a recording, and what writing took.

use serde::Serialize;

use crate::compression::Compression;
use crate::stopwatch::Steps;

/// How to write a recording.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct WriteOptions {
    /// Profile of the header, such as `ros2`. Default: none.
    pub profile: String,
    /// Library that wrote the input, named in the header of the output. Default: none.
    pub recorded_by: String,
    /// Compression of the chunks. Default: Zstandard.
    pub compression: Compression,
    /// Whether a file of the output's name may be replaced. Default: no.
    pub force: bool,
}

impl WriteOptions {
    /// The library that the header names.
    pub(super) fn library(&self) -> String {
        let version = concat!("divmerge ", env!("CARGO_PKG_VERSION"));
        match self.recorded_by.as_str() {
            "" => version.to_owned(),
            recorder => format!("{version} (recorded by {recorder})"),
        }
    }
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
